// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Error.h"
#include "curlew/flow/Flow.h"

#include <fmt/format.h>

#include <optional>
#include <variant>
#include <vector>

namespace curlew::app {

/// A field whose dimension is only known at run time; AnyFlow is the same for flows.
using AnyField = std::variant<ScalarFieldN<1>, ScalarFieldN<2>, ScalarFieldN<3>, ScalarFieldN<4>, ScalarFieldN<5>,
                              ScalarFieldN<6>, ScalarFieldN<7>>;
/// Signed distances and walls, which exist in 2D and 3D only.
using AnySdf = std::variant<SdfN<2>, Sdf>;
using AnyWall = std::variant<WallN<2>, Wall>;
using AnyFlow = std::variant<FlowN<2>, FlowN<3>, FlowN<4>, FlowN<5>, FlowN<6>, FlowN<7>>;

/// Positions in more than 3 dimensions. (Those in 2 and 3 are Points.)
using AnyPositions = std::variant<std::vector<Vec<double, 4>>, std::vector<Vec<double, 5>>, std::vector<Vec<double, 6>>,
                                  std::vector<Vec<double, 7>>>;
inline int dimensionOf(const AnyPositions& positions) { return static_cast<int>(positions.index()) + 4; }
inline size_t sizeOf(const AnyPositions& positions) {
    return std::visit([](const auto& all) { return all.size(); }, positions);
}

/// Returns the dimension of the object that the variant holds.
template <class Any>
int dimensionOf(const Any& any) {
    return std::visit([](const auto& object) { return std::remove_cvref_t<decltype(object)>::kDimension; }, any);
}

/// Returns the field in 3D. A field of 1 or 2 dimensions is constant along the other axes. Throws ValueError if the
/// field has more than 3 dimensions.
ScalarField inSpace(const AnyField& field);
/// Returns the flow in 3D. A 2D flow is the same in every plane of constant z. Its domain becomes a slab around z = 0
/// whose thickness is an eighth of the longer side of its box. Throws ValueError if the flow has more than 3
/// dimensions.
Flow inSpace(const AnyFlow& flow);
/// Returns the shape or wall in 3D. A 2D one is extended infinitely along z.
Sdf inSpace(const AnySdf& sdf);
Wall inSpace(const AnyWall& wall);
/// Returns the bounding box of a shape; for a 2D shape, the slab described above. Returns nullopt if the shape is
/// infinite.
std::optional<Box> boxOf(const AnySdf& sdf);

/// Returns combine(a, b) for two fields of the same dimension. If one field has 3 dimensions and the other fewer, both
/// are combined in 3D. Throws ValueError for other pairs of dimensions.
template <class Combine>
AnyField combined(const AnyField& a, const AnyField& b, const Combine& combine) {
    const int n = dimensionOf(a), m = dimensionOf(b);
    if (n != m && std::max(n, m) == 3) return combine(inSpace(a), inSpace(b));
    if (n != m)
        throw ValueError(
            fmt::format("the two fields have {} and {} dimensions; use -lift to reduce the dimension of one", n, m));
    return std::visit(
        [&](const auto& p) -> AnyField { return combine(p, std::get<std::remove_cvref_t<decltype(p)>>(b)); }, a);
}

} // namespace curlew::app
