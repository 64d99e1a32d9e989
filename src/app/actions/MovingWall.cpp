// SPDX-License-Identifier: Apache-2.0
#include "MovingWall.h"

#include "curlew/track/WallMotion.h"
#include "curlew/track/WallVelocity.h"

#include <fmt/format.h>

#include <utility>

namespace curlew::app {

namespace {

/// A flow's wall at the beginning, in the middle and at the end of a time.
struct WallInTime {
    Wall first, middle, end;
    Box box;
    double begin, time;
};

void warnOfLostWall(const Context& c, const WallInTime& wall, std::string_view consequence) {
    const double lost = partLost(wall.first, wall.middle, wall.end, wall.box);
    if (lost == 0 || std::exchange(c.memory().warnedOfWall, true)) return;
    c.warn(
        fmt::format("from {:.4g} to {:.4g} s, {:.0f} % of the wall moves farther than {:.3g}, beyond which its "
                    "distance is unknown, so {}; use meshes whose faces stay the same from frame to frame, more "
                    "frames, or a wider layer (-bound layer=)",
                    wall.begin, wall.begin + wall.time, 100 * lost, wall.first.sdf.reach, consequence));
}

} // namespace

void warnOfFastAir(const Context& c, const WallVelocity& velocity, const Domain& domain) {
    constexpr double kFast = 4; // times the speed of the wall
    if (c.memory().warnedOfAir) return;
    const auto [wall, air] = velocity.speeds(domain.box);
    if (!(air > kFast * wall)) return;
    c.memory().warnedOfAir = true;
    c.warn(
        fmt::format("the wall moves at up to {:.3g} units per second and pushes the air in its layer at up to {:.3g}, "
                    "since what it displaces has to pass it within the layer, which is {:.3g} wide; a wider one "
                    "(-bound layer=) makes it slower",
                    wall, air, domain.wall->width));
}

void warnOfMovingWall(const Context& c, const FlowInTime& flow, double begin, double time, std::string_view consequence,
                      bool inLayer) {
    if (flow.steady() || time == 0 || (c.memory().warnedOfWall && c.memory().warnedOfAir)) return;
    const Domain first = flow.at(begin).domain();
    if (!first.wall) return;
    const Domain middle = flow.at(begin + time / 2).domain(), end = flow.at(begin + time).domain();
    if (!middle.wall || !end.wall) return;
    const WallInTime wall{*first.wall, *middle.wall, *end.wall, first.box, begin, time};
    warnOfLostWall(c, wall, consequence);
    if (inLayer) warnOfFastAir(c, {wall.first, wall.middle, wall.end, time / 2, wall.box}, first);
}

void warnOfMovingWall(const Context& c, const FlowInTime& flow, std::string_view consequence, bool inLayer) {
    if (c.clock()) warnOfMovingWall(c, flow, c.clock()->begin, c.clock()->duration, consequence, inLayer);
}

} // namespace curlew::app
