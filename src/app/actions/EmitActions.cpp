// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"
#include "ScatterDomain.h"
#include "curlew/track/Emission.h"
#include "curlew/track/WallMotion.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace curlew::app {

namespace {

using namespace options;

const std::string kEmitGroup = "points";

/// Returns whether a moving wall takes along the places of birth: most of them are in its layer and move as the emitter
/// does. -advect then takes births for points beside the wall as it is at the end of the frame (AdvectOptions::byAge).
bool movesWithWall(const Context& c, const Birthplace& birth, double size) {
    constexpr size_t kSamples = 64;
    constexpr double kClose = 0.05; // relative to the emitter's size
    if (!birth.place.clear || c.steady("flow")) return false;
    const FrameClock& clock = *c.clock();
    const Domain before = c.flowInTime("flow").at(clock.begin).domain();
    if (!before.wall) return false;
    const Points samples = scatterFrom(birth.domain, 0, kSamples, {.on = birth.place.on, .level = birth.place.level});
    Points earlier = samples;
    WallMotion(*birth.place.clear->wall, *before.wall, before.box, -clock.duration).carry(earlier);
    const Sdf there = c.sdfAt("domain", clock.begin, 2 * std::abs(birth.place.level));
    const auto distance = [](const Sdf& sdf, const Vec3d& x) { return sdf.distance.at<0>(x).value; };
    size_t along = 0;
    for (size_t k = 0; k < samples.size(); ++k) {
        const double now = distance(birth.domain.wall->sdf, samples.position(k));
        along += std::abs(distance(there, earlier.position(k)) - now) < kClose * size;
    }
    return 2 * along > kSamples;
}

/// Returns the domain in equal intervals of the frame: in one, unless a shape or rigid body moves by a quarter of its
/// size or more. (Between two frames, other level sets are blends, which may enclose nothing.) If the emitter moves
/// with a wall, there is one interval, too.
std::vector<Domain> birthplaces(const Context& c, const Arguments& a, const Birthplace& birth) {
    constexpr double kStep = 0.25, kMost = 64; // of the diagonal of its box; intervals
    std::vector<Domain> places{birth.domain};
    if (!c.has("domain") || c.kind("domain") == Kind::flow || c.steady("domain") || !birth.domain.wall) return places;
    const FrameClock& clock = *c.clock();
    const auto* grid = std::get_if<GridValue>(&c.value("domain"));
    const bool blends = grid && !grid->body;
    if (!(clock.duration > 0) || blends || !birth.domain.wall->sdf.bounds.finite()) return places;
    const auto before = c.boxBefore("domain"), now = boxOf(c.value("domain"));
    if (!before || !now) return places;
    const double size = length(now->size()),
                 way = std::max(length(now->lower - before->lower), length(now->upper - before->upper));
    if (!(size > 0)) return places;
    const auto count = static_cast<size_t>(std::clamp(std::ceil(way / (kStep * size)), 1.0, kMost));
    if (count == 1 || movesWithWall(c, birth, size)) return places;
    places.clear();
    for (size_t k = 0; k < count; ++k) {
        const double part = (static_cast<double>(k) + 0.5) / static_cast<double>(count);
        const Sdf there = c.sdfAt("domain", clock.begin + part * clock.duration, 2 * std::abs(birth.place.level));
        Domain place = Domain::of({.sdf = there, .side = birth.domain.wall->side});
        if (a.given("box")) place.box = birth.domain.box;
        places.push_back(place);
    }
    return places;
}

void emit(Context& c, const Arguments& a) {
    if (!c.clock()) throw ValueError("works frame by frame; put it after -frames");
    Birthplace birth = birthplaceOf(c, a, OffSurface::always);
    if (c.has("flow") && dimensionOf(c.anyFlow("flow")) <= 3 && c.flow("flow").domain().wall)
        birth.place.clear = c.flow("flow").domain();
    PointSet set = c.takePoints("points");
    Points& particles = set.particles;
    if (set.nextId == 0)
        for (const int64_t id : particles.id) set.nextId = std::max(set.nextId, id + 1);
    if (!particles.hasAge()) particles.age.assign(particles.size(), 0); // existing points start with age 0
    EmissionOptions options{.rate = a.real("rate"), .seed = a.integer<uint64_t>("seed")};
    if (a.given("life")) options.life = a.real("life"), options.spread = a.real("spread");
    options.place = birth.place;
    options.normalSpeed = a.real("speed");
    EmissionState state{c.memory().sum, set.nextId};
    Points born = emitted(birthplaces(c, a, birth), options, c.clock()->duration, state, c.follow("emit"));
    c.memory().sum = state.rates;
    set.nextId = state.nextId;
    if (const AnyFlow* flow = c.trackedFlow(set)) joinFlow(inSpace(*flow), particles, born);
    const size_t count = born.size();
    particles.append(born);
    c.info(fmt::format("emit: {} new points, {} in total", count, particles.size()));
    c.report("emit") = {{"born", count}, {"points", particles.size()}};
    c.give(std::make_shared<PointSet>(std::move(set)));
}

void kill(Context& c, const Arguments& a) {
    PointSet set = c.takePoints("points");
    Points& particles = set.particles;
    const bool outside = a.choice("side") == 0;
    std::vector<uint8_t> flags;
    if (a.given("box")) {
        const Box box = a.box("box");
        flags.resize(particles.size());
        for (size_t k = 0; k < flags.size(); ++k)
            flags[k] = static_cast<uint8_t>(box.contains(particles.position(k)) != outside);
    } else {
        const Domain kept{.wall = Wall{.sdf = c.sdf("shape", 0), .side = outside ? Side::inside : Side::outside}};
        flags = flagBeyondWall(particles, kept, c.follow("kill"));
    }
    const size_t before = particles.size();
    particles.remove(flags);
    c.info(fmt::format("kill: {} points removed, {} remain", before - particles.size(), particles.size()));
    c.report("kill") = {{"killed", before - particles.size()}, {"points", particles.size()}};
    c.give(std::make_shared<PointSet>(std::move(set)));
}

void wrap(Context& c, const Arguments& a) {
    PointSet set = c.takePoints("points");
    const Box box = a.given("box") ? a.box("box") : c.flow("flow").domain().box;
    if (!box.finite()) throw ValueError("the flow's box is infinite; give box=");
    curlew::wrap(set.particles, box);
    c.give(std::make_shared<PointSet>(std::move(set)));
}

/// The existing points to which the new ones are added.
Input joinedPoints() {
    Input input = maybe(changed("points", {Kind::points}), "existing points to which new points are added; optional");
    input.accumulates = true;
    return input;
}

/// The flow whose wall new points must not cross. If these fill a box, it is the domain, too.
Input airInput() {
    Input input = maybe(stays("flow", {Kind::flow}), "optional; its wall keeps new points on the flow's side");
    input.shares = fillsBox;
    return input;
}

bool withoutBox(const Arguments& a) { return !a.given("box"); }

} // namespace

Registry emitActions() {
    return {
        {.name = "emit",
         .group = kEmitGroup,
         .summary = "emitter: in each frame, add points in or on a flow, shape or level set, which may move, and "
                    "remove expired ones",
         .takes = {domainInput(), joinedPoints(), densityInput(), airInput()},
         .makes = {made("points", {Kind::points})},
         .options = {notNegative("rate", "1000", "1 / s", "number of points born"),
                     positive("life", "", "s", "age at which points die (default: never)"),
                     {.name = "spread",
                      .type = OptionType::real,
                      .fallback = "0",
                      .help = "random variation of the lives, as a fraction of life=",
                      .lower = 0,
                      .upper = 1,
                      .onlyWith = {"life="}},
                     integer("seed", "0", 0, 0x1p53 - 1, "random seed"),
                     onOption(),
                     offsetOption("0.1 %"),
                     onlyWith({"on=surface"},
                              notNegative("speed", "0", "world units / s",
                                          "speed along the surface normal, until the end of the frame of birth")),
                     box("box", "box to fill (default: the box of the domain)"),
                     ages("grid", "", "level set to fill: 0 is the newest"),
                     keep()},
         .examples = {"curlew -sphere -noise frequency=2 -noise frequency=2 seed=1 -bound side=outside -dfvn speed=1 "
                      "-frames 1-48 -emit on=surface rate=1e4 life=1 -advect -write dust.####.ply",
                      "curlew -noise -noise seed=1 -dfvn speed=1 -frames 1-48 -sphere radius=0.2 -emit rate=1e4 "
                      "life=1.5 spread=0.3 -advect -write 'smoke.$F4.ply'"},
         .inFrames = InFrames::each,
         .run = emit},
        {.name = "kill",
         .group = kEmitGroup,
         .summary = "delete the newest points outside (or inside) a box, or else the newest shape or level set",
         .takes = {changed("points", {Kind::points}), onlyIf(stays("shape", {Kind::shape, Kind::levelSet}, "grid"),
                                                             "not used if box= is given", withoutBox)},
         .makes = {made("points", {Kind::points})},
         .options = {choice("side", {"outside", "inside"}, "side on which points are deleted"),
                     box("box", "box to use instead of a shape"),
                     ages("grid", "", "level set to use instead of a shape: 0 is the newest"), keep()},
         .examples = {"curlew -scatter box=-2,-2,-2,2,2,2 -sphere -kill side=inside -write around.ply"},
         .inFrames = InFrames::each,
         .run = kill},
        {.name = "wrap",
         .group = kEmitGroup,
         .summary = "wrap the newest points around a box (periodic boundary), for noises with a period",
         .takes = {changed("points", {Kind::points}),
                   onlyIf(stays("flow", {Kind::flow}), "not used if box= is given", withoutBox)},
         .makes = {made("points", {Kind::points})},
         .options = {box("box",
                         "box whose edge lengths are periods of the noise (default: the box of the newest flow)"),
                     keep()},
         .examples = {"curlew -noise period=2 -noise period=2 seed=1 -dfvn -scatter -advect -wrap box=0,0,0,2,2,2 "
                      "-write tile.ply"},
         .inFrames = InFrames::each,
         .run = wrap}};
}

} // namespace curlew::app
