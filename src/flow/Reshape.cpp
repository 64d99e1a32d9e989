// SPDX-License-Identifier: Apache-2.0
#include "curlew/flow/Reshape.h"

#include "Samples.h"
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/math/Fade.h"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>

namespace curlew {

namespace {

constexpr int kBins = 96; // per axis, f and g
constexpr int kDegree = 3;
constexpr int kCoefficients = kBins + kDegree;

/// Evaluates the uniform B-splines of one degree that are nonzero on an interval of length 1, at t in [0, 1] on it (de
/// Boor's recursion), or a derivative of them: differences of the B-splines of a lower degree.
template <int Degree>
std::array<double, Degree + 1> basis(double t, int derivative) {
    std::array<double, Degree + 1> b{1};
    for (int d = 1; d <= Degree - derivative; ++d)
        for (int j = d; j >= 0; --j) {
            const auto k = static_cast<size_t>(j);
            b[k] = ((j > 0 ? (t + d - j) * b[k - 1] : 0) + (j < d ? (j + 1 - t) * b[k] : 0)) / d;
        }
    for (int d = Degree - derivative + 1; d <= Degree; ++d)
        for (int j = d; j >= 0; --j) {
            const auto k = static_cast<size_t>(j);
            b[k] = (j > 0 ? b[k - 1] : 0) - (j < d ? b[k] : 0);
        }
    return b;
}

/// Equal bins over the values of a potential.
struct Axis {
    double lower, width;
    int binOf(double value) const {
        return static_cast<int>(std::clamp((value - lower) / width, 0.0, double(kBins - 1)));
    }
};

/// ∫ h df for a bicubic spline h over f and g. It is quartic in f; its coefficients are running sums of those of h.
/// Beyond the bins h continues with its values at the edge.
struct IntegratedSpline {
    Axis f, g;
    std::vector<double> h, sums; // [f][g], kCoefficients of each; sums of h along f

    /// Returns the place of a value on the bins: its bin, which is the first coefficient that contributes, and the
    /// fraction within the bin.
    static std::pair<int, double> place(const Axis& axis, double value) {
        const double u = std::clamp((value - axis.lower) / axis.width, -1e6, 1e6);
        if (std::isnan(u)) return {0, u};
        const double bin = std::floor(u);
        return {static_cast<int>(bin), u - bin};
    }
    static size_t index(int i, int j) {
        return static_cast<size_t>(i) * kCoefficients + static_cast<size_t>(std::clamp(j, 0, kCoefficients - 1));
    }
    double sum(int i, int j) const {
        if (i < 0) return (i + 1) * h[index(0, j)];
        if (i >= kCoefficients)
            return sums[index(kCoefficients - 1, j)] + (i - kCoefficients + 1) * h[index(kCoefficients - 1, j)];
        return sums[index(i, j)];
    }

    /// Returns the jet of the integral in the variables f and g.
    template <int Order>
    Jet<double, 2, Order> at(double valueF, double valueG) const {
        const auto [i, s] = place(f, valueF);
        const auto [j, t] = place(g, valueG);
        const auto derivative = [&, i = i, j = j, s = s, t = t](int df, int dg) {
            const auto bf = basis<kDegree + 1>(s, df);
            const auto bg = basis<kDegree>(t, dg);
            double value = 0;
            for (int a = 0; a <= kDegree + 1; ++a)
                for (int b = 0; b <= kDegree; ++b)
                    value += bf[static_cast<size_t>(a)] * bg[static_cast<size_t>(b)] * sum(i + a - 1, j + b);
            return value * std::pow(f.width, 1 - df) * std::pow(g.width, -dg);
        };
        Jet<double, 2, Order> jet(derivative(0, 0));
        if constexpr (Order >= 1) jet.gradient = {{derivative(1, 0), derivative(0, 1)}};
        if constexpr (Order >= 2) jet.hessian.c = {derivative(2, 0), derivative(0, 2), derivative(1, 1)};
        if constexpr (Order >= 3)
            jet.third.c = {derivative(3, 0), derivative(2, 1), derivative(1, 2), derivative(0, 3)};
        return jet;
    }
};

struct Reshaped {
    static constexpr std::string_view kNotSymbolic = "a reshaped potential";
    ScalarField f, g;
    std::shared_ptr<const IntegratedSpline> integral;
    template <int Order, class T>
    void evalBatch(const PointBatch& points, JetBatch<T, Order>& jets) const {
        JetBatch<T, Order> other;
        f.eval(points, jets);
        g.eval(points, other);
        for (int i = 0; i < points.size; ++i) {
            const auto jf = jets[i], jg = other[i];
            const auto exact = integral->at<Order>(static_cast<double>(jf.value), static_cast<double>(jg.value));
            Jet<T, 2, Order> outer;
            for (int k = 0; k < outer.kSize; ++k) outer.component(k) = static_cast<T>(exact.component(k));
            jets.set(i, compose(outer, Vec<Jet<T, 3, Order>, 2>{{jf, jg}}));
        }
    }
};

/// A position and the speed of the flow there.
struct Visit {
    double speed = 0;
    Vec3d position{};

    /// Does not depend on the order of the visits, even if two are equally fast.
    bool fasterThan(const Visit& other) const {
        return speed != other.speed ? speed > other.speed : position.c < other.position.c;
    }
};

/// The fastest position that was visited in each bin of (f, g), and the bins of f and g.
struct Survey {
    Axis f{}, g{};
    std::vector<Visit> fastest = std::vector<Visit>(size_t{kBins} * kBins);

    void note(double valueF, double valueG, const Visit& visit) {
        Visit& most = fastest[static_cast<size_t>(f.binOf(valueF)) * kBins + static_cast<size_t>(g.binOf(valueG))];
        if (visit.fasterThan(most)) most = visit;
    }
};

constexpr size_t kSamples = size_t{1} << 20, kReshapeGrain = 1 << 14;

/// Climbs from the fastest sample of each bin towards a local maximum of the speed, in turn along the track and along
/// each axis, and notes all speeds on the way, in the bins where they are.
void climb(const Flow& flow, Survey& survey, const Monitor& monitor) {
    constexpr size_t kDirections = 4, kRounds = 12; // of all directions
    const double firstStep = 0.005 * length(flow.domain().box.size());
    const std::vector<Visit> samples = survey.fastest;
    std::mutex merging;
    parallelFor(
        samples.size(), kBatch,
        [&](size_t begin, size_t end) {
            std::vector<Visit> at;
            for (size_t k = begin; k < end; ++k)
                if (samples[k].speed > 0) at.push_back(samples[k]);
            if (at.empty()) return;
            std::array<std::array<double, kDirections>, kBatch> steps;
            for (auto& all : steps) all.fill(firstStep);
            std::array<Vec3d, kBatch> along{}; // unit vectors; 0 in the first step, which visits the samples again
            for (size_t round = 0; round < kDirections * kRounds; ++round) {
                const size_t direction = round % kDirections;
                PointBatch points;
                for (size_t k = 0; k < at.size(); ++k) {
                    Vec3d step = along[k];
                    if (direction > 0) step = {}, step[static_cast<int>(direction) - 1] = 1;
                    points.push(at[k].position + step * steps[k][direction]);
                }
                std::array<bool, kBatch> allowed;
                std::array<double, kBatch> distance;
                classify(flow.domain(), points, allowed, distance);
                Flow::Jets<double> potentials;
                VecBatch<double> c;
                flow.eval(points, potentials, c);
                const std::lock_guard lock(merging);
                for (size_t k = 0; k < at.size(); ++k) {
                    const int i = static_cast<int>(k);
                    const Visit there{length(c[i]), points[i]};
                    const bool valid = allowed[k] && flow.domain().box.contains(there.position);
                    if (valid) survey.note(potentials[0][i].value, potentials[1][i].value, there);
                    const bool better = valid && there.speed > at[k].speed;
                    if (better) at[k] = there;
                    if (better || round == 0) along[k] = c[i] * (1 / std::max(there.speed, 1e-300));
                    steps[k][direction] *= better ? 1.5 : -0.5;
                }
            }
        },
        monitor);
}

Survey surveyOf(const Flow& flow, const Monitor& monitor) {
    // Visits the same samples twice, first for the ranges and then for the speeds. Maxima do not depend on the order.
    std::array<Interval, 2> ranges;
    ranges.fill({std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()});
    Survey survey;
    std::mutex merging;
    const auto visit = [&](const auto& use) {
        parallelFor(
            kSamples, kReshapeGrain,
            [&](size_t begin, size_t end) {
                visitSamples(flow.domain(), begin, end, [&](const PointBatch& points) {
                    Flow::Jets<double> potentials;
                    VecBatch<double> c;
                    flow.eval(points, potentials, c);
                    const std::lock_guard lock(merging);
                    for (int i = 0; i < points.size; ++i)
                        use(potentials[0][i].value, potentials[1][i].value, Visit{length(c[i]), points[i]});
                });
            },
            monitor);
    };
    visit([&](double f, double g, const Visit&) {
        ranges[0] = {std::min(ranges[0].lower, f), std::max(ranges[0].upper, f)};
        ranges[1] = {std::min(ranges[1].lower, g), std::max(ranges[1].upper, g)};
    });
    if (ranges[0].lower > ranges[0].upper)
        throw ValueError("the domain of the flow is empty: no point of its box lies on the flow's side of the wall");
    for (const Interval& r : ranges)
        if (!(r.upper > r.lower)) throw ValueError("the flow has no streamlines to slow down: a potential is constant");
    survey.f = {ranges[0].lower, (ranges[0].upper - ranges[0].lower) / kBins};
    survey.g = {ranges[1].lower, (ranges[1].upper - ranges[1].lower) / kBins};
    visit([&](double f, double g, const Visit& at) { survey.note(f, g, at); });
    climb(flow, survey, monitor);
    return survey;
}

/// Returns the fade of an interval: 1 in its middle and 0 at its ends. It fades over the fraction `softness` of its
/// length; an infinite end is replaced by the limit of the occurring values. Returns the minimum over one bin, which is
/// at an end of the bin, because the fade rises and falls only once.
double window(const Interval& interval, double softness, const Axis& axis, int bin) {
    const double last = axis.lower + kBins * axis.width;
    const double ramp = softness * ((std::isfinite(interval.upper) ? interval.upper : last) -
                                    (std::isfinite(interval.lower) ? interval.lower : axis.lower));
    const auto at = [&](double value) {
        double w = interval.contains(value) ? 1 : 0;
        if (std::isfinite(interval.lower) && ramp > 0) w *= quinticFade((value - interval.lower) / ramp).value;
        if (std::isfinite(interval.upper) && ramp > 0) w *= quinticFade((interval.upper - value) / ramp).value;
        return w;
    };
    return std::min(at(axis.lower + bin * axis.width), at(axis.lower + (bin + 1) * axis.width));
}

} // namespace

Flow reshaped(const Flow& flow, const ReshapeOptions& options, const Monitor& monitor) {
    if (!flow.hasTracks() || !flow.divergenceFree())
        throw ValueError(
            "only a divergence-free flow of two potentials f and g can be reshaped: no sum, no normalised flow, and "
            "none that preserves area on level sets");
    if (!(options.limit >= 0) || !std::isfinite(options.limit))
        throw ValueError(fmt::format("limit {} must not be negative", options.limit));
    if (!(options.softness >= 0) || options.softness > 0.5)
        throw ValueError(fmt::format("softness {} must lie between 0 and 0.5", options.softness));
    for (const Interval& r : {options.f, options.g})
        if (!(r.lower < r.upper)) throw ValueError("an interval of f or g is empty");
    if (!flow.domain().box.finite()) throw ValueError("the domain of the flow is infinite; give it a box");

    const Survey survey = surveyOf(flow, monitor);
    auto spline = std::make_shared<IntegratedSpline>();
    spline->f = survey.f;
    spline->g = survey.g;
    spline->h.assign(size_t{kCoefficients} * kCoefficients, 1);
    // A spline lies between its nearby coefficients, so each coefficient is the minimum of what its bins allow.
    for (int i = 0; i < kBins; ++i)
        for (int j = 0; j < kBins; ++j) {
            const double fastest = survey.fastest[static_cast<size_t>(i) * kBins + static_cast<size_t>(j)].speed;
            const double slow = options.limit > 0 && fastest > options.limit ? options.limit / fastest : 1;
            const double allowed = slow * window(options.f, options.softness, survey.f, i) *
                                   window(options.g, options.softness, survey.g, j);
            for (int a = 0; a <= kDegree; ++a)
                for (int b = 0; b <= kDegree; ++b) {
                    double& c = spline->h[IntegratedSpline::index(i + a, j + b)];
                    c = std::min(c, allowed);
                }
        }
    if (*std::max_element(spline->h.begin(), spline->h.end()) == 0)
        throw ValueError(
            "nothing would move: no streamline has f and g within the intervals, or the intervals are narrower than "
            "1/20 of the range of f and g");
    spline->sums = spline->h;
    for (size_t k = kCoefficients; k < spline->sums.size(); ++k) spline->sums[k] += spline->sums[k - kCoefficients];
    return Flow(ScalarField(Reshaped{flow.f(), flow.g(), spline}), flow.g(), flow.domain());
}

} // namespace curlew
