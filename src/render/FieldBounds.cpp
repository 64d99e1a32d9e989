// SPDX-License-Identifier: Apache-2.0
#include "FieldBounds.h"

#include "curlew/base/Error.h"
#include "curlew/base/Random.h"
#include "curlew/field/ForEachBatch.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

namespace curlew::detail {

namespace {

constexpr double kCaution = 1.5;

double squaredNorm(const Sym<double, 3>& hessian) {
    double sum = 0;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) sum += hessian(i, j) * hessian(i, j);
    return sum;
}

/// Returns bounds from random places.
template <int Order>
FieldBounds sampledBounds(const ScalarField& field, const Box& box) {
    constexpr uint64_t kSamples = 4096;
    double steepest = 0, squaredBend = 0;
    PointBatch points;
    JetBatch<double, Order> jets;
    for (uint64_t sample = 0; sample < kSamples; ++sample) {
        Vec3d p = box.lower;
        for (int axis = 0; axis < 3; ++axis)
            p[axis] += box.size()[axis] * randomUniform(0, sample, static_cast<uint64_t>(axis));
        points.push(p);
        if (!points.full()) continue;
        field.eval(points, jets);
        for (int k = 0; k < points.size; ++k) {
            const auto jet = jets[k];
            steepest = std::max(steepest, length(jet.gradient));
            // The Frobenius norm of the Hessian, which no second derivative along a line exceeds.
            if constexpr (Order >= 2) squaredBend = std::max(squaredBend, squaredNorm(jet.hessian));
        }
        points.size = 0;
    }
    FieldBounds bounds{.slope = kCaution * steepest};
    const double straight = 1e-6 * bounds.slope / length(box.size()); // that of a linear field is 0
    if constexpr (Order >= 2) bounds.bend = std::max(kCaution * std::sqrt(squaredBend), straight);
    return bounds;
}

/// The ends of an edge of a lattice between which a field takes a value.
struct Crossing {
    Vec3d below, above;
};

std::vector<Crossing> crossingsOf(const ScalarField& field, double value, const Box& box) {
    constexpr size_t kEdge = 48, kAll = kEdge * kEdge * kEdge;
    constexpr std::array<size_t, 3> kStep{kEdge * kEdge, kEdge, 1};
    const auto index = [&](size_t k, size_t axis) { return k / kStep[axis] % kEdge; };
    const auto place = [&](size_t k) {
        Vec3d p;
        for (int axis = 0; axis < 3; ++axis) {
            const double part = static_cast<double>(index(k, static_cast<size_t>(axis))) / (kEdge - 1);
            p[axis] = std::lerp(box.lower[axis], box.upper[axis], part);
        }
        return p;
    };
    std::vector<double> values(kAll);
    forEachBatch(PointsBy{kAll, place}, [&](const PointBatch& points, size_t begin) {
        JetBatch<double, 0> jets;
        field.eval(points, jets);
        std::copy_n(jets.c[0].data(), points.size, &values[begin]);
    });
    std::vector<Crossing> crossings;
    for (size_t k = 0; k < kAll; ++k)
        for (size_t axis = 0; axis < 3; ++axis) {
            if (index(k, axis) + 1 == kEdge) continue;
            const size_t next = k + kStep[axis];
            if (values[k] < value && values[next] >= value) crossings.push_back({place(k), place(next)});
            if (values[next] < value && values[k] >= value) crossings.push_back({place(next), place(k)});
        }
    return crossings;
}

/// Returns the steepest slope on the ways of a bisection to the value.
double steepestTowards(const ScalarField& field, double value, std::span<Crossing> crossings) {
    constexpr int kHalvings = 24;
    double steepest = 0;
    for (int halving = 0; halving < kHalvings; ++halving) {
        PointBatch middle;
        for (const Crossing& c : crossings) middle.push((c.below + c.above) * 0.5);
        JetBatch<double, 1> jets;
        field.eval(middle, jets);
        for (size_t k = 0; k < crossings.size(); ++k) {
            const auto jet = jets[static_cast<int>(k)];
            steepest = std::max(steepest, length(jet.gradient));
            (jet.value < value ? crossings[k].below : crossings[k].above) = middle[static_cast<int>(k)];
        }
    }
    return steepest;
}

} // namespace

FieldBounds boundsOf(const ScalarField& field, double value, const Box& box) {
    constexpr size_t kMost = 4096;
    FieldBounds bounds = field.homogeneous() ? sampledBounds<2>(field, box) : sampledBounds<1>(field, box);
    if (!field.homogeneous()) {
        std::vector<Crossing> crossings = crossingsOf(field, value, box);
        const size_t stride = crossings.size() / kMost + 1;
        std::vector<Crossing> some;
        for (size_t k = 0; k < crossings.size(); k += stride) some.push_back(crossings[k]);
        for (size_t begin = 0; begin < some.size(); begin += kBatch) {
            const auto part = std::span(some).subspan(begin, std::min<size_t>(kBatch, some.size() - begin));
            bounds.slope = std::max(bounds.slope, kCaution * steepestTowards(field, value, part));
        }
    }
    if (!(bounds.slope > 0))
        throw ValueError("the field is the same everywhere in the box, so it has no surface there");
    return bounds;
}

} // namespace curlew::detail
