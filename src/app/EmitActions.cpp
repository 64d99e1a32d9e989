#include "Options.h"
#include "ScatterDomain.h"
#include "curlew/app/Registry.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Random.h"
#include "curlew/track/Scatter.h"

#include <algorithm>
#include <cmath>

namespace curlew::app {

namespace {

using namespace options;

const std::string kGroup = "points";
constexpr uint64_t kLifeStream = uint64_t{1} << 32; // of random numbers: beyond those of the positions

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

/// When particles are born in a frame: their ages at its end, in the order of their births.
std::vector<float> agesOfBirths(Session& s, double rate) {
    const double duration = s.clock->duration;
    if (duration == 0) return {};
    double& rates = s.emissions.rates[s.recorded()];
    // Products of a sum: for a rate that stays, as many births after any number of frames as there should be.
    const double before = rates * duration;
    rates += rate;
    const double after = rates * duration, born = std::floor(before), count = std::floor(after) - born;
    requireMemory(count * Particles::kBytes, fmt::format("{} births in a frame", count), "choose a smaller rate");
    std::vector<float> ages(static_cast<size_t>(count));
    for (size_t k = 0; k < ages.size(); ++k)
        ages[k] = static_cast<float>(std::max(0.0, after - born - static_cast<double>(k + 1)) / rate);
    return ages;
}

/// Newborn particles have the velocity and track of those that they join.
void joinFlow(Session& s, const Particles& others, Particles& born) {
    const auto& flows = s.flows.entries();
    const auto tracked =
        std::find_if(flows.begin(), flows.end(), [&](const auto& entry) { return entry.made == s.trackedFlow; });
    if (tracked == flows.end() || !others.hasVelocity()) return;
    const Flow flow = inSpace(tracked->object);
    for (auto* array : {&born.vx, &born.vy, &born.vz}) array->resize(born.size());
    if (others.hasTrack())
        for (auto* array : {&born.f, &born.g}) array->resize(born.size());
    parallelFor(born.size(), kBatch, [&](size_t begin, size_t end) {
        PointBatch points;
        for (size_t k = begin; k < end; ++k) points.push({{born.x[k], born.y[k], born.z[k]}});
        Flow::Jets<double> potentials;
        VecBatch<double> velocity;
        flow.eval(points, potentials, velocity);
        for (size_t k = begin; k < end; ++k) {
            const int i = static_cast<int>(k - begin);
            born.vx[k] = static_cast<float>(velocity[i][0]);
            born.vy[k] = static_cast<float>(velocity[i][1]);
            born.vz[k] = static_cast<float>(velocity[i][2]);
            if (born.f.empty()) continue;
            born.f[k] = potentials[0][i].value;
            born.g[k] = potentials[1][i].value;
        }
    });
}

void giveLives(Particles& born, double life, double spread, uint64_t seed) {
    born.life.resize(born.size());
    for (size_t k = 0; k < born.size(); ++k) {
        const double part = 2 * randomUniform(seed, static_cast<uint64_t>(born.id[k]), kLifeStream) - 1;
        born.life[k] = static_cast<float>(life * (1 + spread * part));
    }
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

    std::vector<float> ages = agesOfBirths(s, a.real("rate"));
    const auto seed = static_cast<uint64_t>(a.integer("seed"));
    Particles born = scatterFrom(domain, nextId->second, ages.size(), seed, s.console.follow("emit"));
    nextId->second += static_cast<int64_t>(ages.size());
    born.age = std::move(ages);
    if (a.given("life")) giveLives(born, a.real("life"), a.real("spread"), seed);
    born.grow(0); // those whose life was shorter than what is left of the frame
    joinFlow(s, particles, born);
    const size_t count = born.size();
    particles.append(born);
    s.console.say(fmt::format("emit: {} points born, {} in all", count, particles.size()));
    s.report["emit"] = {{"born", count}, {"points", particles.size()}};
}

// --- deaths and returns
// ----------------------------------------------------------------------------------------------------------

/// Flags those that the domain does not allow; the box is not judged.
std::vector<uint8_t> beyond(const Particles& particles, const Domain& domain, const Monitor& monitor) {
    std::vector<uint8_t> flags(particles.size());
    parallelFor(
        particles.size(), kBatch,
        [&](size_t begin, size_t end) {
            PointBatch points;
            for (size_t k = begin; k < end; ++k) points.push({{particles.x[k], particles.y[k], particles.z[k]}});
            std::array<bool, kBatch> allowed;
            std::array<double, kBatch> distance;
            classify(domain, points, allowed, distance);
            for (size_t k = begin; k < end; ++k) flags[k] = static_cast<uint8_t>(!allowed[k - begin]);
        },
        monitor);
    return flags;
}

void kill(Session& s, const Arguments& a) {
    Particles& particles = s.particles();
    const bool outside = a.choice("side") == 0;
    std::vector<uint8_t> flags;
    if (a.given("box")) {
        const Box box = a.box("box");
        flags.resize(particles.size());
        for (size_t k = 0; k < flags.size(); ++k)
            flags[k] =
                static_cast<uint8_t>(box.contains({{particles.x[k], particles.y[k], particles.z[k]}}) != outside);
    } else {
        const Sdf sdf = a.given("grid") ? s.levelSetSdf(a.ages("grid").front(), 0) : s.newestSdf(0);
        const Domain kept{.wall = Wall{.sdf = sdf, .side = outside ? Side::inside : Side::outside}};
        flags = beyond(particles, kept, s.console.follow("kill"));
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
    const std::array<std::vector<double>*, 3> axes{&particles.x, &particles.y, &particles.z};
    for (int axis = 0; axis < 3; ++axis) {
        const double lower = box.lower[axis], upper = box.upper[axis], period = upper - lower;
        for (double& value : *axes[static_cast<size_t>(axis)]) {
            value -= period * std::floor((value - lower) / period);
            if (value >= upper) value = lower; // by rounding
        }
    }
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
