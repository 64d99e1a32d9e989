// SPDX-License-Identifier: Apache-2.0
#include "../run/Figures.h"
#include "Actions.h"
#include "GpuOption.h"
#include "TrackOptions.h"
#include "curlew/app/registry/Text.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/picture/Display.h"
#include "curlew/picture/Legend.h"
#include "curlew/picture/Panels.h"
#include "curlew/picture/Plot.h"
#include "curlew/picture/Warp.h"

namespace curlew::app {

namespace {

using namespace options;

const std::string kPictureGroup = "pictures";

// --- panels
// ---------------------------------------------------------------------------------------------------------

void panelsAction(Context& c, const Arguments& a) {
    std::vector<Image> images, pictures;
    for (size_t k = 0; k < c.count("images"); ++k) images.push_back(c.image("images", k).image);
    const bool common = a.choice("colorRange") == 1;
    for (size_t k = 0; k < images.size(); ++k) {
        const Image& image = images[k];
        const ColorMap map = c.image("images", k).map;
        if (image.channels.size() > 1) {
            pictures.push_back(displayed(image, automaticScale(image, ColorMap::diverging)));
            continue;
        }
        const ColorScale scale = common ? commonScale(images, map) : automaticScale(image, map);
        pictures.push_back(a.flag("legend") ? withLegend(image, scale, image.channels.front())
                                            : colorize(image, scale));
    }
    PanelOptions options{.columns = a.integer<int>("columns")};
    if (a.given("gap")) options.gap = a.integer<int>("gap");
    if (a.given("labels")) options.labels = split(withFigures(c.wholeReport(), a.text("labels")), '|');
    c.give(std::make_shared<const ImageValue>(ImageValue{panels(pictures, options), ColorMap::gray}));
}

Input panelInput() {
    Input input = several(taken("images", {Kind::image}), 1, 10000, "count= images, or all");
    input.amountWith = [amount = input.amount](const Arguments& a, const Scope& scope) {
        if (scope.linked()) return amount;
        const size_t count = a.given("count") ? a.integer<size_t>("count") : scope.count({Kind::image});
        return Amount{std::max(count, size_t{1}), std::max(count, size_t{1})};
    };
    return input;
}

Action panelsDeclaration() {
    return {
        .name = "panels",
        .group = kPictureGroup,
        .summary = "contact sheet: join images into one picture, the oldest first",
        .takes = {panelInput()},
        .makes = {made("image", {Kind::image})},
        .options =
            {selector(integer("count", "", 1, 10000, "number of images, the newest ones (default: all)")),
             integer("columns", fmt::format("{}", PanelOptions{}.columns), 0, 10000,
                     "pictures per row; 0: up to three in one row, otherwise about as many columns as rows"),
             integer("gap", "", 0, 10000, "pixels between pictures (default: 1/100 of the width)"),
             text("labels", "",
                  "captions above the pictures: a|b|c; [ACTION/FIGURE] stands for that figure of the report, [[ "
                  "for a plain ["),
             flag("legend", "1", "1: draw a colour bar below single-channel images"),
             formerly(
                 {"scale"},
                 choice("colorRange", {"own", "common"},
                        "colour range of single-channel images: of each one's own values, or of the values of all")),
             keep()},
        .examples = {"curlew -noise dimensions=2 frequency=2 -slice -noise dimensions=2 frequency=4 -slice -panels "
                     "labels='two cells|four cells' -write noises.png"},
        .readsReport = true,
        .run = panelsAction};
}

// --- warps
// ----------------------------------------------------------------------------------------------------------

const Binding<WarpOptions>& warpBinding() {
    static const auto binding = [] {
        WarpOptions defaults;
        defaults.supersampling = 2;
        return Binding<WarpOptions>(defaults)
            .add(
                formerly({"time"}, real("duration", "", "s",
                                        "advection time: each pixel shows the image at the position to which the "
                                        "flow carries the pixel in this time; if negative, the image moves along the "
                                        "flow")),
                [](auto& o) -> auto& { return o.time; })
            .include(
                stepBinding<WarpOptions>(
                    "number of equal steps, instead of steps chosen by accuracy=; with both, accuracy= chooses them "
                    "(default: 64 for schemes without error estimate)",
                    "maximum estimated error of each step of a pixel (default: 1e-6 of the diagonal of the flow's box, "
                    "unless steps= or a scheme without error estimate is given)"),
                [](auto& o) -> auto& { return o; })
            .add(
                formerly({"reprojections"},
                         integer("corrections", "", 0, 1000, "number of Newton corrections after each step")),
                [](auto& o) -> auto& { return o.corrections; })
            .add(
                integer("supersampling", "", 1, 16, "anti-aliasing: samples along each edge of a pixel"),
                [](auto& o) -> auto& { return o.supersampling; });
    }();
    return binding;
}

WarpOptions warpOptions(const Arguments& a) {
    constexpr int kEqualSteps = 64; // for a scheme without error estimate
    WarpOptions options = warpBinding().read(a);
    if (asksForEqualSteps(a, options.scheme)) options.steps = kEqualSteps;
    return options;
}

void warpAction(Context& c, const Arguments& a) {
    const AnyFlow& any = c.anyFlow("flow");
    const auto* flow = std::get_if<FlowN<2>>(&any);
    if (!flow)
        throw ValueError(
            fmt::format("the newest flow has {} dimensions; -warp needs a flow of 2, made of -noise dimensions=2",
                        dimensionOf(any)));
    const BoxN<2>& box = flow->domain().box;
    const ImageValue* source = c.has("image") ? &c.image("image") : nullptr;
    int width = source ? source->image.width : 960, height = source ? source->image.height : 0;
    if (a.given("width")) width = a.integer<int>("width");
    if (a.given("width") || !source)
        height = std::max(1, static_cast<int>(std::lround(width * box.size()[1] / box.size()[0])));
    const Texture2 texture =
        source ? textureOf(displayed(source->image, automaticScale(source->image, source->map)), box) : wavePattern;
    Image picture = warpedPicture(*flow, texture, box, width, height, warpOptions(a), c.follow("warp"), warperOf(c, a));
    c.give(std::make_shared<const ImageValue>(ImageValue{std::move(picture), ColorMap::gray}));
}

Action warpDeclaration() {
    std::vector<Option> declared = warpBinding().options();
    declared.insert(
        declared.end() - 1,
        {choice("pattern", {"none", "waves"}, "test pattern instead of an image: coloured waves"),
         ages("image", "", "image to warp, which fills the box of the flow: 0 is the newest (default: the newest)"),
         integer("width", "", 1, 32768, "picture width in pixels (default: that of the image; 960 for waves)"),
         deviceOption()});
    const auto noPattern = [](const Arguments& a) { return a.choice("pattern") == 0; };
    return {.name = "warp",
            .group = kPictureGroup,
            .summary = "distort an image along the newest 2D flow",
            .takes = {onlyIf(stays("image", {Kind::image}, "image"), "only with pattern=none", noPattern),
                      stays("flow", {Kind::flow})},
            .makes = {made("image", {Kind::image})},
            .options = declared,
            .examples =
                {"curlew -noise type=gradient dimensions=2 frequency=7 -dfvn box=0,0,0,1.7778,1,1 -warp pattern=waves "
                 "-write warped.png",
                 "curlew -read plate.png -noise dimensions=2 frequency=3 -dfvn box=0,0,0,1.5,1,1 -warp duration=-0.05 "
                 "-write warped.exr"},
            .run = warpAction};
}

void compareAction(Context& c, const Arguments& a) {
    const ImageDifference difference = differenceOf(c.image("image").image, c.image("other").image);
    const std::string name = a.text("name");
    c.info(fmt::format("{}: root mean square difference {:.4g}, largest {:.4g}", name, difference.rms,
                       difference.largest));
    c.report(name) = {{"rmse", difference.rms}, {"largest", difference.largest}, {"unmatched", difference.unmatched}};
}

Action compareDeclaration() {
    return {.name = "compare",
            .group = kPictureGroup,
            .summary = "compare two images: root mean square error (RMSE) and largest difference of their values",
            .takes = {stays("other", {Kind::image}, "with"), stays("image", {Kind::image})},
            .makes = {made("report", {Kind::report})},
            .options = {ages("with", "1", "image to compare with: 1 is the one before the newest"),
                        text("name", "compare", "name of the figures in the report")},
            .examples = {"curlew -read a.exr b.exr -compare -expect compare/rmse max=0.01"},
            .evaluation = Evaluation::effect,
            .run = compareAction};
}

// --- plots
// ----------------------------------------------------------------------------------------------------------

void plotAction(Context& c, const Arguments& a) {
    const std::string svg = plotSvg(readPlotData(a.words()[0]), {.title = a.text("title"),
                                                                 .xLabel = a.text("x"),
                                                                 .yLabel = a.text("y"),
                                                                 .logX = a.flag("logx"),
                                                                 .logY = a.flag("logy"),
                                                                 .width = a.integer<int>("width"),
                                                                 .height = a.integer<int>("height")});
    writeAtomically(a.words()[1], [&](std::ostream& out) { out << svg; });
    c.info(fmt::format("wrote {}", a.words()[1]));
}

Action plotDeclaration() {
    const PlotOptions o;
    return {
        .name = "plot",
        .group = kPictureGroup,
        .summary = "line plot of a table: the first column of a .csv is x, each other column a curve; written as .svg",
        .makes = {made("file", {Kind::file})},
        .options = {text("title", "", "title above the plot"),
                    text("x", "", "label of the x axis (default: the first column's name)"),
                    text("y", "", "label of the y axis"), flag("logx", "0", "1: logarithmic axis"),
                    flag("logy", "0", "1: logarithmic axis"),
                    integer("width", fmt::format("{}", o.width), 200, 10000, "picture width in pixels"),
                    integer("height", fmt::format("{}", o.height), 200, 10000, "picture height in pixels")},
        .positional = {"IN.csv OUT.svg", 2, 2},
        .examples = {"curlew -plot errors.csv errors.svg logx=1 logy=1 title='error of the track' y=error"},
        .evaluation = Evaluation::effect,
        .run = plotAction,
        .prepare =
            [](const Arguments& a) {
                const std::string& file = a.words()[1];
                if (endingOf(file) != ".svg" && !isStream(file))
                    throw ValueError(fmt::format("'{}' must end in .svg, the format of plots", file));
                checkWritable(file);
            },
        .files =
            [](const Arguments& a) {
                return FileUse{{a.words()[0]}, {a.words()[1]}};
            }};
}

} // namespace

Registry pictureActions() { return {panelsDeclaration(), warpDeclaration(), compareDeclaration(), plotDeclaration()}; }

} // namespace curlew::app
