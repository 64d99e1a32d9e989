#include "Contained.h"
#include "Tables.h"
#include "curlew/base/Parallel.h"
#include "curlew/math/Percentile.h"

#include <fmt/format.h>

#include <chrono>
#include <limits>
#include <optional>

namespace curlew::paper {

namespace {

constexpr double kTime = 2;
constexpr int kRounds = 3;
constexpr double kMeanBar = 1e-4, kMaxBar = 1e-2; ///< Of the defaults, relative to the object's size.

/// Points in a flow that an object contains, and where they should be after kTime.
struct Setting {
    std::string name;
    Flow flow;
    Points start, end;
    double size; ///< The longest edge of the object's box.
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

/// A way to get there, and what it comes to.
struct Way {
    std::string name;
    AdvectOptions options;
    AdvectResult result = {};
    Apart off = {};
    std::vector<double> seconds = {};

    double time() const { return percentiles(seconds, 0.5, 0.5).lower; }
};

std::vector<Way> ways() {
    std::vector<Way> all;
    for (const Scheme scheme : {Scheme::euler, Scheme::rk4})
        for (const int steps : {10, 100, 200, 1000})
            all.push_back(
                {fmt::format("{}, {} steps", scheme == Scheme::euler ? "Euler" : "RK4", steps), equal(scheme, steps)});
    for (const double accuracy : {1e-4, 1e-5, 1e-6})
        all.push_back({fmt::format("rk23, {:.0e}", accuracy), accurate(accuracy, Scheme::bogackiShampine)});
    for (const double accuracy : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7})
        all.push_back({fmt::format("rk45, {:.0e}", accuracy), accurate(accuracy)});
    all.push_back({"the default", {.time = kTime}});
    return all;
}

void measure(const Setting& setting, std::vector<Way>& all) {
    const ThreadLimit limit(1);
    for (int round = 0; round < kRounds; ++round) // in turn: what else the machine does falls on all
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

/// The least time of an accurate way that is as good as `like`.
double bestTime(const std::vector<Way>& all, const Way& like) {
    double best = std::numeric_limits<double>::infinity();
    for (const Way& way : all)
        if (way.options.adaptive() && way.off.mean <= like.off.mean && way.off.most <= like.off.most)
            best = std::min(best, way.time());
    return best;
}

/// The same time in frames, with the default accuracy: where the points are then.
Points inFrames(const Setting& setting, int calls) {
    Points points = setting.start;
    for (int k = 0; k < calls; ++k) advect(setting.flow, points, {.time = kTime / calls});
    return points;
}

/// Writes the table of one setting. `timed`: there are enough points for times to be judged.
void write(const Setting& setting, bool timed, std::ostream& out, std::vector<std::string>& broken) {
    std::vector<Way> all = ways();
    measure(setting, all);
    out << fmt::format(
        "\n### {}\n\n| | mean | largest | estimated: mean | largest | steps each | redone | corrections | "
        "µs a point | outside |\n|---|---|---|---|---|---|---|---|---|---|\n",
        setting.name);
    const auto count = static_cast<double>(setting.start.size());
    for (const Way& way : all) {
        const AdvectResult& r = way.result;
        const auto estimate = [](double error) { return error > 0 ? fmt::format("{:.1e}", error) : ""; };
        out << fmt::format("| {} | {:.1e} | {:.1e} | {} | {} | {:.1f} | {:.2f} | {:.2f} | {:.1f} | {} |\n", way.name,
                           way.off.mean, way.off.most, estimate(r.errorMean), estimate(r.errorMax),
                           static_cast<double>(r.substeps) / count, static_cast<double>(r.retries) / count,
                           r.meanIterations, way.time() / count * 1e6, r.outside);
        if (r.outside > 0) broken.push_back(fmt::format("{}, {}: points are outside", setting.name, way.name));
    }
    for (const auto& [like, bar] : {std::pair("RK4, 100 steps", 0.5), {"RK4, 1000 steps", 0.2}}) {
        const Way& way = named(all, like);
        const double ratio = bestTime(all, way) / way.time();
        out << fmt::format("\nAs accurate as {}: {:.2f} of its time (bar: {}).\n", like, ratio, bar);
        if (timed && !(ratio <= bar))
            broken.push_back(fmt::format("{}: {:.2f} of the time of {}, not {}", setting.name, ratio, like, bar));
    }
    const Way& standard = named(all, "the default");
    if (!(standard.off.mean <= kMeanBar * setting.size) || !(standard.off.most <= kMaxBar * setting.size))
        broken.push_back(fmt::format("{}: the default is off by {:.1e}, {:.1e} at most", setting.name,
                                     standard.off.mean, standard.off.most));
    out << "\nThe default in parts, as frames and substeps have it:\n\n| | mean | largest |\n|---|---|---|\n";
    for (const auto& [fps, substeps] : {std::pair(24, 1), {24, 4}, {48, 1}, {48, 4}}) {
        const Apart off = apart(inFrames(setting, static_cast<int>(kTime) * fps * substeps), setting.end);
        out << fmt::format("| {} frames a second, {} substeps | {:.1e} | {:.1e} |\n", fps, substeps, off.mean,
                           off.most);
        if (!(off.mean <= kMeanBar * setting.size) || !(off.most <= kMaxBar * setting.size))
            broken.push_back(fmt::format("{}: {} fps, {} substeps is off by {:.1e}, {:.1e} at most", setting.name, fps,
                                         substeps, off.mean, off.most));
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
    out << fmt::format(
        "## Where points should be\n\n{} points move for {} s with the flow of the guide's main job. "
        "Distances, in world units, from where 4000 steps of rk45 lead; time on one thread, the median "
        "of {} rounds.\n\n",
        count, kTime, kRounds);
    std::vector<std::string> broken;
    std::vector<Setting> settings;
    settings.push_back(settingOf("unit sphere", sphereSdf(1), count, out));
    settings.push_back(settingOf("spot", spotSdf(), count, out));
    for (const Setting& setting : settings) write(setting, run.scale == 1, out, broken);
    return broken;
}

} // namespace curlew::paper
