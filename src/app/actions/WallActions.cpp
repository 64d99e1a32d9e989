// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "curlew/app/registry/Bind.h"
#include "curlew/field/LayerFit.h"
#include "curlew/vdb/WideSdf.h"

#include <algorithm>
#include <cmath>

namespace curlew::app {

namespace {

using namespace options;

const std::string kWallGroup = "flows";
const char* const kChanges = "one of several walls changes from frame to frame; join them with -union first";

const Binding<BoundOptions>& boundBinding() {
    static const auto binding =
        Binding<BoundOptions>()
            .add(
                flag("separate", "",
                     "1: shift the noise so that no value of the field occurs on both sides of the wall; the flow in "
                     "the layer is then faster than beyond it"),
                [](auto& o) -> auto& { return o.separate; })
            .addOptional(
                notNegative("amplitude", "", "world units",
                            "amplitude to which the noise is scaled; 0: not scaled (default: to an rms slope of 1, "
                            "with which the flow is as fast in the layer as beyond it)"),
                [](auto& o) -> auto& { return o.amplitude; })
            .add(
                notNegative("variation", "", "",
                            "variation of the speed along the wall with the noise, 0 to below 1; without it, the speed "
                            "along a 2D wall is the same everywhere"),
                [](auto& o) -> auto& { return o.variation; });
    return binding;
}

/// Returns whether the noise and all walls are 2D.
bool inPlane(const Context& c) {
    if (dimensionOf(c.field("noise").field) != 2) return false;
    for (size_t k = 0; k < c.count("wall"); ++k)
        if (kindOf(c.value("wall", k)) != Kind::shape || !std::holds_alternative<SdfN<2>>(*c.field("wall", k).sdf))
            return false;
    return true;
}

/// Returns the noise, before it was made to conform to another wall.
template <int N>
ScalarFieldN<N> noiseIn(const Context& c) {
    const FieldValue& given = c.field("noise");
    const AnyField& free = given.free ? *given.free : given.field;
    if constexpr (N == 2)
        return std::get<ScalarFieldN<2>>(free);
    else
        return inSpace(free);
}

/// Returns one of several walls in 3D.
Sdf wallInSpace(const Context& c, double distance, size_t k) {
    if (k == 0) return c.sdf("wall", distance);
    const Value& value = c.value("wall", k);
    if (const auto* shape = std::get_if<FieldValue>(&value)) return inSpace(*shape->sdf);
    const auto& grid = std::get<GridValue>(value);
    if (grid.earlier && grid.part < 1) throw ValueError(kChanges);
    LevelSet levelSet = levelSetOf(grid.grid);
    levelSet.mesh = grid.mesh;
    return sdfUpTo(levelSet, distance, c.follow("widening the band"));
}

/// Returns the wall of the space that two walls leave free, with rounded edges where they meet. Both distances must be
/// valid up to twice its width, which is therefore at most half of the former one's reach.
template <int N>
WallN<N> joined(const WallN<N>& former, const WallN<N>& next) {
    if (former.side == Side::both || next.side == Side::both)
        throw ValueError(
            "the noise is bounded by another wall already, and a wall with side=both cannot be joined to it; give "
            "side=inside or side=outside to both");
    double width = std::min(former.width, next.width);
    if (former.sdf.reach > 0) width = std::min(width, former.sdf.reach / 2);
    const bool wasInside = former.side == Side::inside;
    if (wasInside && next.side == Side::inside) return {intersect(next.sdf, former.sdf, width), Side::inside, width};
    if (wasInside) return {subtract(former.sdf, next.sdf, width), Side::inside, width};
    if (next.side == Side::inside) return {subtract(next.sdf, former.sdf, width), Side::inside, width};
    return {unite(next.sdf, former.sdf, width), Side::outside, width};
}

/// Returns the wall joined to the one that bounds the noise already, if there is one.
template <int N>
WallN<N> joinedToFormer(const Context& c, const WallN<N>& wall) {
    const auto& former = c.field("noise").wall;
    if (!former) return wall;
    if constexpr (N == 2) {
        return joined(std::get<WallN<2>>(*former), wall);
    } else {
        const Wall before = inSpace(*former);
        if (before.sdf.surfaceVelocity || wall.sdf.surfaceVelocity) throw ValueError(kChanges);
        return joined(before, wall);
    }
}

/// Returns the wall, whose distance is valid up to its width: the union of all given walls, with rounded edges where
/// they meet, joined to the wall that bounds the noise already.
template <int N>
WallN<N> wallIn(const Context& c, const Arguments& a, double width) {
    const auto one = [&](size_t k) {
        if constexpr (N == 2)
            return std::get<SdfN<2>>(*c.field("wall", k).sdf);
        else
            return wallInSpace(c, c.count("wall") > 1 || c.field("noise").wall ? 2 * width : width, k);
    };
    SdfN<N> all = one(0);
    for (size_t k = 1; k < c.count("wall"); ++k) all = unite(all, one(k), width);
    return joinedToFormer<N>(c, {.sdf = all, .side = a.choice<Side>("side"), .width = width});
}

/// Outputs the field that conforms to the wall.
template <int N>
void giveBounded(Context& c, const ScalarFieldN<N>& bounded, const WallN<N>& wall) {
    c.give(FieldValue{.field = bounded, .wall = wall, .free = noiseIn<N>(c)});
}

/// Returns the bounds of the wall in N dimensions, before its narrow band is widened.
template <int N>
BoxN<N> boundsIn(const Context& c) {
    const auto one = [&](size_t k) -> BoxN<N> {
        if constexpr (N == 2)
            return std::get<SdfN<2>>(*c.field("wall", k).sdf).bounds;
        else if (const auto box = boxOf(c.value("wall", k)))
            return *box;
        else
            return planeSdf({{0, 1, 0}}, 0).bounds; // infinite
    };
    BoxN<N> all = one(0);
    for (size_t k = 1; k < c.count("wall"); ++k) {
        const BoxN<N> next = one(k);
        for (int axis = 0; axis < N; ++axis) {
            all.lower[axis] = std::min(all.lower[axis], next.lower[axis]);
            all.upper[axis] = std::max(all.upper[axis], next.upper[axis]);
        }
    }
    return all;
}

void warnOfLimit(const Context& c, const LayerWidth& layer) {
    if (layer.limited)
        c.warn(fmt::format(
            "the noise's wavelength, {:.3g}, is too long for this object: its layer is {:.3g} wide instead "
            "of {:.3g}, and the flow is faster in the layer than beyond it; use a wavelength of at most {:.3g}",
            layer.noise.wavelength, layer.width, kLayerInWavelengths * layer.noise.wavelength,
            layer.width / kLayerInWavelengths));
}

/// Warns if the layer of an obstacle is wider than the obstacle itself.
template <int N>
void warnOfWideLayer(const Context& c, const WallN<N>& wall) {
    const auto size = wall.sdf.bounds.size();
    const double longest = *std::max_element(size.c.begin(), size.c.end());
    if (wall.side == Side::inside || !std::isfinite(longest) || wall.width <= longest) return;
    c.warn(
        fmt::format("the layer, {:.3g} wide, is wider than the object, {:.3g} in size, so the flow is deflected far "
                    "from it; give layer={:.2g} or less, or use noises of a shorter wavelength",
                    wall.width, longest, longest / 2));
}

template <int N>
void warnOfThinParts(const Context& c, const WallN<N>& wall) {
    if (wall.side == Side::outside) return;
    if (const LayerFit fit = layerFit(wall); fit.unreached > kMaxUnreached)
        c.warn(
            fmt::format("the layer, {:.3g} wide, overlaps itself in {:.0f} % of the inside, where the object is too "
                        "thin or too sharp for it, so the flow has kinks there; layer={:.2g} fits",
                        wall.width, 100 * fit.unreached, fit.fitting));
}

/// Reports, once and not in every frame, the layer that was chosen.
template <int N>
void tellLayer(Context& c, const WallN<N>& wall, const LayerWidth& layer, const BoundOptions& options) {
    if (c.memory().object) return;
    c.memory().object = std::make_shared<bool>(true);
    std::string line = fmt::format("bound: layer width {:.3g}, {:.2g} wavelengths of the noise ({:.3g}{})", wall.width,
                                   wall.width / layer.noise.wavelength, layer.noise.wavelength,
                                   layer.noise.measured ? ", measured" : "");
    if (c.field("noise").wall) line += "; joined to the wall that bounds the noise already";
    if (options.amplitude < 0) line += fmt::format("; noise scaled by {:.3g}", 1 / layer.noise.slope);
    c.info(line);
    warnOfLimit(c, layer);
    warnOfThinParts(c, wall);
    warnOfWideLayer(c, wall);
}

template <int N>
void boundIn(Context& c, const Arguments& a) {
    const ScalarFieldN<N> noise = noiseIn<N>(c);
    BoundOptions options = boundBinding().read(a);
    LayerWidth layer = layerWidth(noise, boundsIn<N>(c), a.choice<Side>("side"));
    if (a.given("layer")) layer = {.width = a.real("layer"), .noise = layer.noise};
    const WallN<N> wall = wallIn<N>(c, a, layer.width);
    options.slope = layer.noise.slope;
    giveBounded(c, bounded(noise, wall, options), wall);
    tellLayer(c, wall, layer, options);
}

void bound(Context& c, const Arguments& a) { inPlane(c) ? boundIn<2>(c, a) : boundIn<3>(c, a); }

/// Outputs DeWolf's product of a noise and a distance.
template <int N>
void blendIn(Context& c, const Arguments& a) {
    const WallN<N> wall = wallIn<N>(c, a, a.real("layer"));
    giveBounded(c, productBounded(noiseIn<N>(c), wall.sdf, wall.width), wall);
}

void blendWithField(Context& c, const Arguments& a) { inPlane(c) ? blendIn<2>(c, a) : blendIn<3>(c, a); }

/// Declares the input: one wall, or all walls that grid= or links select.
Input walls() {
    Input input = several(stays("wall", {Kind::shape, Kind::levelSet}, "grid"), 1, 100, "one, or those of grid=");
    input.amountWith = [](const Arguments& a, const Scope& scope) {
        return Amount{1, a.given("grid") || scope.linked() ? size_t{100} : size_t{1}};
    };
    return input;
}

std::vector<Option> boundOptions() {
    std::vector<Option> all{
        formerly({"width"},
                 positive("layer", "", "world units",
                          fmt::format(
                              "width of the layer in which the flow turns along the wall (default: {} wavelengths of "
                              "the noise's lowest octave, at most a quarter of the shortest edge of the object's box, "
                              "or of the longest with side=outside)",
                              kLayerInWavelengths))),
        choice("side", {"inside", "outside", "both"},
               "side of the wall on which the flow is: inside a container, outside an obstacle, or on both sides")};
    for (const Option& option : boundBinding().options()) all.push_back(option);
    all.push_back(
        ages("field", "", "field that is the noise: 0 is the newest (default: the newest that is not a distance)"));
    all.push_back(ages("grid", "",
                       "level set that is the wall: 0 is the newest; several, as in grid=0,1, count shapes too, and "
                       "their union is the wall. With names: wall=a,b (default: the newest shape or level set)"));
    all.push_back(keep());
    return all;
}

} // namespace

Registry wallActions() {
    return {
        {.name = "bound",
         .group = kWallGroup,
         .summary = "bound the newest noise by the newest signed distance: boundary, obstacle, collision (ICN Eq. 13)",
         .takes = {taken("noise", {Kind::noise}, "field"), walls()},
         .makes = {made("field", {Kind::field})},
         .options = boundOptions(),
         .examples =
             {"curlew -read bunny.obj -mesh2ls -noise -noise seed=1 -bound layer=0.05 -dfvn speed=1 -velocity "
              "-write vel.vdb",
              "curlew -sphere dimensions=2 -noise dimensions=2 frequency=2 -bound -dfvn -slice -write disc.png"},
         .evaluation = Evaluation::anyTime,
         .conforms = true,
         .run = bound},
        {.name = "blend",
         .group = kWallGroup,
         .summary = "multiply the newest noise by the newest distance, clamped (DeWolf's boundary condition)",
         .takes = {taken("noise", {Kind::noise}), stays("wall", {Kind::shape, Kind::levelSet})},
         .makes = {made("field", {Kind::field})},
         .options = {formerly({"range"}, positive("layer", "0.5", "world units",
                                                  "width of the layer beyond which the wall has no effect")),
                     choice("side", {"inside", "outside", "both"}, "side of the wall on which the flow is"), keep()},
         .examples = {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -blend layer=0.3 -dfvn speed=1 "
                      "-slice -write dewolf.png"},
         .evaluation = Evaluation::anyTime,
         .conforms = true,
         .run = blendWithField}};
}

} // namespace curlew::app
