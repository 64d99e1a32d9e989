#include "Options.h"
#include "curlew/app/Registry.h"
#include "curlew/app/Session.h"
#include "curlew/image/Slice.h"

namespace curlew::app {

namespace {

using namespace options;

const std::string kGroup = "pictures";

/// A channel of a scalar field: the field itself.
SliceChannel fieldChannel(const ScalarField& field) {
    return [field](const PointBatch& points, std::array<float, kBatch>& values) {
        JetBatch<float, 0> jets;
        field.eval(points, jets);
        values = jets.c[0];
    };
}

void sliceAction(Session& s, const Arguments& a) {
    const bool ofFlow = !s.flows.empty() && (s.fields.empty() || s.flows.entry().made > s.fields.entry().made);
    if (!ofFlow && s.fields.empty()) throw ValueError("there is no flow or field to show; make one first");
    const std::string shown = a.text("show");
    Box box = ofFlow ? s.flow().domain().box : Domain{}.box;
    if (!ofFlow && s.fields.at().sdf && s.fields.at().sdf->bounds.finite()) box = s.fields.at().sdf->bounds;
    if (a.given("box")) box = a.box("box");
    if (!ofFlow && a.given("show") && shown != "value")
        throw ValueError(fmt::format("show={} needs a flow; of a field, only show=value can be seen", shown));

    SliceOptions options{
        .axis = static_cast<int>(a.choice("axis")), .position = 0, .width = static_cast<int>(a.integer("width"))};
    options.position = a.given("position") ? a.real("position") : box.center()[options.axis];
    const std::string name = ofFlow ? shown : "value";
    const SliceChannel channel = ofFlow ? flowChannel(s.flow(), shown) : fieldChannel(inSpace(s.fields.at().field));
    Image image = slice(box, channel, name, options, s.console.follow("slice"));
    // Two colours for values of both signs, one scale for those that are never negative.
    const bool positive =
        ofFlow ? name == "speed" : std::visit([](const auto& f) { return f.range().lower >= 0; }, s.fields.at().field);
    s.images.push({std::move(image), positive ? ColorMap::viridis : ColorMap::diverging}, s.now());
}

} // namespace

std::vector<Action> imageActions() {
    return {{.name = "slice",
             .group = kGroup,
             .summary = "a picture of the newest flow or field on a plane",
             .inputs = "flow or field (which stays)",
             .outputs = "image",
             .takes = {stays("what", {Kind::flow, Kind::field})},
             .makes = {made("image", {Kind::image})},
             .options = {choice("axis", {"x", "y", "z"}, "the plane is perpendicular to it", "z"),
                         real("position", "", "world units", "of the plane on that axis (default: the middle)"),
                         choice("show", {"speed", "vx", "vy", "vz", "f", "g", "distance", "value"},
                                "what of a flow to show; of a field, its value"),
                         integer("width", "800", 1, 32768, "pixels across"),
                         box("box", "what the picture has to show (default: the domain)")},
             .examples = {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn -slice show=speed "
                          "-write speed.png speed.exr"},
             .run = sliceAction}};
}

} // namespace curlew::app
