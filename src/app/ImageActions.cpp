#include "Options.h"
#include "curlew/app/Registry.h"
#include "curlew/app/Session.h"
#include "curlew/picture/Display.h"
#include "curlew/picture/Lic.h"
#include "curlew/picture/Lines.h"
#include "curlew/picture/Slice.h"

namespace curlew::app {

namespace {

using namespace options;

const std::string kGroup = "pictures";
constexpr double kMarginAroundWalls = 0.04;

// --- what both show: the newest flow or field on a plane
// --------------------------------------------------------------------------

struct View {
    Box box;
    SliceOptions slice;
};

/// `subject`: what there is to see; `shape`: it has an outside, which is shown too.
View viewOf(const Arguments& a, const Box& subject, bool shape) {
    View view{.box = a.given("box") ? a.box("box") : subject,
              .slice = {.axis = static_cast<int>(a.choice("axis")),
                        .width = static_cast<int>(a.integer("width")),
                        .margin = shape && !a.given("box") ? kMarginAroundWalls : 0}};
    view.slice.position = a.given("position") ? a.real("position") : view.box.center()[view.slice.axis];
    return view;
}

View viewOf(const Arguments& a, const Flow& flow) {
    return viewOf(a, flow.domain().box, flow.domain().wall.has_value());
}

std::vector<Option> viewOptions() {
    return {choice("axis", {"x", "y", "z"}, "the plane is perpendicular to it", "z"),
            real("position", "", "world units", "of the plane on that axis (default: the middle)"),
            integer("width", "800", 1, 32768, "pixels across"),
            box("box", "what the picture has to show (default: the domain)")};
}

/// What the view shows of a source, at one sample per pixel: for lines and arrows.
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

/// What of the newest object is shown, and the sources of lines and arrows on it.
struct Subject {
    View view;
    SliceSource shown, contoured, vectors;
    bool positive = false; ///< What is shown is never negative.
};

Subject flowSubject(Session& s, const Arguments& a) {
    const Flow flow = s.flow();
    const std::string name = a.given("show") ? a.text("show") : "speed";
    if (!among(kOfFlows, name)) throw ValueError(fmt::format("show={} needs a field, and the newest is a flow", name));
    const bool scalar = name == "f" || name == "g" || name == "distance";
    return {.view = viewOf(a, flow),
            .shown = name == "along" ? alongSource(flow, a.vector("direction")) : flowSource(flow, name),
            .contoured = flowSource(flow, scalar ? name : "f"),
            .vectors = flowSource(flow, "velocity"),
            .positive = name == "speed"};
}

Subject fieldSubject(Session& s, const Arguments& a) {
    const FieldObject& object = s.fields.at();
    const ScalarField field = inSpace(object.field);
    const std::string name = a.given("show") ? a.text("show") : "value";
    if (!among(kOfFields, name))
        throw ValueError(
            fmt::format("show={} needs a flow; of a field, {} can be seen", name, fmt::join(kOfFields, ", ")));
    const bool bounded = object.sdf && object.sdf->bounds.finite();
    return {.view = viewOf(a, bounded ? object.sdf->bounds : Domain{}.box, bounded),
            .shown = fieldSource(field, name),
            .contoured = fieldSource(field, "value"),
            .vectors = fieldSource(field, "gradient"),
            .positive = name == "slope" || (name == "value" && field.range().lower >= 0)};
}

Subject subjectOf(Session& s, const Arguments& a) {
    const bool ofFlow = !s.flows.empty() && (s.fields.empty() || s.flows.entry().made > s.fields.entry().made);
    if (!ofFlow && s.fields.empty()) throw ValueError("there is no flow or field to show; make one first");
    return ofFlow ? flowSubject(s, a) : fieldSubject(s, a);
}

void sliceAction(Session& s, const Arguments& a) {
    const Subject subject = subjectOf(s, a);
    const Monitor monitor = s.console.follow("slice");
    Image image = slice(subject.view.box, subject.shown, subject.view.slice, monitor);
    // Two colours for values of both signs, one scale for those that are never negative.
    ColorMap map = subject.positive ? ColorMap::viridis : ColorMap::diverging;
    if (a.choice("map") > 0 && !isVector(image)) map = static_cast<ColorMap>(a.choice("map") - 1);
    const auto lines = static_cast<int>(a.integer("contours")), across = static_cast<int>(a.integer("arrows"));
    if (lines > 0 || across > 0) {
        image = displayed(image, automaticScale(image, map));
        // Dark on the light middle of the diverging colours, light on the others.
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
    s.images.push({std::move(image), map}, s.now());
}

Action sliceDeclaration() {
    std::vector<Option> declared = viewOptions();
    std::vector<std::string> shown = kOfFlows;
    shown.insert(shown.end(), kOfFields.begin(), kOfFields.end());
    declared.push_back(choice("show", shown,
                              "of a flow: speed, a component, a potential, the distance to the wall, or the velocity "
                              "as colours; of a field (default: value) also slope, the length of its gradient"));
    declared.push_back(vector("direction", "1,1,1", "", "of the component that show=along shows"));
    declared.push_back(choice("map", {"auto", "viridis", "diverging", "gray"}, "colours of what is one number"));
    declared.push_back(integer("contours", "0", 0, 1000,
                               "so many iso-lines: of what is shown, or of the field, or f, where that is a component, "
                               "a vector or its length; the image is then a picture"));
    declared.push_back(
        integer("arrows", "0", 0, 1000,
                "so many arrows in a row: the velocity, or the gradient, in the plane; the longest fills "
                "its place"));
    return {.name = "slice",
            .group = kGroup,
            .summary = "a picture of the newest flow or field on a plane",
            .inputs = "flow or field (which stays)",
            .outputs = "image",
            .takes = {stays("what", {Kind::flow, Kind::field})},
            .makes = {made("image", {Kind::image})},
            .options = std::move(declared),
            .examples = {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn -slice show=speed "
                         "-write speed.png speed.exr",
                         "curlew -noise dim=2 frequency=2 -slice show=gradient -write gradient.png"},
            .run = sliceAction};
}

// --- line integral convolution
// --------------------------------------------------------------------------------------------------

void licAction(Session& s, const Arguments& a) {
    const Flow flow = s.flow();
    const Monitor monitor = s.console.follow("lic");
    const View view = viewOf(a, flow);
    const Image vectors = slice(view.box, flowSource(flow, "velocity"), view.slice, monitor);
    const PicturePlane plane(view.box, view.slice);
    Image picture = lic(inPlane(vectors, plane),
                        {.length = a.given("length") ? a.real("length") : 0.06 * view.slice.width,
                         .kernel = static_cast<LicKernel>(a.choice("kernel")),
                         .grain = a.given("grain") ? a.real("grain") : std::max(1.25, view.slice.width / 800.0),
                         .seed = static_cast<uint64_t>(a.integer("seed"))},
                        monitor);
    if (a.choice("color") == 0) {
        const Image speed = slice(view.box, flowSource(flow, "speed"), view.slice, monitor);
        ColorScale scale = automaticScale(speed, ColorMap::viridis);
        scale.lower -= 0.25f * scale.upper; // the darkest colours would hide the streaks
        picture = litBy(picture, displayed(speed, scale));
    }
    if (a.flag("outline") && flow.domain().wall) {
        picture = displayed(picture, {.map = ColorMap::gray});
        drawLines(picture, isoLines(sampled(view, wallSource(flow.domain()), monitor), std::array{0.0}),
                  {.opacity = 0.9f, .width = std::max(1.5, picture.width / 500.0)});
    }
    s.images.push({std::move(picture), ColorMap::gray}, s.now());
}

Action licDeclaration() {
    std::vector<Option> declared = viewOptions();
    for (Option& option :
         std::vector{positive("length", "", "pixels", "of the streaks (default: 6 % of the width)"),
                     choice("kernel", namesOf(kLicKernelNames), "how the noise is averaged along a streak"),
                     positive("grain", "", "pixels", "of the noise (default: 1.25, more in wide pictures)"),
                     integer("seed", "0", 0, 0x1p53 - 1, "another seed, another noise"),
                     choice("color", {"speed", "none"}, "by what the streaks are coloured"),
                     flag("outline", "1", "draw the wall")})
        declared.push_back(std::move(option));
    return {.name = "lic",
            .group = kGroup,
            .summary = "a picture of the newest flow on a plane as streaks: line integral convolution",
            .inputs = "flow (which stays)",
            .outputs = "image",
            .takes = {stays("flow", {Kind::flow})},
            .makes = {made("image", {Kind::image})},
            .options = std::move(declared),
            .examples = {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn -lic -write lic.png",
                         "curlew -noise dim=2 frequency=2 -dfvn -lic color=none -write lic.png"},
            .run = licAction};
}

} // namespace

std::vector<Action> imageActions() { return {sliceDeclaration(), licDeclaration()}; }

} // namespace curlew::app
