// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/run/AnyField.h"

#include "curlew/field/Algebra.h"
#include "curlew/field/Transforms.h"

#include <algorithm>

namespace curlew::app {

namespace {

[[noreturn]] void refuse(const char* what, int dimension) {
    throw ValueError(
        fmt::format("needs a {0} in 3D, but the newest {0} has {1} dimensions; -lift reduces the dimensions of fields",
                    what, dimension));
}

/// Extends a 2D box to a slab around z = 0.
Box slabOf(const BoxN<2>& box) {
    const double half = std::max(box.size()[0], box.size()[1]) / 16;
    return {{{box.lower[0], box.lower[1], -half}}, {{box.upper[0], box.upper[1], half}}};
}

} // namespace

ScalarField inSpace(const AnyField& field) {
    return std::visit(
        [](const auto& f) -> ScalarField {
            constexpr int kN = std::remove_cvref_t<decltype(f)>::kDimension;
            if constexpr (kN == 3)
                return f;
            else if constexpr (kN < 3)
                return projected(f, Matrix<kN, 3>{});
            else
                refuse("field", kN);
        },
        field);
}

Flow inSpace(const AnyFlow& flow) {
    return std::visit(
        [](const auto& f) -> Flow {
            constexpr int kN = std::remove_cvref_t<decltype(f)>::kDimension;
            if constexpr (kN == 3) {
                return f;
            } else if constexpr (kN == 2) {
                std::vector<Flow::Potentials> terms;
                for (const auto& term : f.terms())
                    terms.push_back({projected(term[0], Matrix<2, 3>{}), rampField({{0, 0, 1}})});
                Domain domain{.box = slabOf(f.domain().box), .wall = {}};
                if (f.domain().wall) domain.wall = inSpace(AnyWall(*f.domain().wall));
                std::optional<Flow> spatial;
                if (!terms.empty()) spatial = Flow(std::move(terms), domain);
                for (const auto& parts : f.components()) {
                    const auto flat = Flow::ofComponents(
                        {projected(parts[0], Matrix<2, 3>{}), projected(parts[1], Matrix<2, 3>{}), constantField(0)},
                        domain);
                    spatial = spatial ? *spatial + flat : flat;
                }
                return f.uniformSpeed() > 0 ? spatial->normalized(f.uniformSpeed()) : *spatial;
            } else {
                refuse("flow", kN);
            }
        },
        flow);
}

Sdf inSpace(const AnySdf& sdf) {
    if (const auto* flat = std::get_if<SdfN<2>>(&sdf)) return extruded(*flat);
    return std::get<Sdf>(sdf);
}

Wall inSpace(const AnyWall& wall) {
    return std::visit(
        [](const auto& w) { return Wall{.sdf = inSpace(AnySdf(w.sdf)), .side = w.side, .width = w.width}; }, wall);
}

std::optional<Box> boxOf(const AnySdf& sdf) {
    if (const auto* flat = std::get_if<SdfN<2>>(&sdf))
        return flat->bounds.finite() ? std::optional(slabOf(flat->bounds)) : std::nullopt;
    const Box& bounds = std::get<Sdf>(sdf).bounds;
    return bounds.finite() ? std::optional(bounds) : std::nullopt;
}

} // namespace curlew::app
