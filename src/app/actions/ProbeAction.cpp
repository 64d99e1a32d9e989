// SPDX-License-Identifier: Apache-2.0
#include "ProbeAction.h"

#include "curlew/app/registry/Options.h"
#include "curlew/app/run/Context.h"
#include "curlew/app/run/Probe.h"
#include "curlew/base/AtomicFile.h"

#include <cmath>

namespace curlew::app {

namespace {

/// Warns of positions beyond the narrow band of a level set, where its values are not distances.
void warnBeyondBand(const Context& c, const Positions& positions) {
    if (positions.dimension() != 3) return;
    constexpr double kAtItsEnd = 0.5; // voxels, over which the spline bends
    const LevelSet levelSet = c.levelSet("what", 0);
    const double reach = (levelSet.halfWidth() - kAtItsEnd) * levelSet.voxelSize();
    const ScalarField distance = c.sdf("what", 0).distance;
    size_t beyond = 0;
    for (size_t k = 0; k < positions.size(); ++k)
        beyond += std::abs(distance.at<0>(positions.at<3>(k)).value) > reach ? 1 : 0;
    if (beyond > 0)
        c.warn(
            fmt::format("{} of {} positions are farther than {:.3g} from the surface, beyond the narrow band of the "
                        "level set, so their values are no distances; widen it with -mesh2ls halfWidth=",
                        beyond, positions.size(), reach));
}

void probe(Context& c, const Arguments& a) {
    const auto positions = readPositions(a.words()[0]);
    const int order = a.integer<int>("order");
    const std::string& output = a.words()[1];
    const bool isFloat = a.choice("precision") == 1;
    const Monitor monitor = c.follow("probe");
    const auto probeAny = [&](const auto& object, const auto& asFloat, const auto& asDouble) {
        std::visit([&](const auto& o) { isFloat ? asFloat(o) : asDouble(o); }, object);
    };
    // Fields of fewer dimensions are extended to 3D for 3D positions.
    const bool spatial = positions.dimension() == 3;
    if (c.kind("what") == Kind::flow) {
        const AnyFlow& flow = c.anyFlow("what");
        const AnyFlow probed = spatial && dimensionOf(flow) < 3 ? AnyFlow(inSpace(flow)) : flow;
        if (spatial && dimensionOf(probed) == 3) {
            const Vec3d first = inSpace(flow).at(positions.at<3>(0)).velocity;
            c.report("probe") = {{"first_vx", first[0]}, {"first_vy", first[1]}, {"first_vz", first[2]}};
        }
        return probeAny(
            probed, [&](const auto& f) { probeFlow<float>(f, positions, order, output, monitor); },
            [&](const auto& f) { probeFlow<double>(f, positions, order, output, monitor); });
    }
    if (c.kind("what") == Kind::levelSet) warnBeyondBand(c, positions);
    AnyField probed = c.kind("what") == Kind::levelSet ? AnyField(c.sdf("what", 0).distance) : c.field("what").field;
    if (spatial && dimensionOf(probed) < 3) probed = inSpace(probed);
    probeAny(
        probed, [&](const auto& f) { probeField<float>(f, positions, order, output, monitor); },
        [&](const auto& f) { probeField<double>(f, positions, order, output, monitor); });
}

} // namespace

Action probeAction() {
    using namespace options;
    return {
        .name = "probe",
        .group = "files",
        .summary = "evaluate the newest field, flow or level set at the positions in a .csv file",
        .takes = {stays("what", {Kind::field, Kind::flow, Kind::levelSet})},
        .makes = {made("file", {Kind::file})},
        .options =
            {integer(
                 "order", "1", 0, 2,
                 "highest order of derivatives; of a flow, which is itself made of first ones, 2 adds the Jacobian"),
             choice("precision", {"double", "float"},
                    "floating-point precision of values and first derivatives; second ones are always double")},
        .positional = {"IN.csv OUT.csv", 2, 2},
        .examples = {"curlew -noise frequency=2 -probe points.csv values.csv order=2"},
        .evaluation = Evaluation::effect,
        .run = probe,
        .prepare = [](const Arguments& a) { checkWritable(a.words()[1]); },
        .files =
            [](const Arguments& a) {
                return FileUse{{a.words()[0]}, {a.words()[1]}};
            }};
}

} // namespace curlew::app
