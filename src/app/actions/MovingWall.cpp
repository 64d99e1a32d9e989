// SPDX-License-Identifier: Apache-2.0
#include "MovingWall.h"

#include "curlew/track/WallMotion.h"

#include <fmt/format.h>

namespace curlew::app {

void warnOfLostWall(const Context& c, const FlowInTime& flow, double begin, double time, std::string_view consequence) {
    if (flow.steady() || time == 0 || c.memory().warnedOfWall) return;
    const Domain first = flow.at(begin).domain();
    if (!first.wall) return;
    const Domain middle = flow.at(begin + time / 2).domain(), end = flow.at(begin + time).domain();
    if (!middle.wall || !end.wall) return;
    const double lost = partLost(*first.wall, *middle.wall, *end.wall, first.box);
    if (lost == 0) return;
    c.memory().warnedOfWall = true;
    c.warn(
        fmt::format("from {:.4g} to {:.4g} s, {:.0f} % of the wall moves farther than {:.3g}, beyond which its "
                    "distance is unknown, so {}; use meshes whose faces stay the same from frame to frame, more "
                    "frames, or a wider layer (-bound layer=)",
                    begin, begin + time, 100 * lost, first.wall->sdf.reach, consequence));
}

void warnOfLostWall(const Context& c, const FlowInTime& flow, std::string_view consequence) {
    if (c.clock()) warnOfLostWall(c, flow, c.clock()->begin, c.clock()->duration, consequence);
}

} // namespace curlew::app
