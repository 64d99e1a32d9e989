// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Points.h"

#include <array>
#include <vector>

namespace curlew {

/// Throws ValueError if the arrays of the particles differ in length.
void checkArrays(const Points& particles);

/// Throws ValueError if an id does not fit in 32 bits.
void checkIds(const Points& particles);

/// A float attribute of particles, with its name in files.
struct Scalar {
    const char* name;
    std::vector<float> Points::*floats = nullptr;
    std::vector<double> Points::*doubles = nullptr;

    bool in(const Points& p) const { return floats ? !(p.*floats).empty() : !(p.*doubles).empty(); }
    float of(const Points& p, size_t n) const { return floats ? (p.*floats)[n] : static_cast<float>((p.*doubles)[n]); }
    void resize(Points& p, size_t size) const { floats ? (p.*floats).resize(size) : (p.*doubles).resize(size); }
    void set(Points& p, size_t n, float value) const {
        if (floats)
            (p.*floats)[n] = value;
        else
            (p.*doubles)[n] = static_cast<double>(value);
    }
};

inline const std::array<Scalar, 5> kScalars{{{"age", &Points::age, nullptr},
                                             {"life", &Points::life, nullptr},
                                             {"fade", &Points::fade, nullptr},
                                             {"f", nullptr, &Points::f},
                                             {"g", nullptr, &Points::g}}};

/// Returns the scalars that the particles have.
std::vector<Scalar> scalarsOf(const Points& particles);

} // namespace curlew
