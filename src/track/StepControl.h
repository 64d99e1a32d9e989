// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace curlew::detail {

/// 2^(eighths / 8), the same on every processor, which the functions of the standard library do not promise.
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
/// power of `order`: the longest whose error would be kAim of what is allowed (Hairer, Nørsett and Wanner, "Solving
/// Ordinary Differential Equations I", section II.4). A step becomes longer or shorter by a power of 2^(1/8).
class StepControl {
  public:
    explicit StepControl(int order) {
        for (int k = 0; k < kFactors; ++k) mMost[static_cast<size_t>(k)] = kAim * powerOfTwo(-(k + kLeast) * order);
    }

    /// By how much to multiply a step whose error was `error`, relative to what is allowed; the smallest factor for
    /// NaN.
    double factor(double error) const {
        int k = kFactors - 1;
        while (k > 0 && !(error <= mMost[static_cast<size_t>(k)])) --k;
        return powerOfTwo(k + kLeast);
    }

  private:
    static constexpr double kAim = 0.2;                        ///< By measurement: larger, and many steps are redone.
    static constexpr int kLeast = -16, kFactors = 16 + 16 + 1; ///< From a quarter to four times, in eighths of a power.
    std::array<double, kFactors> mMost{};                      ///< Errors, relative, up to which each factor will do.
};

} // namespace curlew::detail
