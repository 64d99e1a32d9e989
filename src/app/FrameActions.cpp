#include "Options.h"
#include "curlew/app/Registry.h"

namespace curlew::app {

namespace {

using namespace options;

const std::string kGroup = "program";

} // namespace

std::vector<Action> frameActions() {
    // The program itself does what these two ask for (src/app/Runner.cpp).
    return {
        {.name = "frames",
         .group = kGroup,
         .summary = "run all that follows once for each frame, on the points that the last frame left",
         .options = {positive("fps", "24", "1 / s", "frames per second; T of a frame is 0 in the first one"),
                     integer("by", "1", 1, 1e6, "every so many frames, as FIRST-LASTxBY"),
                     integer("substeps", "1", 1, 1e6, "in how many steps points move from frame to frame"),
                     text("checkpoint", "", "a file that after each frame holds what the next one needs, for -resume"),
                     text("part", "",
                          "3/8: only the third of eight parts, where frames do not depend on each other; each part "
                          "has every eighth frame")},
         .positional = {"FIRST-LAST", 1, 1},
         .examples = {"curlew -frames 1-48 fps=24 -noise 'alpha={2*pi*T}' -noise seed=1 -dfvn -velocity -write "
                      "'vel.$F4.vdb'",
                      "curlew -noise -noise seed=1 -dfvn speed=1 -scatter -frames 1-48 substeps=4 "
                      "checkpoint=points.checkpoint -advect -write 'points.$F4.vdb' -resume"},
         .run = [](Session&, const Arguments&) {}},
        {.name = "resume",
         .group = kGroup,
         .summary = "anywhere: continue -frames after the last frame whose checkpoint there is",
         .examples = {"curlew -resume -sphere -scatter -frames 1-48 checkpoint=run.checkpoint -noise alpha={T} -noise "
                      "seed=1 -dfvn -advect -write 'points.$F4.ply'"},
         .run = [](Session&, const Arguments&) {}}};
}

} // namespace curlew::app
