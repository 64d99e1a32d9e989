// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "GpuOption.h"
#include "curlew/picture/Display.h"
#include "curlew/picture/Lic.h"
#include "curlew/picture/Lines.h"
#include "curlew/picture/Slice.h"

namespace curlew::app {

namespace {

using namespace options;

const std::string kImageGroup = "pictures";
constexpr double kMarginAroundWalls = 0.04;

// --- the view of a flow or field on a plane, shared by both actions
// --------------------------------------------------------------------------

struct View {
    Box box;
    SliceOptions slice;
};

/// `subject`: the box to show; `shape`: whether the object has an outside, which is shown too.
View viewOf(const Arguments& a, const Box& subject, bool shape) {
    View view{.box = a.given("box") ? a.box("box") : subject,
              .slice = {.axis = a.choice<int>("axis"),
                        .width = a.integer<int>("width"),
                        .margin = shape && !a.given("box") ? kMarginAroundWalls : 0}};
    view.slice.position = a.given("position") ? a.real("position") : view.box.center()[view.slice.axis];
    return view;
}

View viewOf(const Arguments& a, const Flow& flow) {
    return viewOf(a, flow.domain().box, flow.domain().wall.has_value());
}

/// Returns the options of both actions, followed by an action's own.
std::vector<Option> viewOptions(const std::vector<Option>& own) {
    std::vector<Option> all{
        choice("axis", {"x", "y", "z"}, "axis perpendicular to the plane", "z"),
        real("position", "", "world units", "position of the plane along that axis (default: the middle of the box)"),
        integer("width", fmt::format("{}", SliceOptions{}.width), 1, 32768, "picture width in pixels"),
        box("box", "region to show (default: the domain of a flow; the box of a shape, padded, or of a grid)")};
    all.insert(all.end(), own.begin(), own.end());
    return all;
}

/// Samples a source in the view at one sample per pixel, for lines and arrows.
Image sampled(const View& view, const SliceSource& source, const Monitor& monitor) {
    SliceOptions single = view.slice;
    single.supersampling = 1;
    return slice(view.box, source, single, monitor);
}

// --- slices
// --------------------------------------------------------------------------------------------------------

const std::vector<std::string> kOfFlows{"speed", "vx", "vy", "vz", "along", "f", "g", "distance", "velocity"};
const std::vector<std::string> kOfFields{"value", "slope", "gradient"};

bool among(const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

/// The quantity to show, and the sources of the lines and arrows drawn on it.
struct Subject {
    View view;
    SliceSource shown, contoured, vectors;
    bool positive = false; ///< Whether the shown quantity is never negative.
};

Subject flowSubject(const Context& c, const Arguments& a) {
    const Flow flow = c.flow("what");
    const std::string name = a.given("show") ? a.text("show") : "speed";
    if (!among(kOfFlows, name))
        throw ValueError(fmt::format("show={} needs a field, but the newest object is a flow", name));
    if (name == "distance" && !flow.domain().wall)
        throw ValueError("show=distance needs a flow with a wall; for the distance of a shape, show the shape");
    if (a.given("direction") && name != "along") throw ValueError("direction= is only for show=along");
    const bool scalar = name == "f" || name == "g" || name == "distance";
    return {.view = viewOf(a, flow),
            .shown = name == "along" ? alongSource(flow, a.vector("direction")) : flowSource(flow, name),
            .contoured = flowSource(flow, scalar ? name : "f"),
            .vectors = flowSource(flow, "velocity"),
            .positive = name == "speed"};
}

Subject fieldSubject(const Context& c, const Arguments& a) {
    const FieldValue& value = c.field("what");
    const ScalarField field = inSpace(value.field);
    const std::string name = a.given("show") ? a.text("show") : "value";
    if (!among(kOfFields, name))
        throw ValueError(fmt::format("show={} needs a flow; for a field use {}", name, fmt::join(kOfFields, ", ")));
    const auto box = regionOf(value);
    return {.view = viewOf(a, box.value_or(Domain{}.box), box.has_value()),
            .shown = fieldSource(field, name),
            .contoured = fieldSource(field, "value"),
            .vectors = fieldSource(field, "gradient"),
            .positive = name == "slope" || (name == "value" && field.range().lower >= 0)};
}

void sliceAction(Context& c, const Arguments& a) {
    const Subject subject = c.kind("what") == Kind::flow ? flowSubject(c, a) : fieldSubject(c, a);
    const Monitor monitor = c.follow("slice");
    Image image = slice(subject.view.box, subject.shown, subject.view.slice, monitor);
    // A diverging map for values of both signs, a sequential one for values that are never negative.
    ColorMap map = subject.positive ? ColorMap::viridis : ColorMap::diverging;
    if (a.choice("map") > 0 && !isVector(image)) map = static_cast<ColorMap>(a.choice("map") - 1);
    const auto lines = a.integer<int>("contours"), across = a.integer<int>("arrows");
    if (lines > 0 || across > 0) {
        image = displayed(image, automaticScale(image, map));
        // Dark lines on the light centre of the diverging map, light lines on the other maps.
        const Vec3f ink = map == ColorMap::diverging ? Vec3f{{0.08f, 0.08f, 0.1f}} : Vec3f{{1, 1, 1}};
        const double width = std::max(1.0, image.width / 640.0);
        if (lines > 0)
            drawLines(image, contours(sampled(subject.view, subject.contoured, monitor), lines),
                      {.color = ink, .opacity = 0.7f, .width = width});
        if (across > 0) {
            const Image vectors = sampled(subject.view, subject.vectors, monitor);
            const PicturePlane plane(subject.view.box, subject.view.slice);
            drawLines(image, arrows(inPlane(vectors, plane), across), {.color = ink, .width = 1.6 * width});
        }
    }
    c.give(std::make_shared<const ImageValue>(ImageValue{std::move(image), map}));
}

Action sliceDeclaration() {
    std::vector<std::string> shown = kOfFlows, maps = namesOf(kColorMapNames);
    shown.insert(shown.end(), kOfFields.begin(), kOfFields.end());
    maps.resize(3); // the other maps are for light on a dark background
    maps.insert(maps.begin(), "auto");
    return {
        .name = "slice",
        .group = kImageGroup,
        .summary = "picture of the newest flow or field on a plane (cross-section, heat map)",
        .takes = {stays("what", {Kind::flow, Kind::field})},
        .makes = {made("image", {Kind::image})},
        .options = viewOptions(
            {choice("show", shown,
                    "quantity to show. Of a flow: the speed, a component, a potential, the distance to the wall, or "
                    "the velocity as colours. Of a field: the value (its default), slope (length of the gradient), or "
                    "the gradient as colours"),
             vector("direction", "1,1,1", "", "direction of the component that show=along shows"),
             choice("map", maps, "colour map of a scalar quantity"),
             integer("contours", "0", 0, 1000,
                     "number of contour lines (iso-lines) of the scalar that is shown; if show= is a component, a "
                     "vector or a length, of the field, or of f of a flow. With contours, the image holds colours, not "
                     "values"),
             integer("arrows", "0", 0, 1000,
                     "number of arrows per row, which show the velocity or the gradient in the plane; the longest "
                     "fills its cell")}),
        .examples = {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn -slice show=speed "
                     "-write speed.png speed.exr",
                     "curlew -noise dimensions=2 frequency=2 -slice show=gradient -write gradient.png"},
        .run = sliceAction};
}

// --- line integral convolution
// --------------------------------------------------------------------------------------------------

Image streaks(const Context& c, const Flow& flow, const View& view, const Arguments& a, const Monitor& monitor) {
    const Image vectors = slice(view.box, flowSource(flow, "velocity"), view.slice, monitor);
    return lic(inPlane(vectors, PicturePlane(view.box, view.slice)),
               {.length = a.given("streakLength") ? a.real("streakLength") : 0.06 * view.slice.width,
                .kernel = a.choice<LicKernel>("filter"),
                .grain = a.given("grain") ? a.real("grain") : std::max(1.25, view.slice.width / 800.0),
                .seed = a.integer<uint64_t>("seed")},
               monitor, licConvolutionOf(c, a));
}

void licAction(Context& c, const Arguments& a) {
    const Flow flow = c.flow("flow");
    const Monitor monitor = c.follow("lic");
    const View view = viewOf(a, flow);
    Image picture = streaks(c, flow, view, a, monitor);
    if (a.choice("show") == 0) {
        const Image speed = slice(view.box, flowSource(flow, "speed"), view.slice, monitor);
        ColorScale scale = automaticScale(speed, ColorMap::viridis);
        scale.lower -= 0.25f * scale.upper; // the darkest colours would hide the streaks
        picture = litBy(picture, displayed(speed, scale));
    }
    if (a.flag("drawWall") && flow.domain().wall) {
        picture = displayed(picture, {.map = ColorMap::gray});
        drawLines(picture, isoLines(sampled(view, wallSource(flow.domain()), monitor), std::array{0.0}),
                  {.opacity = 0.9f, .width = std::max(1.5, picture.width / 500.0)});
    }
    c.give(std::make_shared<const ImageValue>(ImageValue{std::move(picture), ColorMap::gray}));
}

Action licDeclaration() {
    return {
        .name = "lic",
        .group = kImageGroup,
        .summary = "line integral convolution (LIC): a picture of the newest flow on a plane as streaks",
        .takes = {stays("flow", {Kind::flow})},
        .makes = {made("image", {Kind::image})},
        .options = viewOptions(
            {formerly({"length"},
                      positive("streakLength", "", "pixels", "length of the streaks (default: 6 % of the width)")),
             formerly({"kernel"}, choice("filter", kLicKernelNames, "filter kernel along a streak")),
             positive("grain", "", "pixels", "grain size of the noise (default: 1.25, more in wide pictures)"),
             integer("seed", "0", 0, 0x1p53 - 1, "random seed of the noise"),
             formerly({"color"}, choice("show", {"speed", "none"}, "quantity that the colour of the streaks shows")),
             formerly({"outline"}, flag("drawWall", "1", "1: draw the outline of the wall")), deviceOption()}),
        .examples = {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn -lic -write lic.png",
                     "curlew -noise dimensions=2 frequency=2 -dfvn -lic show=none -write lic.png"},
        .run = licAction};
}

} // namespace

Registry imageActions() { return {sliceDeclaration(), licDeclaration()}; }

} // namespace curlew::app
