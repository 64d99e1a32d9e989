// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/Emission.h"

#include "curlew/base/Memory.h"
#include "curlew/base/Random.h"
#include "curlew/base/Require.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/track/Scatter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace curlew {

namespace {

constexpr uint64_t kLifeStream = uint64_t{1} << 32; // random numbers beyond those of the positions

/// Returns the ages at the end of a frame of the particles born in it, in order of birth.
std::vector<float> agesOfBirths(double rate, double duration, double& rates) {
    if (duration == 0) return {};
    // Multiply the sum of the rates, so that for a constant rate the number of births after any number of frames is
    // exact.
    const double before = rates * duration;
    rates += rate;
    const double after = rates * duration, born = std::floor(before), count = std::floor(after) - born;
    requireMemory(count * Points::kBytes, fmt::format("{} births in one frame", count), "choose a smaller rate");
    std::vector<float> ages(static_cast<size_t>(count));
    for (size_t k = 0; k < ages.size(); ++k)
        ages[k] = static_cast<float>(std::max(0.0, after - born - static_cast<double>(k + 1)) / rate);
    return ages;
}

/// Moves each particle along the normal for its age. A particle that would hit another part of the wall stays.
void leaveSurface(const ScalarField& distance, const EmissionOptions& o, Points& born) {
    const double side = o.place.level < 0 ? -1 : 1;
    for (auto* array : {&born.vx, &born.vy, &born.vz}) array->resize(born.size());
    forEachBatch(born, [&](const PointBatch& points, size_t begin) {
        JetBatch<double, 1> jets;
        distance.eval(points, jets);
        PointBatch moved = points;
        std::array<Vec3d, kBatch> velocity;
        for (int i = 0; i < points.size; ++i) {
            const Vec3d normal = jets[i].gradient * (side / std::max(length(jets[i].gradient), 1e-12));
            velocity[static_cast<size_t>(i)] = normal * o.normalSpeed;
            const auto age = static_cast<double>(born.age[begin + static_cast<size_t>(i)]);
            moved.set(i, points[i] + velocity[static_cast<size_t>(i)] * age);
        }
        distance.eval(moved, jets);
        std::array<bool, kBatch> allowed;
        allowed.fill(true);
        std::array<double, kBatch> ignored;
        if (o.place.clear) classify(*o.place.clear, moved, allowed, ignored);
        for (int i = 0; i < points.size; ++i) {
            const size_t k = begin + static_cast<size_t>(i);
            born.setVelocity(k, velocity[static_cast<size_t>(i)]);
            if (side * jets[i].value > 0 && allowed[static_cast<size_t>(i)]) born.setPosition(k, moved[i]);
        }
    });
}

} // namespace

Points emitted(const Domain& domain, const EmissionOptions& options, double duration, EmissionState& state,
               const Monitor& monitor) {
    return emitted(std::span(&domain, 1), options, duration, state, monitor);
}

Points emitted(std::span<const Domain> domains, const EmissionOptions& o, double duration, EmissionState& state,
               const Monitor& monitor) {
    if (o.rate != 0) requirePositive(o.rate, "the rate of births");
    if (duration != 0) requirePositive(duration, "the duration of a frame");
    const std::vector<float> ages = agesOfBirths(o.rate, duration, state.rates); // the oldest first
    ScatterOptions place = o.place;
    place.seed = o.seed;
    Points born;
    auto begin = ages.begin();
    for (size_t k = 0; k < domains.size(); ++k) {
        const double later =
            duration * static_cast<double>(domains.size() - 1 - k) / static_cast<double>(domains.size());
        const auto end = k + 1 == domains.size() ? ages.end() : std::find_if(begin, ages.end(), [&](float age) {
            return static_cast<double>(age) < later;
        });
        Points part = scatterFrom(domains[k], state.nextId, static_cast<size_t>(end - begin), place, monitor);
        state.nextId += end - begin;
        part.age.assign(begin, end);
        if (o.normalSpeed > 0 && place.on == ScatterOn::surface) leaveSurface(domains[k].wall->sdf.distance, o, part);
        begin = end;
        if (k == 0)
            born = std::move(part);
        else
            born.append(part);
    }
    if (!std::isfinite(o.life)) return born;
    born.life.resize(born.size());
    for (size_t k = 0; k < born.size(); ++k) {
        const double part = 2 * randomUniform(o.seed, static_cast<uint64_t>(born.id[k]), kLifeStream) - 1;
        born.life[k] = static_cast<float>(o.life * (1 + o.spread * part));
    }
    born.grow(0);
    return born;
}

void joinFlow(const Flow& flow, const Points& others, Points& born) {
    if (!others.hasVelocity()) return;
    for (auto* array : {&born.vx, &born.vy, &born.vz}) array->resize(born.size());
    if (others.hasTrack())
        for (auto* array : {&born.f, &born.g}) array->resize(born.size());
    forEachBatch(born, [&](const PointBatch& points, size_t begin) {
        Flow::Jets<double> potentials;
        VecBatch<double> velocity;
        flow.eval(points, potentials, velocity);
        for (int i = 0; i < points.size; ++i) {
            const size_t k = begin + static_cast<size_t>(i);
            born.setVelocity(k, velocity[i]);
            if (others.hasTrack()) born.f[k] = potentials[0][i].value, born.g[k] = potentials[1][i].value;
        }
    });
}

std::vector<uint8_t> flagBeyondWall(const Points& particles, const Domain& domain, const Monitor& monitor) {
    std::vector<uint8_t> flags(particles.size());
    forEachBatch(
        particles,
        [&](const PointBatch& points, size_t begin) {
            std::array<bool, kBatch> allowed;
            std::array<double, kBatch> distance;
            classify(domain, points, allowed, distance);
            for (size_t i = 0; i < static_cast<size_t>(points.size); ++i)
                flags[begin + i] = static_cast<uint8_t>(!allowed[i]);
        },
        monitor);
    return flags;
}

void wrap(Points& particles, const Box& box) {
    if (!box.finite()) throw ValueError("particles cannot wrap around in an infinite box");
    const std::array<std::vector<double>*, 3> axes{&particles.x, &particles.y, &particles.z};
    for (int axis = 0; axis < 3; ++axis) {
        const double lower = box.lower[axis], upper = box.upper[axis], period = upper - lower;
        if (period == 0) continue;
        for (double& value : *axes[static_cast<size_t>(axis)]) {
            value -= period * std::floor((value - lower) / period);
            if (value >= upper) value = lower; // by rounding
        }
    }
}

} // namespace curlew
