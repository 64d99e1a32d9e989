// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/track/Points.h"
#include "support/Catch.h"

#include <limits>
#include <type_traits>

using namespace curlew;

namespace {

/// Particles whose arrays have values that depend on the id.
Points some(int64_t first, size_t count) {
    Points p;
    for (size_t k = 0; k < count; ++k) p.id.push_back(first + static_cast<int64_t>(k));
    forEachArray(p, [&](auto& values) {
        if constexpr (!std::is_same_v<std::decay_t<decltype(values)>, std::vector<int64_t>>)
            for (const int64_t id : p.id)
                values.push_back(static_cast<typename std::decay_t<decltype(values)>::value_type>(id));
    });
    return p;
}

template <class T>
std::vector<T> numbers(const std::vector<int64_t>& ids) {
    std::vector<T> values;
    for (const int64_t id : ids) values.push_back(static_cast<T>(id));
    return values;
}

void requireIds(const Points& p, const std::vector<int64_t>& ids) {
    forEachArray(p, [&](const auto& values) {
        CHECK(values == numbers<typename std::decay_t<decltype(values)>::value_type>(ids));
    });
}

} // namespace

TEST_CASE("Points: reports which attributes it carries", "[track]") {
    Points particles;
    CHECK(particles.size() == 0);
    CHECK_FALSE(particles.hasVelocity());
    CHECK_FALSE(particles.hasTrack());
    particles.x = particles.y = particles.z = {1, 2};
    CHECK(particles.size() == 2);
    particles.vx = particles.vy = particles.vz = {0, 0};
    particles.f = particles.g = {0, 0};
    CHECK(particles.hasVelocity());
    CHECK(particles.hasTrack());
    CHECK(Points::kBytes == 3 * 8 + 3 * 4 + 8 + 2 * 8 + 1 + 3 * 4);
}

TEST_CASE("forEachArray: visits every array of Points once", "[track]") {
    size_t bytes = 0;
    Points p;
    forEachArray(p, [&](auto& values) {
        CHECK(values.empty());
        values.resize(1);
        bytes += sizeof values[0];
    });
    CHECK(bytes == Points::kBytes);
    forEachArray(p, [&](const auto& values) { CHECK(values.size() == 1); });
}

TEST_CASE("Points: remove compacts all arrays and keeps the order", "[track]") {
    Points p = some(0, 6);
    p.remove({0, 1, 0, 0, 1, 0});
    requireIds(p, {0, 2, 3, 5});
    p.remove({0, 0, 0, 0});
    requireIds(p, {0, 2, 3, 5});
    CHECK_THROWS_AS(p.remove({0, 0}), ValueError);
    p.remove({1, 1, 1, 1});
    CHECK(p.size() == 0);
    Points bare; // empty arrays stay empty
    bare.x = bare.y = bare.z = {1, 2};
    bare.id = {1, 2};
    bare.remove({1, 0});
    CHECK(bare.id == std::vector<int64_t>{2});
    CHECK_FALSE(bare.hasVelocity());
}

TEST_CASE("Points: append keeps attributes and fills in defaults", "[track]") {
    Points p;
    p.append(some(3, 2));
    requireIds(p, {3, 4});
    p.append(some(7, 1));
    requireIds(p, {3, 4, 7});
    p.append({});
    requireIds(p, {3, 4, 7});

    Points bare;
    bare.x = bare.y = bare.z = {9};
    bare.id = {9};
    Points mixed = p;
    mixed.append(bare);
    CHECK(mixed.id == std::vector<int64_t>{3, 4, 7, 9});
    CHECK(mixed.vy == std::vector<float>{3, 4, 7, 0});
    CHECK(mixed.age == std::vector<float>{3, 4, 7, 0});
    CHECK(mixed.life.back() == std::numeric_limits<float>::infinity());
    CHECK(mixed.fade.back() == 1);
    Points fading = Points::at({{{0, 0, 0}}});
    fading.fade = {0.25F};
    fading.append(Points::at({{{1, 0, 0}}}));
    CHECK(fading.fade == std::vector<float>{0.25F, 1});
    CHECK(mixed.converged.back() == 1);
    CHECK_FALSE(mixed.hasTrack()); // an array that one of them lacks is removed
    bare.append(some(1, 1));
    CHECK(bare.age == std::vector<float>{0, 1});
    CHECK(bare.x == std::vector<double>{9, 1});
    CHECK(bare.f.empty());
    CHECK(bare.g.empty());
}

TEST_CASE("Points: grow adds age and removes particles past their life", "[track]") {
    Points p = some(0, 4);
    p.age = {0, 0, 1, 1};
    p.life = {1, 0.4F, 1.5F, std::numeric_limits<float>::infinity()};
    CHECK(p.grow(0.5) == 1);
    CHECK(p.id == std::vector<int64_t>{0, 2, 3});
    CHECK(p.age == std::vector<float>{0.5F, 1.5F, 1.5F}); // equal to the life: still alive
    CHECK(p.grow(0.5) == 1);
    CHECK(p.id == std::vector<int64_t>{0, 3});
    CHECK(p.grow(1000) == 1);
    CHECK(p.id == std::vector<int64_t>{3});
    Points ageless;
    ageless.x = ageless.y = ageless.z = {1};
    ageless.id = {1};
    CHECK(ageless.grow(5) == 0);
    CHECK_FALSE(ageless.hasAge());
}
