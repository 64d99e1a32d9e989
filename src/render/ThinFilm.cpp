// SPDX-License-Identifier: Apache-2.0
#include "curlew/render/ThinFilm.h"

#include "curlew/base/Parallel.h"
#include "curlew/base/Require.h"
#include "curlew/picture/Display.h"

#include <numbers>

namespace curlew {

namespace {

constexpr size_t kThicknesses = 512, kCosines = 64;

/// Returns the CIE 1931 curves at a wavelength, nm (Wyman, Sloan and Shirley 2013, the multi-lobe fit).
Vec3d matchingCurves(double wavelength) {
    const auto lobe = [&](double height, double peak, double before, double after) {
        const double t = (wavelength - peak) * (wavelength < peak ? before : after);
        return height * std::exp(-0.5 * t * t);
    };
    return {
        {lobe(0.362, 442.0, 0.0624, 0.0374) + lobe(1.056, 599.8, 0.0264, 0.0323) + lobe(-0.065, 501.1, 0.0490, 0.0382),
         lobe(0.821, 568.8, 0.0213, 0.0247) + lobe(0.286, 530.9, 0.0613, 0.0322),
         lobe(1.217, 437.0, 0.0845, 0.0278) + lobe(0.681, 459.0, 0.0385, 0.0725)}};
}

double square(double x) { return x * x; }

/// Returns Airy's sum for an amplitude r at each face.
double airy(double r, double cosPhase) {
    const double part = square(r);
    return 2 * part * (1 - cosPhase) / (1 + square(part) - 2 * part * cosPhase);
}

} // namespace

Vec3d ThinFilm::integrated(double thickness, double cosine, double refractiveIndex) {
    const double n = refractiveIndex, outside = std::clamp(cosine, 1e-4, 1.0);
    const double inside = std::sqrt(1 - (1 - outside * outside) / (n * n)); // Snell's law
    const double s = (outside - n * inside) / (outside + n * inside),
                 p = (n * outside - inside) / (n * outside + inside);
    Vec3d light, white;
    for (int nanometres = 380; nanometres <= 780; nanometres += 5) {
        const double wavelength = nanometres;
        const double cosPhase = std::cos(4 * std::numbers::pi * n * thickness * inside / wavelength);
        const Vec3d curves = matchingCurves(wavelength);
        light += curves * (0.5 * (airy(s, cosPhase) + airy(p, cosPhase)));
        white += curves;
    }
    const Vec3d rgb = linearFromXyz(light), rgbOfWhite = linearFromXyz(white);
    return {{rgb[0] / rgbOfWhite[0], rgb[1] / rgbOfWhite[1], rgb[2] / rgbOfWhite[2]}};
}

ThinFilm::ThinFilm(double greatestThickness, double refractiveIndex) : mGreatest(greatestThickness) {
    requirePositive(greatestThickness, "the thickness of a film");
    if (!(refractiveIndex > 1) || !std::isfinite(refractiveIndex))
        throw ValueError(fmt::format("the refractive index {} of a film must be above 1", refractiveIndex));
    mTable.resize(kThicknesses * kCosines);
    parallelFor(kThicknesses, 8, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i)
            for (size_t j = 0; j < kCosines; ++j) {
                const Vec3d rgb = integrated(greatestThickness * static_cast<double>(i) / (kThicknesses - 1),
                                             square(static_cast<double>(j) / (kCosines - 1)), refractiveIndex);
                for (int c = 0; c < 3; ++c) mTable[i * kCosines + j][c] = static_cast<float>(rgb[c]);
            }
    });
}

Vec3d ThinFilm::reflectance(double thickness, double cosine) const {
    if (std::isnan(thickness) || std::isnan(cosine)) return {};
    const double u = std::clamp(thickness / mGreatest, 0.0, 1.0) * (kThicknesses - 1);
    const double v = std::sqrt(std::clamp(cosine, 0.0, 1.0)) * (kCosines - 1);
    const size_t i = std::min(static_cast<size_t>(u), kThicknesses - 2),
                 j = std::min(static_cast<size_t>(v), kCosines - 2);
    const auto a = static_cast<float>(u - static_cast<double>(i)), b = static_cast<float>(v - static_cast<double>(j));
    const Vec3f* row = &mTable[i * kCosines + j];
    const Vec3f* next = row + kCosines;
    const Vec3f mixed = (row[0] * (1 - b) + row[1] * b) * (1 - a) + (next[0] * (1 - b) + next[1] * b) * a;
    Vec3d rgb;
    for (int c = 0; c < 3; ++c) rgb[c] = static_cast<double>(mixed[c]);
    return rgb;
}

} // namespace curlew
