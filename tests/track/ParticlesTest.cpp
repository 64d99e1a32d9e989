#include "curlew/track/Particles.h"

#include <catch2/catch.hpp>

using namespace curlew;

TEST_CASE("particles know what they carry", "[track]") {
    Particles particles;
    CHECK(particles.size() == 0);
    CHECK_FALSE(particles.hasVelocity());
    CHECK_FALSE(particles.hasTrack());
    particles.x = particles.y = particles.z = {1, 2};
    CHECK(particles.size() == 2);
    particles.vx = particles.vy = particles.vz = {0, 0};
    particles.f = particles.g = {0, 0};
    CHECK(particles.hasVelocity());
    CHECK(particles.hasTrack());
    CHECK(Particles::kBytes == 3 * 8 + 3 * 4 + 8 + 2 * 8 + 1);
}
