#pragma once

#include "curlew/track/Particles.h"

#include <array>
#include <vector>

namespace curlew {

/// Throws ValueError if the arrays of the particles differ in length.
void checkArrays(const Particles& particles);

/// Throws ValueError if an id does not fit in 32 bits.
void checkIds(const Particles& particles);

/// One number for each particle, in files a float of this name.
struct Scalar {
    const char* name;
    std::vector<float> Particles::*floats = nullptr;
    std::vector<double> Particles::*doubles = nullptr;

    bool in(const Particles& p) const { return floats ? !(p.*floats).empty() : !(p.*doubles).empty(); }
    float of(const Particles& p, size_t n) const {
        return floats ? (p.*floats)[n] : static_cast<float>((p.*doubles)[n]);
    }
    void resize(Particles& p, size_t size) const { floats ? (p.*floats).resize(size) : (p.*doubles).resize(size); }
    void set(Particles& p, size_t n, float value) const {
        if (floats)
            (p.*floats)[n] = value;
        else
            (p.*doubles)[n] = static_cast<double>(value);
    }
};

inline const std::array<Scalar, 4> kScalars{{{"age", &Particles::age, nullptr},
                                             {"life", &Particles::life, nullptr},
                                             {"f", nullptr, &Particles::f},
                                             {"g", nullptr, &Particles::g}}};

/// Those that the particles have.
std::vector<Scalar> scalarsOf(const Particles& particles);

} // namespace curlew
