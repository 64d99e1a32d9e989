// SPDX-License-Identifier: Apache-2.0
#include "Contained.h"
#include "Tables.h"
#include "curlew/base/Parallel.h"
#include "curlew/math/Percentile.h"
#include "curlew/track/VolumeChange.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

namespace curlew::paper {

namespace {

constexpr double kTime = 2;
constexpr double kMeanBar = 1e-4, kMaxBar = 1e-2; ///< Error bounds of the defaults, relative to the object's size.
constexpr double kVolumeBar = 1e-6;               ///< Bound for the deviation of the flow map's determinant from 1.

/// The allowed cost of adaptive steps at the mean error of `steps` equal RK4 steps, relative to RK4, in evaluations of
/// the flow: the aim, and the claim.
struct Bar {
    int steps;
    double aim, claim;
};
constexpr std::array<Bar, 2> kBars{{{100, 0.5, 0.5}, {1000, 0.2, 0.6}}};

/// Points in a flow inside an object, and their exact positions after kTime.
struct Setting {
    std::string name;
    Flow flow;
    Points start, end;
    double size; ///< The longest edge of the object's bounding box.
};

AdvectOptions accurate(double accuracy, std::optional<Scheme> scheme = {}) {
    return {.time = kTime, .scheme = scheme, .accuracy = accuracy};
}
AdvectOptions equal(Scheme scheme, int steps) { return {.time = kTime, .steps = steps, .scheme = scheme}; }

Points moved(const Setting& setting, const AdvectOptions& options, AdvectResult& result) {
    Points points = setting.start;
    result = advect(setting.flow, points, options);
    return points;
}

/// A method of advection and its results.
struct Way {
    std::string name;
    AdvectOptions options;
    AdvectResult result = {};
    Apart off = {};
    std::vector<double> seconds = {};

    double time() const { return percentiles(seconds, 0.5, 0.5).lower; }
    /// Returns the evaluations of the flow per point: the stages of each step (including one at its end), one after
    /// each correction, and those at the beginning and the end.
    double evaluations() const {
        const auto tried = static_cast<double>(result.substeps + result.retries + result.stalled);
        const double stages = tableauOf(options.usedScheme()).stages;
        return tried * (stages + result.meanIterations) / static_cast<double>(result.points) + 2;
    }
};

std::string rk4(int steps) { return fmt::format("RK4, {} steps", steps); }

std::vector<Way> ways() {
    std::vector<Way> all;
    for (const int steps : {10, 100})
        all.push_back({fmt::format("Euler, {} steps", steps), equal(Scheme::euler, steps)});
    for (const int steps : {10, 20, 50, 100, 200, 1000}) all.push_back({rk4(steps), equal(Scheme::rk4, steps)});
    for (const double accuracy : {1e-2, 3e-3, 1e-3, 1e-4, 1e-5})
        all.push_back({fmt::format("rk23, {:.0e}", accuracy), accurate(accuracy, Scheme::bogackiShampine)});
    for (const double accuracy : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8})
        all.push_back({fmt::format("rk45, {:.0e}", accuracy), accurate(accuracy, Scheme::dormandPrince)});
    all.push_back({"the default", {.time = kTime}});
    return all;
}

void measure(const Setting& setting, std::vector<Way>& all, int rounds) {
    const ThreadLimit limit(1);
    for (int round = 0; round < rounds; ++round) // interleaved, so that other load affects all methods
        for (Way& way : all) {
            const auto begin = std::chrono::steady_clock::now();
            const Points points = moved(setting, way.options, way.result);
            way.seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
            way.off = apart(points, setting.end);
        }
}

const Way& named(const std::vector<Way>& all, std::string_view name) {
    return *std::find_if(all.begin(), all.end(), [&](const Way& way) { return way.name == name; });
}

/// The lowest cost at which an adaptive scheme reaches a mean error, by power laws between its accuracies; infinite if
/// no scheme reaches it.
struct Cheapest {
    double cost = std::numeric_limits<double>::infinity();
    Scheme scheme = Scheme::dormandPrince;
};
Cheapest cheapest(const std::vector<Way>& all, double error, const std::function<double(const Way&)>& costOf) {
    Cheapest best;
    for (const Scheme scheme : {Scheme::bogackiShampine, Scheme::dormandPrince}) {
        const Way* coarser = nullptr;
        for (const Way& way : all) {
            if (way.options.scheme != scheme || !way.options.adaptive()) continue;
            if (coarser && coarser->off.mean >= error && way.off.mean <= error) {
                const double part = std::log(coarser->off.mean / error) / std::log(coarser->off.mean / way.off.mean);
                const double cost = costOf(*coarser) * std::pow(costOf(way) / costOf(*coarser), part);
                if (cost < best.cost) best = {cost, scheme};
            }
            coarser = &way;
        }
    }
    return best;
}

void writeBars(const Setting& setting, const std::vector<Way>& all, bool judged, std::ostream& out,
               std::vector<std::string>& broken) {
    for (const Bar& bar : kBars) {
        const Way& like = named(all, rk4(bar.steps));
        const Cheapest work = cheapest(all, like.off.mean, [](const Way& way) { return way.evaluations(); });
        const Cheapest time = cheapest(all, like.off.mean, [](const Way& way) { return way.time(); });
        const double share = work.cost / like.evaluations();
        out << fmt::format(
            "\nAt the mean error of {}: {:.2f} of its evaluations and {:.2f} of its time, by {} (target: {}).\n",
            like.name, share, time.cost / like.time(), kSchemeNames.at(static_cast<size_t>(work.scheme)), bar.aim);
        if (judged && !(share <= bar.claim))
            broken.push_back(
                fmt::format("{}: {:.2f} of the evaluations of {}, not {}", setting.name, share, like.name, bar.claim));
    }
}

void writeVolumes(const Setting& setting, std::ostream& out, std::vector<std::string>& broken) {
    std::vector<Vec3d> positions;
    const size_t count = std::clamp<size_t>(setting.start.size() / 100, 20, 200);
    for (size_t k = 0; k < count; ++k) positions.push_back(setting.start.position(k * setting.start.size() / count));
    const VolumeChange change = volumeChange(FlowInTime(setting.flow), positions, 0, {.time = kTime});
    out << fmt::format(
        "\nVolumes: the determinant of the flow map's Jacobian (variational equation) deviates from 1 by at most "
        "{:.1e}, at {} points.\n",
        change.farthest, change.samples);
    if (!(change.farthest <= kVolumeBar))
        broken.push_back(fmt::format("{}: volumes change by {:.1e}", setting.name, change.farthest));
}

/// Advects the points in several frames with the default accuracy, and returns the result.
Points inFrames(const Setting& setting, int calls) {
    Points points = setting.start;
    for (int k = 0; k < calls; ++k) advect(setting.flow, points, {.time = kTime / calls});
    return points;
}

/// Rounds of measurement: times of few points tell nothing.
int roundsOf(bool judged) { return judged ? 3 : 1; }

/// Writes the table of one setting. `judged`: whether there are enough points to judge the costs.
void write(const Setting& setting, bool judged, std::ostream& out, std::vector<std::string>& broken) {
    std::vector<Way> all = ways();
    measure(setting, all, roundsOf(judged));
    out << fmt::format(
        "\n### {}\n\n| | mean | max | estimated mean | estimated max | steps | redone | evaluations | µs per point | "
        "outside |\n|---|---|---|---|---|---|---|---|---|---|\n",
        setting.name);
    const auto count = static_cast<double>(setting.start.size());
    for (const Way& way : all) {
        const AdvectResult& r = way.result;
        const auto estimate = [](double error) { return error > 0 ? fmt::format("{:.1e}", error) : ""; };
        out << fmt::format("| {} | {:.1e} | {:.1e} | {} | {} | {:.1f} | {:.2f} | {:.0f} | {:.1f} | {} |\n", way.name,
                           way.off.mean, way.off.most, estimate(r.errorMean), estimate(r.errorMax),
                           static_cast<double>(r.substeps) / count, static_cast<double>(r.retries) / count,
                           way.evaluations(), way.time() / count * 1e6, r.outside);
        if (r.outside > 0) broken.push_back(fmt::format("{}, {}: points are outside", setting.name, way.name));
    }
    writeBars(setting, all, judged, out, broken);
    writeVolumes(setting, out, broken);
    const Way& standard = named(all, "the default");
    if (!(standard.off.mean <= kMeanBar * setting.size) || !(standard.off.most <= kMaxBar * setting.size))
        broken.push_back(fmt::format("{}: the default has a mean error of {:.1e} and a maximum error of {:.1e}",
                                     setting.name, standard.off.mean, standard.off.most));
    out << "\nThe default, divided into frames and substeps:\n\n| | mean | max |\n|---|---|---|\n";
    for (const auto& [fps, substeps] : {std::pair(24, 1), {24, 4}, {48, 1}, {48, 4}}) {
        if (!judged && fps > 24) break;
        const Apart off = apart(inFrames(setting, static_cast<int>(kTime) * fps * substeps), setting.end);
        out << fmt::format("| {} frames per second, {} substeps | {:.1e} | {:.1e} |\n", fps, substeps, off.mean,
                           off.most);
        if (!(off.mean <= kMeanBar * setting.size) || !(off.most <= kMaxBar * setting.size))
            broken.push_back(
                fmt::format("{}: {} fps, {} substeps has a mean error of {:.1e} and a maximum error of {:.1e}",
                            setting.name, fps, substeps, off.mean, off.most));
    }
}

Setting settingOf(std::string name, const Sdf& sdf, size_t count, std::ostream& out) {
    const Flow flow = containedFlow(sdf);
    Setting setting{std::move(name), flow, scatter(flow.domain(), count, 7), {}, 0};
    for (int axis = 0; axis < 3; ++axis) setting.size = std::max(setting.size, sdf.bounds.size()[axis]);
    AdvectResult result;
    AdvectOptions reference = equal(Scheme::dormandPrince, 4000);
    reference.reprojection.tolerance = 1e-12;
    setting.end = moved(setting, reference, result);
    const Apart off = apart(moved(setting, accurate(1e-10), result), setting.end);
    out << fmt::format("- {}: the reference and rk45 at 1e-10 differ by {:.1e} on average, {:.1e} at most\n",
                       setting.name, off.mean, off.most);
    return setting;
}

} // namespace

std::vector<std::string> timeTable(const TableRun& run, std::ostream& out) {
    const auto count = std::max<size_t>(64, static_cast<size_t>(20000 * run.scale));
    const bool judged = run.scale >= 0.1;
    out << fmt::format(
        "## Position errors\n\n{} points move for {} s in the flow of the guide's main example. Errors are distances, "
        "in world units, from the result of 4000 steps of rk45. Evaluations of the flow are per point and do not "
        "depend on the machine. Times are on one thread, the median of {} rounds.\n\n",
        count, kTime, roundsOf(judged));
    std::vector<std::string> broken;
    std::vector<Setting> settings;
    settings.push_back(settingOf("unit sphere", sphereSdf(1), count, out));
    settings.push_back(settingOf("spot", spotSdf(), count, out));
    for (const Setting& setting : settings) write(setting, judged, out, broken);
    return broken;
}

} // namespace curlew::paper
