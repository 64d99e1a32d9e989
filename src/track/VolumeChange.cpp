// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/VolumeChange.h"

#include "AdvectSteps.h"
#include "StepControl.h"
#include "curlew/base/Parallel.h"
#include "curlew/track/AdvectParts.h"
#include "curlew/track/WallMotion.h"

#include <algorithm>

namespace curlew {

namespace {

/// Maximum error per step: of the position, relative to the diagonal of the domain's box, and of the determinant.
constexpr double kAccuracy = 1e-9;

double determinant(const Matrix3& m) { return dot(m[0], cross(m[1], m[2])); }

Matrix3 zero() {
    Matrix3 m;
    for (Vec3d& row : m.rows) row = {};
    return m;
}

void add(Matrix3& sum, const Matrix3& m, double factor) {
    for (int i = 0; i < 3; ++i) sum[i] += m[i] * factor;
}

/// The current position of a sample, and the determinant so far.
struct Sample {
    Vec3d position;
    double determinant = 1;
    bool moves = true;
};

/// One step of a position and of M, which starts as the identity in every step. The determinants of the steps are
/// multiplied, because the determinant of an M over a long time would be lost in rounding as the flow stretches it.
class VariationalStep {
  public:
    VariationalStep(const Flow& flow, const Tableau& tableau) : mFlow(flow), mTableau(tableau) {}

    void begin(const Vec3d& position) {
        mFirst = mFlow.at(position);
        mFrom = position;
    }
    /// Takes a step. Call `begin` or `accept` before.
    void tryStep(double dt) {
        mVelocity[0] = mFirst.velocity;
        mGrowth[0] = mFirst.derivative;
        for (int s = 1; s <= mTableau.stages; ++s) {
            const Tableau::Row& row = mTableau.rows[static_cast<size_t>(s)];
            mEnd = mFrom;
            mM = Matrix3{};
            for (size_t j = 0; j < static_cast<size_t>(s); ++j) {
                mEnd += mVelocity[j] * (row.factor * dt * row.weights[j]);
                add(mM, mGrowth[j], row.factor * dt * row.weights[j]);
            }
            mLast = mFlow.at(mEnd);
            mVelocity[static_cast<size_t>(s)] = mLast.velocity;
            mGrowth[static_cast<size_t>(s)] = mLast.derivative * mM;
        }
        Vec3d off;
        Matrix3 offM = zero();
        for (size_t s = 0; s <= static_cast<size_t>(mTableau.stages); ++s) {
            off += mVelocity[s] * (dt * mTableau.error[s]);
            add(offM, mGrowth[s], dt * mTableau.error[s]);
        }
        mError = length(off);
        // Error of the determinant to first order, because M is near the identity.
        mDeterminantError = std::abs(offM[0][0] + offM[1][1] + offM[2][2]);
    }
    void accept() {
        mFirst = mLast;
        mFrom = mEnd;
    }

    const Vec3d& end() const { return mEnd; }
    double determinantOfM() const { return determinant(mM); }
    /// Returns the error relative to the allowed one, for a domain of this diagonal.
    double error(double diagonal) const { return std::max(mError / diagonal, mDeterminantError) / kAccuracy; }

  private:
    const Flow& mFlow;
    const Tableau& mTableau;
    FlowSample mFirst, mLast;
    Vec3d mFrom, mEnd;
    Matrix3 mM;
    std::array<Vec3d, Tableau::kMaxStages> mVelocity;
    std::array<Matrix3, Tableau::kMaxStages> mGrowth;
    double mError = 0, mDeterminantError = 0;
};

/// Follows a sample through a steady flow.
void follow(const Flow& flow, double time, double firstStep, double diagonal, Sample& sample, const Monitor& monitor) {
    const Tableau& tableau = tableauOf(Scheme::dormandPrince);
    const detail::StepControl control(tableau.errorOrder);
    VariationalStep step(flow, tableau);
    step.begin(sample.position);
    const double shortest = std::abs(time) * 1e-9;
    double left = std::abs(time), length = std::min(firstStep, left);
    while (left > 0) {
        monitor.check();
        const double dt = std::min(length, left);
        step.tryStep(time < 0 ? -dt : dt);
        const double error = step.error(diagonal);
        length = dt * control.factor(error);
        if (!(error <= 1) && dt > shortest) continue;
        if (!std::isfinite(error)) {
            sample.moves = false;
            return;
        }
        step.accept();
        sample.position = step.end();
        sample.determinant *= step.determinantOfM();
        left = dt >= left ? 0 : left - dt;
    }
}

/// Applies the motion of a wall, with its Jacobian by central differences.
void followWall(const Flow& from, const Flow& to, double seconds, std::vector<Sample>& samples,
                const Monitor& monitor) {
    if (!from.domain().wall || !to.domain().wall) return;
    const WallMotion motion(*from.domain().wall, *to.domain().wall, from.domain().box, seconds);
    if (motion.still()) return;
    const double h = 1e-4 * from.domain().wall->width;
    std::vector<Vec3d> points;
    for (const Sample& sample : samples) {
        points.push_back(sample.position);
        for (int axis = 0; axis < 3; ++axis)
            for (const double side : {h, -h}) {
                points.push_back(sample.position);
                points.back()[axis] += side;
            }
    }
    motion.carry(points, monitor);
    for (size_t k = 0; k < samples.size(); ++k) {
        const Vec3d* p = &points[7 * k];
        samples[k].position = p[0];
        samples[k].determinant *= dot(p[1] - p[2], cross(p[3] - p[4], p[5] - p[6])) / (8 * h * h * h);
    }
}

std::vector<Sample> samplesAt(const std::vector<Vec3d>& positions, const Flow& flow) {
    std::vector<Sample> samples;
    for (const Vec3d& p : positions) {
        PointBatch points;
        points.push(p);
        std::array<bool, kBatch> allowed;
        std::array<double, kBatch> distance;
        classify(flow.domain(), points, allowed, distance);
        if (allowed[0] && std::isfinite(dot(p, p))) samples.push_back({.position = p});
    }
    return samples;
}

VolumeChange summary(const std::vector<Sample>& samples) {
    std::vector<double> determinants;
    VolumeChange change;
    for (const Sample& sample : samples) {
        if (!sample.moves) continue;
        determinants.push_back(sample.determinant);
        change.farthest = std::max(change.farthest, std::abs(sample.determinant - 1));
    }
    if (determinants.empty()) return {};
    std::sort(determinants.begin(), determinants.end());
    const size_t last = determinants.size() - 1;
    change.samples = determinants.size();
    change.median = determinants[last / 2];
    change.lower = determinants[last / 20];
    change.upper = determinants[last - last / 20];
    return change;
}

} // namespace

VolumeChange volumeChange(const FlowInTime& flow, const std::vector<Vec3d>& positions, double begin,
                          const AdvectOptions& options, const Monitor& monitor) {
    if (!std::isfinite(begin) || !std::isfinite(options.time)) throw ValueError("the times must be finite");
    Flow before = flow.at(begin);
    const double accuracy = kAccuracy / kDefaultAccuracy * defaultAccuracy(before.domain());
    const double diagonal = accuracy / kAccuracy;
    std::vector<Sample> samples = samplesAt(positions, before);
    const int count = flow.steady() ? 1 : options.steps > 0 ? options.steps : kMoments;
    const double time = options.time / count;
    for (int k = 0; k < count && time != 0; ++k) {
        const Flow middle = flow.at(begin + time * (k + 0.5)), after = flow.at(begin + time * (k + 1));
        const double first = firstStep(middle, Scheme::dormandPrince, accuracy);
        followWall(before, middle, time / 2, samples, monitor);
        parallelFor(
            samples.size(), 1,
            [&](size_t from, size_t to) {
                for (size_t n = from; n < to; ++n)
                    if (samples[n].moves) follow(middle, time, first, diagonal, samples[n], monitor);
            },
            monitor.quiet());
        followWall(middle, after, time / 2, samples, monitor);
        before = after;
        if (monitor.report) monitor.report((k + 1.0) / count);
    }
    return summary(samples);
}

} // namespace curlew
