#include "Options.h"
#include "ScatterDomain.h"
#include "curlew/app/Registry.h"
#include "curlew/track/Emission.h"

#include <algorithm>
#include <optional>

namespace curlew::app {

namespace {

using namespace options;

const std::string kGroup = "points";

// --- births
// ----------------------------------------------------------------------------------------------------------

/// The newest points that the next frame will see, as a place on the stack.
Stack<Geometry>::Entry& carriedPoints(Session& s) {
    for (size_t age = 0; age < s.geometry.size(); ++age) {
        auto& entry = s.geometry.entries()[s.geometry.size() - 1 - age];
        if (std::holds_alternative<Particles>(entry.object) && s.carries(entry.made)) return entry;
    }
    s.geometry.push(Particles{}, s.now());
    return s.geometry.entries().back();
}

/// The flow whose tracks the points are on.
std::optional<Flow> trackedFlow(const Session& s) {
    for (const auto& entry : s.flows.entries())
        if (entry.made == s.trackedFlow) return inSpace(entry.object);
    return {};
}

void emit(Session& s, const Arguments& a) {
    if (!s.clock) throw ValueError("needs frames in which to emit; put it after -frames");
    const Domain domain = scatterDomain(s, a);
    Stack<Geometry>::Entry& entry = carriedPoints(s);
    auto& particles = std::get<Particles>(entry.object);
    const auto [nextId, first] = s.emissions.nextIds.try_emplace(entry.made, 0);
    if (first)
        for (const int64_t id : particles.id) nextId->second = std::max(nextId->second, id + 1);

    if (!particles.hasAge()) particles.age.assign(particles.size(), 0); // they begin with the frames

    EmissionOptions options{.rate = a.real("rate"), .seed = static_cast<uint64_t>(a.integer("seed"))};
    if (a.given("life")) options.life = a.real("life"), options.spread = a.real("spread");
    double& rates = s.emissions.rates[s.recorded()];
    EmissionState state{rates, nextId->second};
    Particles born = emitted(domain, options, s.clock->duration, state, s.console.follow("emit"));
    rates = state.rates;
    nextId->second = state.nextId;
    if (const auto flow = trackedFlow(s)) joinFlow(*flow, particles, born);
    const size_t count = born.size();
    particles.append(born);
    s.console.say(fmt::format("emit: {} points born, {} in all", count, particles.size()));
    s.report["emit"] = {{"born", count}, {"points", particles.size()}};
}

// --- deaths and returns
// ----------------------------------------------------------------------------------------------------------

void kill(Session& s, const Arguments& a) {
    Particles& particles = s.particles();
    const bool outside = a.choice("side") == 0;
    std::vector<uint8_t> flags;
    if (a.given("box")) {
        const Box box = a.box("box");
        flags.resize(particles.size());
        for (size_t k = 0; k < flags.size(); ++k)
            flags[k] = static_cast<uint8_t>(box.contains(particles.position(k)) != outside);
    } else {
        const Sdf sdf = a.given("grid") ? s.levelSetSdf(a.ages("grid").front(), 0) : s.newestSdf(0);
        const Domain kept{.wall = Wall{.sdf = sdf, .side = outside ? Side::inside : Side::outside}};
        flags = flagBeyondWall(particles, kept, s.console.follow("kill"));
    }
    const size_t before = particles.size();
    particles.remove(flags);
    s.console.say(fmt::format("kill: {} points, {} are left", before - particles.size(), particles.size()));
    s.report["kill"] = {{"killed", before - particles.size()}, {"points", particles.size()}};
}

void wrap(Session& s, const Arguments& a) {
    Particles& particles = s.particles();
    const Box box = a.given("box") ? a.box("box") : s.flow().domain().box;
    if (!box.finite()) throw ValueError("the box of the flow is infinite; give box=");
    curlew::wrap(particles, box);
}

} // namespace

std::vector<Action> emitActions() {
    return {
        {.name = "emit",
         .group = kGroup,
         .summary = "in each frame, new points in the domain of the newest flow, shape or level set; those whose "
                    "age is above their life are removed",
         .inputs = "flow, shape or level set (which stays); points, if there are any",
         .outputs = "points, with id and age",
         .takes = {maybe(stays("domain", {Kind::flow, Kind::shape, Kind::levelSet}, "grid"),
                         "with box= there may be none"),
                   maybe(changed("points", {Kind::points}), "that the new ones join")},
         .makes = {made("points", {Kind::points})},
         .options = {notNegative("rate", "1000", "1 / s", "births"),
                     positive("life", "", "s", "the age at which they die (default: never)"),
                     {.name = "spread",
                      .type = OptionType::real,
                      .fallback = "0",
                      .help = "lives differ by up to this part of them, at random",
                      .lower = 0,
                      .upper = 1},
                     integer("seed", "0", 0, 0x1p53 - 1, "another seed, other points"),
                     box("box", "the box to fill (default: that of the domain)"),
                     ages("grid", "", "a level set to fill")},
         .examples = {"curlew -noise -noise seed=1 -dfvn speed=1 -frames 1-48 -sphere radius=0.2 -emit rate=1e4 "
                      "life=1.5 spread=0.3 -advect -write 'smoke.$F4.ply'"},
         .run = emit},
        {.name = "kill",
         .group = kGroup,
         .summary = "remove the newest points that are outside (or inside) of a box, or else of the newest shape or "
                    "level set",
         .inputs = "points; shape or level set (which stays)",
         .outputs = "points",
         .takes = {changed("points", {Kind::points}),
                   maybe(stays("shape", {Kind::shape, Kind::levelSet}, "grid"), "with box= there is none")},
         .makes = {made("points", {Kind::points})},
         .options = {choice("side", {"outside", "inside"}, "where points are removed"),
                     box("box", "instead of a shape"), ages("grid", "", "a level set instead of a shape")},
         .examples = {"curlew -scatter box=-2,-2,-2,2,2,2 -sphere -kill side=inside -write around.ply"},
         .run = kill},
        {.name = "wrap",
         .group = kGroup,
         .summary = "put the newest points that have left a box back in at its other side: for noises with a period",
         .inputs = "points",
         .outputs = "points",
         .takes = {changed("points", {Kind::points}), maybe(stays("flow", {Kind::flow}), "with box= there is none")},
         .makes = {made("points", {Kind::points})},
         .options = {box("box", "whose edges are periods of the noise (default: the box of the newest flow)")},
         .examples = {"curlew -noise period=2 -noise period=2 seed=1 -dfvn -scatter -advect -wrap box=0,0,0,2,2,2 "
                      "-write tile.ply"},
         .run = wrap}};
}

} // namespace curlew::app
