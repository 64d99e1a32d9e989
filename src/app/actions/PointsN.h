// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/run/Context.h"

#include <filesystem>

namespace curlew::app {

// Points of 4 to 7 dimensions (PointSet::positionsN).

/// Calls use(std::integral_constant<int, N>()) for a dimension from 4 to 7.
template <class Use>
decltype(auto) withDimension(int dimension, const Use& use) {
    switch (dimension) {
        case 4:
            return use(std::integral_constant<int, 4>());
        case 5:
            return use(std::integral_constant<int, 5>());
        case 6:
            return use(std::integral_constant<int, 6>());
        default:
            return use(std::integral_constant<int, 7>());
    }
}

/// Returns a box of N dimensions. Axes beyond z have the range of x.
template <int N>
BoxN<N> boxInDimension(const Box& box) {
    BoxN<N> wider;
    for (int axis = 0; axis < N; ++axis) {
        wider.lower[axis] = box.lower[axis < 3 ? axis : 0];
        wider.upper[axis] = box.upper[axis < 3 ? axis : 0];
    }
    return wider;
}

/// Returns the dimension of the points to make: dimensions= if it is given, else that of the flow of the input, else 3.
int pointDimension(const Context& c, const Arguments& a, std::string_view input);

/// Returns the domain for points of N > 3 dimensions: that of the flow of the input if there is one, with the box of
/// box= if it is given; else that box, else the cube from -1 to 1. Throws ValueError if the input is a shape or level
/// set, or a flow of another dimension.
template <int N>
DomainN<N> domainOfPointsN(const Context& c, const Arguments& a, std::string_view input) {
    DomainN<N> domain;
    if (c.has(input)) {
        if (c.kind(input) != Kind::flow)
            throw ValueError(fmt::format("points of {} dimensions need a flow or a box, not a shape or level set", N));
        const auto* flow = std::get_if<FlowN<N>>(&c.anyFlow(input));
        if (!flow)
            throw ValueError(fmt::format("points of {} dimensions do not fit the flow, which has {}", N,
                                         dimensionOf(c.anyFlow(input))));
        domain = flow->domain();
    }
    if (a.given("box")) domain.box = boxInDimension<N>(a.box("box"));
    return domain;
}

/// Outputs new points.
inline void givePointsN(Context& c, AnyPositions positions) {
    c.give(std::make_shared<PointSet>(PointSet{.positionsN = std::move(positions)}));
}

/// Returns whether the first line of a .csv names coordinates x0, x1, ….
bool hasNumberedCoordinates(const std::filesystem::path& csv);

/// Writes x0,x1,… with a header line and 17 significant digits, so that no bit is lost. Throws Interrupted once
/// `cancelled` returns true.
void writePointsN(const std::filesystem::path& csv, const AnyPositions& positions,
                  const std::function<bool()>& cancelled);

} // namespace curlew::app
