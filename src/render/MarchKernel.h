// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "FieldBounds.h"
#include "curlew/field/Batch.h"
#include "curlew/math/Ray.h"

#include <cmath>

namespace curlew::detail {

/// What a ray that marches through a field has found.
struct MarchState {
    static constexpr double kNothingYet = 0;
    static constexpr double kHit = 1;
    static constexpr double kCut = 2; ///< It enters the box inside the surface.
    static constexpr double kMissed = 3;
};

struct MarchOptions {
    double value = 0; ///< Of the field on the surface.
    FieldBounds bounds = {};
    double resolution = 1; ///< World units.
    bool refines = true;   ///< Whether a hit is computed exactly.
};

/// Rays that march through a field, as a structure of arrays.
struct MarchBatch {
    using Numbers = std::array<double, kBatch>;

    PointBatch points; ///< Where the field is needed next.
    alignas(64) std::array<Numbers, 3> origin{}, direction{};
    alignas(64) Numbers t{};       ///< Distances of the points from the origins.
    alignas(64) Numbers end{};     ///< Where the rays leave the box.
    alignas(64) Numbers cuts{};    ///< 1 if the box cuts off what is inside the surface where the ray enters, else 0.
    alignas(64) Numbers side{};    ///< The sign, 1 or -1, of the field where the ray began; 0: unknown.
    alignas(64) Numbers below{};   ///< The last t on this side.
    alignas(64) Numbers reach{};   ///< The surface is not before this t, but for parts shorter than the resolution.
    alignas(64) Numbers beyond{};  ///< The first t on the other side; negative: none yet.
    alignas(64) Numbers samples{}; ///< Since the ray began, or since it has found the other side.
    alignas(64) Numbers state{};   ///< MarchState.

    void push(const Ray& ray, double begin, double leaves, bool isCut) {
        const auto n = static_cast<size_t>(points.size);
        for (size_t axis = 0; axis < 3; ++axis) {
            origin[axis][n] = ray.origin.c[axis];
            direction[axis][n] = ray.direction.c[axis];
        }
        t[n] = below[n] = reach[n] = begin;
        end[n] = leaves;
        cuts[n] = isCut ? 1 : 0;
        side[n] = samples[n] = 0;
        beyond[n] = -1;
        points.push(ray.origin + ray.direction * begin);
    }

    /// Replaces a ray by the last one, which leaves the batch.
    void replaceByLast(size_t n) {
        const auto last = static_cast<size_t>(--points.size);
        for (size_t axis = 0; axis < 3; ++axis)
            for (Numbers* numbers : {&points.c[axis], &origin[axis], &direction[axis]})
                (*numbers)[n] = (*numbers)[last];
        for (Numbers* numbers : {&t, &end, &cuts, &side, &below, &reach, &beyond, &samples})
            (*numbers)[n] = (*numbers)[last];
    }
};

/// Advances each ray to its next sample, given the field's jets at the current ones.
///
/// First, sphere tracing (Hart 1996) with larger steps (Keinert et al. 2014). The surface is no nearer than the height
/// divided by the Lipschitz bound, before and behind a sample; nor than where the parabola is 0 that has the sample's
/// height and slope and the largest second derivative. So if these intervals of two samples meet, the surface is not
/// between them. A step is as large as they would meet if the slope stayed the same; if they do not, the ray goes back
/// to the end of the first. Then, between two samples on different sides, Newton's method, with bisection if a step
/// would leave the interval.
struct MarchKernel {
    static constexpr double kMostSamples = 4096; ///< Only a ray along the surface takes hundreds.
    static constexpr double kRefinements = 40;
    static constexpr double kCaution = 0.95; ///< Part of the step at which the intervals just meet.
    static constexpr double kStep = 2.2;     ///< Typical step, relative to the first interval. Of several tried, the
                                             ///< one with the fewest samples.

    template <class T>
    static void run(const JetBatch<double, 1>& jets, const MarchOptions& o, MarchBatch& rays) {
        for (int i = 0; i < rays.points.size; i += kLanes<T>) {
            const auto n = static_cast<size_t>(i);
            const auto get = [n](const MarchBatch::Numbers& numbers) { return load<T>(&numbers[n]); };
            const auto set = [n](const T& value, MarchBatch::Numbers& numbers) { store(value, &numbers[n]); };
            const T zero(0), one(1), resolution(o.resolution), t = get(rays.t), end = get(rays.end);
            const auto jet = jets.lanes<T>(i);
            const T value = jet.value - T(o.value);
            T side = get(rays.side), slope(0);
            const auto begins = side == zero, inside = value < zero;
            side = select(begins, select(inside, T(-1), one), side);
            Vec<T, 3> from, along;
            for (size_t axis = 0; axis < 3; ++axis) {
                from.c[axis] = get(rays.origin[axis]);
                along.c[axis] = get(rays.direction[axis]);
                slope += jet.gradient.c[axis] * along.c[axis];
            }
            slope *= side;
            const T height = side * value, down = height / slope; // the surface is -down ahead if the slope stays
            const auto above = height > zero;
            T below = get(rays.below), beyond = get(rays.beyond), samples = get(rays.samples) + one;

            // On the first side.
            const T perL(1 / o.bounds.slope), M(o.bounds.bend), perM(1 / o.bounds.bend), free = max(height, zero);
            // A parabola of this height and slope that bends down by M is 0 at far on the side where it rises, and at
            // near on the other side.
            const auto rises = slope > zero;
            const auto sumOf = [&](const T& h) { return sqrt(slope * slope + T(2) * M * h) + abs(slope); };
            const auto far = [&](const T& sum) { return sum * perM; };
            const auto near = [&](const T& h, const T& sum) { return T(2) * h / max(sum, T(1e-300)); };
            const T sum = sumOf(free), within = free * perL;
            const T radius = max(within, select(rises, far(sum), near(free, sum)));
            const T behind = select(above, max(within, select(rises, near(free, sum), far(sum))), zero);
            const T reach = get(rays.reach);
            const auto found = beyond >= zero;
            const auto skips = (t - behind > reach) & !found;
            const auto arrives = (height <= zero) & !(found | skips);
            const auto brackets = found | arrives;
            const T least = max(select(slope < zero, min(-down, resolution), resolution), T(1e-3) * resolution);
            const T lines = (radius + within) / (one - min(slope * perL, T(0.5)));
            const T there = max(mulAdd(slope, T(kStep) * radius, free), zero), sumThere = sumOf(there);
            const T parabolas = radius + select(rises, near(there, sumThere), far(sumThere));
            const T meets = T(kCaution) * max(lines, parabolas);
            const T ahead = select(skips, reach, min(t + max(max(radius, meets), least), end));
            const auto leaves = ((t >= end) | !(abs(height) < T(HUGE_VAL))) & !(brackets | skips);

            // Between the sides.
            samples = select(arrives, zero, samples);
            below = select((above | !brackets) & !skips, t, below);
            beyond = select(brackets & !above, t, beyond);
            const auto slopes = abs(slope) > zero;
            const T newton = select(slopes, t - down, t);
            const auto converged = (slopes & (abs(newton - t) <= T(1e-9) * resolution)) | (height == zero) |
                                   (samples >= T(kRefinements)) | (beyond - below <= T(1e-12) * beyond);
            const T inner = select((newton > below) & (newton < beyond), newton, T(0.5) * (below + beyond));

            T state = select(leaves | (samples >= T(kMostSamples)), T(MarchState::kMissed), T(MarchState::kNothingYet));
            state = select(brackets & (o.refines ? converged : brackets), T(MarchState::kHit), state);
            state = select(begins & inside & (get(rays.cuts) > zero), T(MarchState::kCut), state);
            const T next = select(state > zero, t, select(brackets, inner, ahead));
            for (size_t axis = 0; axis < 3; ++axis)
                store(mulAdd(along.c[axis], next, from.c[axis]), &rays.points.c[axis][n]);
            set(next, rays.t);
            set(side, rays.side);
            set(below, rays.below);
            set(select(skips, reach, t + max(radius, resolution)), rays.reach);
            set(beyond, rays.beyond);
            set(samples, rays.samples);
            set(state, rays.state);
        }
    }
};

} // namespace curlew::detail
