#include "Options.h"
#include "curlew/app/Registry.h"
#include "curlew/app/Session.h"
#include "curlew/app/Text.h"
#include "curlew/image/Display.h"
#include "curlew/image/Legend.h"
#include "curlew/image/Panels.h"

namespace curlew::app {

namespace {

using namespace options;

const std::string kGroup = "pictures";

// --- panels
// ---------------------------------------------------------------------------------------------------------

/// One scale for the values of all images of one channel.
ColorScale commonScale(const std::vector<ImageObject>& images, ColorMap map) {
    Image all{.width = 1, .height = 0, .channels = {"all"}, .pixels = {}};
    for (const ImageObject& object : images) {
        const Image& image = object.image;
        if (image.channels.size() == 1) all.pixels.insert(all.pixels.end(), image.pixels.begin(), image.pixels.end());
    }
    return automaticScale(all, map);
}

void panelsAction(Session& s, const Arguments& a) {
    const size_t count = a.given("count") ? static_cast<size_t>(a.integer("count")) : s.images.size();
    if (s.images.empty()) throw ValueError("there is no image yet; make some with -slice");
    std::vector<ImageObject> images;
    for (size_t age = count; age-- > 0;) images.push_back(s.images.at(age));
    const bool common = a.choice("scale") == 1;
    std::vector<Image> pictures;
    for (const ImageObject& object : images) {
        const Image& image = object.image;
        if (image.channels.size() > 1) {
            pictures.push_back(displayed(image));
            continue;
        }
        const ColorScale scale = common ? commonScale(images, object.map) : automaticScale(image, object.map);
        pictures.push_back(a.flag("legend") ? withLegend(image, scale, image.channels.front())
                                            : colorize(image, scale));
    }
    PanelOptions options{.columns = static_cast<int>(a.integer("columns")),
                         .labels = a.given("labels") ? split(a.text("labels"), '|') : std::vector<std::string>{}};
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
                        text("labels", "", "a line above each picture: a|b|c"),
                        flag("legend", "1", "a colour bar below those that have one channel"),
                        choice("scale", {"own", "common"},
                               "of those that have one channel: colours by its own values, or by those of all"),
                        keep()},
            .examples = {"curlew -noise dim=2 frequency=2 -slice -noise dim=2 frequency=4 -slice -panels "
                         "labels='two cells|four cells' -write noises.png"},
            .run = panelsAction};
}

} // namespace

std::vector<Action> pictureActions() { return {panelsDeclaration()}; }

} // namespace curlew::app
