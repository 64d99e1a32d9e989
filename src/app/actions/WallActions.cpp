#include "Actions.h"
#include "curlew/app/registry/Bind.h"
#include "curlew/field/LayerFit.h"

#include <algorithm>
#include <cmath>

namespace curlew::app {

namespace {

using namespace options;

const std::string kGroup = "flows";

const Binding<BoundOptions>& boundBinding() {
    static const auto binding =
        Binding<BoundOptions>()
            .add(
                flag("separate", "",
                     "1: shift the noise so that no value of it occurs on both sides of the wall; the flow in the "
                     "layer is then faster than beyond it"),
                [](auto& o) -> auto& { return o.separate; })
            .addOptional(
                notNegative("amplitude", "", "world units",
                            "the noise is scaled to this size; 0 leaves it as it is (default: to a root mean "
                            "square slope of 1, with which the layer is as fast as the flow beyond it)"),
                [](auto& o) -> auto& { return o.amplitude; })
            .add(
                notNegative("variation", "", "",
                            "0 to below 1: how much the speed along the wall varies with the noise; in the plane it "
                            "is the same everywhere without"),
                [](auto& o) -> auto& { return o.variation; });
    return binding;
}

/// Whether noise and wall are both in the plane.
bool inPlane(const Context& c) {
    if (dimensionOf(c.field("noise").field) != 2 || c.kind("wall") != Kind::shape) return false;
    return std::holds_alternative<SdfN<2>>(*c.field("wall").sdf);
}

template <int N>
ScalarFieldN<N> noiseIn(const Context& c) {
    if constexpr (N == 2)
        return std::get<ScalarFieldN<2>>(c.field("noise").field);
    else
        return inSpace(c.field("noise").field);
}

/// The wall, good up to its width.
template <int N>
WallN<N> wallIn(const Context& c, const Arguments& a, double width) {
    const auto side = a.choice<Side>("side");
    if constexpr (N == 2)
        return {.sdf = std::get<SdfN<2>>(*c.field("wall").sdf), .side = side, .width = width};
    else
        return {.sdf = c.sdf("wall", width), .side = side, .width = width};
}

/// Gives the field that conforms to the wall.
template <int N>
void giveBounded(Context& c, const ScalarFieldN<N>& bounded, const WallN<N>& wall) {
    c.give(FieldValue{.field = bounded, .wall = wall, .free = c.field("noise").field});
}

/// The bounds of the wall in N dimensions, before its band is as wide as it has to be.
template <int N>
BoxN<N> boundsIn(const Context& c) {
    if constexpr (N == 2)
        return std::get<SdfN<2>>(*c.field("wall").sdf).bounds;
    else if (const auto box = boxOf(c.value("wall")))
        return *box;
    else
        return planeSdf({{0, 1, 0}}, 0).bounds; // infinite
}

void warnOfLimit(const Context& c, const LayerWidth& layer) {
    if (layer.limited)
        c.warn(
            fmt::format("the noise's wavelength, {:.3g}, is long for this object: its layer is {:.3g} wide instead of "
                        "{:.3g}, and faster than the flow beyond it; a wavelength of at most {:.3g} fits",
                        layer.noise.wavelength, layer.width, kLayerInWavelengths * layer.noise.wavelength,
                        layer.width / kLayerInWavelengths));
}

/// An obstacle whose layer is larger than itself: the flow keeps its distance from nothing much.
template <int N>
void warnOfWideLayer(const Context& c, const WallN<N>& wall) {
    const auto size = wall.sdf.bounds.size();
    const double longest = *std::max_element(size.c.begin(), size.c.end());
    if (wall.side == Side::inside || !std::isfinite(longest) || wall.width <= longest) return;
    c.warn(
        fmt::format("the layer, {:.3g} wide, is wider than the object, {:.3g} in size, so the flow turns far away from "
                    "it; give width={:.2g} or less, or noises of a shorter wavelength",
                    wall.width, longest, longest / 2));
}

template <int N>
void warnOfThinParts(const Context& c, const WallN<N>& wall) {
    if (wall.side == Side::outside) return;
    if (const LayerFit fit = layerFit(wall); fit.unreached > kMostUnreached)
        c.warn(
            fmt::format("the layer, {:.3g} wide, meets itself in {:.0f} % of the inside, where the object is too thin "
                        "or too sharp for it: the flow has no room there, and kinks; width={:.2g} fits",
                        wall.width, 100 * fit.unreached, fit.fitting));
}

/// Says once, and not in every frame, what has been chosen.
template <int N>
void tellLayer(Context& c, const WallN<N>& wall, const LayerWidth& layer, const BoundOptions& options) {
    if (c.memory().object) return;
    c.memory().object = std::make_shared<bool>(true);
    std::string line = fmt::format("bound: a layer of {:.3g}, {:.2g} wavelengths of the noise ({:.3g}{})", wall.width,
                                   wall.width / layer.noise.wavelength, layer.noise.wavelength,
                                   layer.noise.measured ? ", measured" : "");
    if (options.amplitude < 0) line += fmt::format("; the noise times {:.3g}", 1 / layer.noise.slope);
    c.say(line);
    warnOfLimit(c, layer);
    warnOfThinParts(c, wall);
    warnOfWideLayer(c, wall);
}

template <int N>
void boundIn(Context& c, const Arguments& a) {
    const ScalarFieldN<N> noise = noiseIn<N>(c);
    BoundOptions options = boundBinding().read(a);
    LayerWidth layer = layerWidth(noise, boundsIn<N>(c), a.choice<Side>("side"));
    if (a.given("width")) layer = {.width = a.real("width"), .noise = layer.noise};
    const WallN<N> wall = wallIn<N>(c, a, layer.width);
    options.slope = layer.noise.slope;
    giveBounded(c, bounded(noise, wall, options), wall);
    tellLayer(c, wall, layer, options);
}

void bound(Context& c, const Arguments& a) { inPlane(c) ? boundIn<2>(c, a) : boundIn<3>(c, a); }

/// DeWolf's product of a noise and a distance.
template <int N>
void blendIn(Context& c, const Arguments& a) {
    const WallN<N> wall = wallIn<N>(c, a, a.real("range"));
    giveBounded(c, productBounded(noiseIn<N>(c), wall.sdf, wall.width), wall);
}

void blend(Context& c, const Arguments& a) { inPlane(c) ? blendIn<2>(c, a) : blendIn<3>(c, a); }

std::vector<Option> boundOptions() {
    std::vector<Option> all{
        positive(
            "width", "", "world units",
            fmt::format("depth of the layer in which the flow turns along the wall (default: {} wavelengths of the "
                        "noise's lowest octave)",
                        kLayerInWavelengths)),
        choice("side", {"inside", "outside", "both"},
               "where the flow is: contained, around an obstacle, or on both sides")};
    for (const Option& option : boundBinding().options()) all.push_back(option);
    all.push_back(ages("field", "", "which field is the noise (default: the newest that is no distance)"));
    all.push_back(ages("grid", "", "which level set is the wall (default: the newest shape or level set)"));
    all.push_back(keep());
    return all;
}

} // namespace

Registry wallActions() {
    return {
        {.name = "bound",
         .group = kGroup,
         .summary = "make the newest noise conform to the newest signed distance (Eq. 13)",
         .takes = {taken("noise", {Kind::noise}, "field"), stays("wall", {Kind::shape, Kind::levelSet}, "grid")},
         .makes = {made("field", {Kind::field})},
         .options = boundOptions(),
         .examples = {"curlew -read bunny.obj -mesh2ls -noise -noise seed=1 -bound width=0.05 -dfvn speed=1 -velocity "
                      "-write vel.vdb",
                      "curlew -sphere dim=2 -noise dim=2 frequency=2 -bound -dfvn -slice -write disc.png"},
         .evaluation = Evaluation::anyTime,
         .conforms = true,
         .run = bound},
        {.name = "blend",
         .group = kGroup,
         .summary = "the newest noise times the newest distance, clipped (DeWolf's way to conform to a wall)",
         .takes = {taken("noise", {Kind::noise}), stays("wall", {Kind::shape, Kind::levelSet})},
         .makes = {made("field", {Kind::field})},
         .options = {positive("range", "0.5", "world units", "beyond it the distance no longer matters"),
                     choice("side", {"inside", "outside", "both"}, "where the flow is"), keep()},
         .examples = {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -blend range=0.3 -dfvn speed=1 "
                      "-slice -write dewolf.png"},
         .evaluation = Evaluation::anyTime,
         .conforms = true,
         .run = blend}};
}

} // namespace curlew::app
