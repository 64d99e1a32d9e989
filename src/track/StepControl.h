// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace curlew::detail {

/// Returns 2^(eighths / 8). It is the same on every processor, which the standard library's functions do not guarantee.
inline double powerOfTwo(int eighths) {
    constexpr std::array<double, 8> kPowers{1,
                                            1.0905077326652577,
                                            1.189207115002721,
                                            1.2968395546510096,
                                            1.4142135623730951,
                                            1.5422108254079407,
                                            1.681792830507429,
                                            1.8340080864093424};
    const int whole = eighths >= 0 ? eighths / 8 : -((7 - eighths) / 8);
    return std::ldexp(kPowers[static_cast<size_t>(eighths - 8 * whole)], whole);
}

/// Chooses the length of the next step from the estimated error of the last one, which grows with the length to the
/// power of `order`. The choice is the longest step whose error would be kAim of the allowed one (Hairer, Nørsett and
/// Wanner, "Solving Ordinary Differential Equations I", section II.4). Step lengths change by powers of 2^(1/8).
class StepControl {
  public:
    explicit StepControl(int order) {
        for (int k = 0; k < kFactors; ++k) {
            mFactors[static_cast<size_t>(k)] = powerOfTwo(k + kMin);
            mMax[static_cast<size_t>(k)] = kAim * powerOfTwo(-(k + kMin) * order);
        }
    }

    /// Returns the factor for the length of a step whose error, relative to the allowed one, was `error`; the smallest
    /// factor for NaN.
    double factor(double error) const {
        size_t k = 0; // mMax decreases; counting all has no branch that would be mispredicted
        for (size_t i = 1; i < mMax.size(); ++i) k += error <= mMax[i];
        return mFactors[k];
    }

  private:
    static constexpr double kAim = 0.2;                      ///< Measured: larger values make many steps fail.
    static constexpr int kMin = -16, kFactors = 16 + 16 + 1; ///< From 1/4 to 4, in powers of 2^(1/8).
    std::array<double, kFactors> mFactors{};
    std::array<double, kFactors> mMax{}; ///< Maximum relative error for each factor.
};

} // namespace curlew::detail
