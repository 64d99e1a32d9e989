// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/render/ThinFilm.h"
#include "support/Catch.h"

#include <limits>

using namespace curlew;

TEST_CASE("ThinFilm: a vanishing film is black and a film at grazing angle is a mirror", "[render]") {
    for (const double cosine : {0.1, 0.5, 1.0})
        for (const double part : ThinFilm::integrated(0, cosine, 1.33).c) CHECK(std::abs(part) < 1e-12);
    const Vec3d grazing = ThinFilm::integrated(300, 0, 1.33);
    for (const double part : grazing.c) CHECK(part == Approx(1).epsilon(0.01));
}

TEST_CASE("ThinFilm: reflectance matches interference at quarter and half wavelength and thick films", "[render]") {
    // Straight on: r = (n - 1) / (n + 1), and the most is (2 r / (1 + r²))²; green at 4 n d = 550 nm is near it.
    const double r = 0.33 / 2.33, most = 4 * r * r / ((1 + r * r) * (1 + r * r));
    const double green = ThinFilm::integrated(550 / (4 * 1.33), 1, 1.33)[1];
    CHECK(green <= most * 1.01); // linear sRGB subtracts a little of its neighbours
    CHECK(green > 0.97 * most);
    // Twice that: dark in green, so it looks purple.
    const Vec3d purple = ThinFilm::integrated(550 / (2 * 1.33), 1, 1.33);
    CHECK(purple[1] < 0.3 * purple[0]);
    CHECK(purple[1] < 0.3 * purple[2]);
    // A film that is thick against the coherence of daylight has no colour: its mean is 2 r² / (1 + r²).
    const Vec3d thick = ThinFilm::integrated(4000, 1, 1.33);
    for (const double part : thick.c) CHECK(part == Approx(2 * r * r / (1 + r * r)).epsilon(0.15));
}

TEST_CASE("ThinFilm: the table approximates the integral", "[render]") {
    const ThinFilm film(1200);
    double worst = 0;
    for (double thickness = 3.7; thickness < 1200; thickness += 31.3)
        for (double cosine = 0.06; cosine < 1; cosine += 0.0711) {
            const Vec3d table = film.reflectance(thickness, cosine),
                        integral = ThinFilm::integrated(thickness, cosine, 1.33);
            worst = std::max(worst, length(table - integral));
        }
    CHECK(worst < 0.01);
    CHECK(film.reflectance(5000, 1) == film.reflectance(1200, 1));
    CHECK_THROWS_AS(ThinFilm(0), ValueError);
    CHECK_THROWS_AS(ThinFilm(500, 1), ValueError);
}

TEST_CASE("ThinFilm: NaN is black", "[render]") {
    const ThinFilm film(900);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK(film.reflectance(nan, 0.5) == Vec3d{});
    CHECK(film.reflectance(300, nan) == Vec3d{});
}
