// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Error.h"
#include "curlew/flow/Flow.h"

#include <fmt/format.h>

#include <optional>
#include <variant>

namespace curlew::app {

/// A field or a flow whose dimension is only known while the program runs.
using AnyField = std::variant<ScalarFieldN<1>, ScalarFieldN<2>, ScalarFieldN<3>, ScalarFieldN<4>, ScalarFieldN<5>,
                              ScalarFieldN<6>, ScalarFieldN<7>>;
/// Signed distances and walls, which there are in the plane and in space.
using AnySdf = std::variant<SdfN<2>, Sdf>;
using AnyWall = std::variant<WallN<2>, Wall>;
using AnyFlow = std::variant<FlowN<2>, FlowN<3>, FlowN<4>, FlowN<5>, FlowN<6>, FlowN<7>>;

/// Of what the variant holds.
template <class Any>
int dimensionOf(const Any& any) {
    return std::visit([](const auto& object) { return std::remove_cvref_t<decltype(object)>::kDimension; }, any);
}

/// The field in space: one of 1 or 2 dimensions is the same along the others. ValueError for those of more than 3.
ScalarField inSpace(const AnyField& field);
/// The flow in space: one of 2 dimensions is the same in every plane of constant z, in a slab around z = 0 that is an
/// eighth of its box thick. ValueError for those of more than 3.
Flow inSpace(const AnyFlow& flow);
/// The shape, or wall, in space: one of 2 dimensions goes on along z for ever.
Sdf inSpace(const AnySdf& sdf);
Wall inSpace(const AnyWall& wall);
/// The box of a shape, one of 2 dimensions in such a slab; nullopt if it is infinite.
std::optional<Box> boxOf(const AnySdf& sdf);

/// What `combine(a, b)` makes of two fields of the same dimension, whichever that is; or of both in space, where one
/// has 3 dimensions and the other fewer. ValueError where they do not fit.
template <class Combine>
AnyField combined(const AnyField& a, const AnyField& b, const Combine& combine) {
    const int n = dimensionOf(a), m = dimensionOf(b);
    if (n != m && std::max(n, m) == 3) return combine(inSpace(a), inSpace(b));
    if (n != m)
        throw ValueError(
            fmt::format("the two fields have {} and {} dimensions; -lift brings one down to the other's", n, m));
    return std::visit(
        [&](const auto& p) -> AnyField { return combine(p, std::get<std::remove_cvref_t<decltype(p)>>(b)); }, a);
}

} // namespace curlew::app
