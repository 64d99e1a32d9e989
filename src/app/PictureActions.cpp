#include "Figures.h"
#include "Options.h"
#include "curlew/app/Registry.h"
#include "curlew/app/Session.h"
#include "curlew/app/Text.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/picture/Display.h"
#include "curlew/picture/Legend.h"
#include "curlew/picture/Panels.h"
#include "curlew/picture/Plot.h"
#include "curlew/picture/Warp.h"

namespace curlew::app {

namespace {

using namespace options;

const std::string kGroup = "pictures";

// --- panels
// ---------------------------------------------------------------------------------------------------------

/// The text of labels=, with figures of the report in place of their names in brackets.
std::vector<std::string> labelsOf(const Session& s, const Arguments& a) {
    if (!a.given("labels")) return {};
    return split(withFigures(s.report, a.text("labels")), '|');
}

void panelsAction(Session& s, const Arguments& a) {
    const size_t count = a.given("count") ? static_cast<size_t>(a.integer("count")) : s.images.size();
    if (s.images.empty()) throw ValueError("there is no image yet; make some with -slice");
    std::vector<Image> images, pictures;
    for (size_t age = count; age-- > 0;) images.push_back(s.images.at(age).image);
    const bool common = a.choice("scale") == 1;
    for (size_t k = 0; k < count; ++k) {
        const Image& image = images[k];
        const ColorMap map = s.images.at(count - 1 - k).map;
        if (image.channels.size() > 1) {
            pictures.push_back(displayed(image, automaticScale(image, ColorMap::diverging)));
            continue;
        }
        const ColorScale scale = common ? commonScale(images, map) : automaticScale(image, map);
        pictures.push_back(a.flag("legend") ? withLegend(image, scale, image.channels.front())
                                            : colorize(image, scale));
    }
    PanelOptions options{.columns = static_cast<int>(a.integer("columns")), .labels = labelsOf(s, a)};
    if (a.given("gap")) options.gap = static_cast<int>(a.integer("gap"));
    Image sheet = panels(pictures, options);
    for (size_t k = 0; k < count && !a.flag("keep"); ++k) s.images.take();
    s.images.push({std::move(sheet), ColorMap::gray}, s.now());
}

Action panelsDeclaration() {
    return {.name = "panels",
            .group = kGroup,
            .summary = "join images into one picture, the oldest of them first",
            .inputs = "images",
            .outputs = "image",
            .takes = {several(taken("images", {Kind::image}), 1, 10000, "as many as count= says, or all there are")},
            .makes = {made("image", {Kind::image})},
            .options = {integer("count", "", 1, 10000, "the newest so many (default: all there are)"),
                        integer("columns", "0", 0, 10000,
                                "pictures in a row; 0: all of up to three, else about as many columns as rows"),
                        integer("gap", "", 0, 10000, "pixels between them (default: a hundredth of the width)"),
                        text("labels", "",
                             "a line above each picture: a|b|c; [ACTION/FIGURE] in it is that figure of the report, "
                             "[[ a plain ["),
                        flag("legend", "1", "a colour bar below those that have one channel"),
                        choice("scale", {"own", "common"},
                               "of those that have one channel: colours by its own values, or by those of all"),
                        keep()},
            .examples = {"curlew -noise dim=2 frequency=2 -slice -noise dim=2 frequency=4 -slice -panels "
                         "labels='two cells|four cells' -write noises.png"},
            .run = panelsAction};
}

// --- warps
// ----------------------------------------------------------------------------------------------------------

void warpAction(Session& s, const Arguments& a) {
    if (s.flows.empty()) throw ValueError("there is no flow to move pixels along; make one of 2 dimensions with -dfvn");
    const auto* flow = std::get_if<FlowN<2>>(&s.flows.at());
    if (!flow)
        throw ValueError(fmt::format("the newest flow has {} dimensions; a warp needs one of 2, made of a -noise dim=2",
                                     dimensionOf(s.flows.at())));
    const BoxN<2>& box = flow->domain().box;
    const bool pattern = a.choice("pattern") == 1;
    const size_t age = a.given("image") ? a.ages("image").front() : 0;
    if (pattern && a.given("image"))
        throw ValueError("image= and pattern=waves are two things to warp; give one of them");
    if (!pattern && s.images.empty()) throw ValueError("there is no image to warp; -read one, or give pattern=waves");
    int width = 960, height = 0;
    if (!pattern) width = s.images.at(age).image.width, height = s.images.at(age).image.height;
    if (a.given("width")) width = static_cast<int>(a.integer("width"));
    if (a.given("width") || pattern)
        height = std::max(1, static_cast<int>(std::lround(width * box.size()[1] / box.size()[0])));
    const auto texture = [&]() -> Texture2 {
        if (pattern) return wavePattern;
        const ImageObject& object = s.images.at(age);
        return textureOf(displayed(object.image, automaticScale(object.image, object.map)), box);
    };
    Image picture = warpedPicture(*flow, texture(), box, width, height,
                                  {.time = a.real("time"),
                                   .steps = static_cast<int>(a.integer("steps")),
                                   .scheme = static_cast<Scheme>(a.choice("scheme")),
                                   .reprojections = static_cast<int>(a.integer("reprojections")),
                                   .supersampling = static_cast<int>(a.integer("supersampling"))},
                                  s.console.follow("warp"));
    s.images.push({std::move(picture), ColorMap::gray}, s.now());
}

Action warpDeclaration() {
    return {.name = "warp",
            .group = kGroup,
            .summary = "move the pixels of an image along the newest flow of 2 dimensions",
            .inputs = "flow of 2 dimensions, image (which stay)",
            .outputs = "image",
            .takes = {stays("flow", {Kind::flow}),
                      maybe(stays("image", {Kind::image}, "image"), "not needed with a pattern=")},
            .makes = {made("image", {Kind::image})},
            .options = {real("time", "0.5", "s",
                             "each pixel shows what is where the flow takes it in this time; negative: where it comes "
                             "from, so that the image moves with the flow"),
                        integer("steps", "64", 1, 1e6, "steps of equal length"),
                        choice("scheme", {"euler", "midpoint", "rk4"}, "integrator", "rk4"),
                        integer("reprojections", "1", 0, 1000, "corrections of Newton's method after each step"),
                        choice("pattern", {"none", "waves"}, "instead of an image: coloured waves"),
                        ages("image", "", "which image (default: the newest); it fills the box of the flow"),
                        integer("width", "", 1, 32768, "pixels across (default: those of the image; of waves 960)"),
                        integer("supersampling", "2", 1, 16, "places in a pixel along each edge, averaged")},
            .examples = {"curlew -noise type=gradient dim=2 frequency=7 -dfvn box=0,0,0,1.7778,1,1 -warp pattern=waves "
                         "-write warped.png",
                         "curlew -read plate.png -noise dim=2 frequency=3 -dfvn box=0,0,0,1.5,1,1 -warp time=-0.05 "
                         "-write warped.exr"},
            .run = warpAction};
}

void compareAction(Session& s, const Arguments& a) {
    if (s.images.size() < 2) throw ValueError("needs two images to compare");
    const ImageDifference difference = differenceOf(s.images.at().image, s.images.at(a.ages("with").front()).image);
    const std::string name = a.text("name");
    s.console.say(fmt::format("{}: root mean square difference {:.4g}, largest {:.4g}", name, difference.rms,
                              difference.largest));
    s.report[name] = {{"rmse", difference.rms}, {"largest", difference.largest}, {"unmatched", difference.unmatched}};
}

Action compareDeclaration() {
    return {
        .name = "compare",
        .group = kGroup,
        .summary = "how the newest image differs from another: root mean square and largest difference of their values",
        .inputs = "2 images (which stay)",
        .outputs = "report",
        .takes = {stays("other", {Kind::image}, "with"), stays("image", {Kind::image})},
        .makes = {made("report", {Kind::report})},
        .options = {ages("with", "1", "the other image: 1 is the one before"),
                    text("name", "compare", "of the figures in the report")},
        .examples = {"curlew -read a.exr b.exr -compare -expect compare/rmse most=0.01"},
        .run = compareAction};
}

// --- plots
// ----------------------------------------------------------------------------------------------------------

void plotAction(Session& s, const Arguments& a) {
    const std::string svg = plotSvg(readPlotData(a.words()[0]), {.title = a.text("title"),
                                                                 .xLabel = a.text("x"),
                                                                 .yLabel = a.text("y"),
                                                                 .logX = a.flag("logx"),
                                                                 .logY = a.flag("logy"),
                                                                 .width = static_cast<int>(a.integer("width")),
                                                                 .height = static_cast<int>(a.integer("height"))});
    writeAtomically(a.words()[1], [&](std::ostream& out) { out << svg; });
    s.console.say(fmt::format("wrote {}", a.words()[1]));
}

Action plotDeclaration() {
    return {.name = "plot",
            .group = kGroup,
            .summary = "curves of a table: the first column of a .csv is x, each other one a curve; into an .svg",
            .outputs = "file",
            .makes = {made("file", {Kind::file})},
            .options = {text("title", "", "above the plot"),
                        text("x", "", "below it (default: the first column's name)"), text("y", "", "beside it"),
                        flag("logx", "0", "a logarithmic axis"), flag("logy", "0", "a logarithmic axis"),
                        integer("width", "760", 200, 10000, "pixels"), integer("height", "460", 200, 10000, "pixels")},
            .positional = {"IN.csv OUT.svg", 2, 2},
            .examples = {"curlew -plot errors.csv errors.svg logx=1 logy=1 title='error of the track' y=error"},
            .run = plotAction,
            .prepare = [](const Arguments& a) { checkWritable(a.words()[1]); }};
}

} // namespace

std::vector<Action> pictureActions() {
    return {panelsDeclaration(), warpDeclaration(), compareDeclaration(), plotDeclaration()};
}

} // namespace curlew::app
