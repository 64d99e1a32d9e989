// SPDX-License-Identifier: Apache-2.0
#include "curlew/flow/Flow.h"

#include "CrossKernel.h"
#include "Samples.h"
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/Dimensions.h"
#include "curlew/flow/FlowScale.h"

#include <fmt/format.h>

#include <mutex>
#include <optional>
#include <utility>

namespace curlew {

namespace {

constexpr double kMostSpeed = 1e15; // beyond this, float velocities overflow where the flow is fastest

void requireSpeed(double speed) {
    if (!(speed > 0) || !(speed <= kMostSpeed))
        throw ValueError(fmt::format("speed {} must be positive and at most {}", speed, kMostSpeed));
}

/// Returns the gradient of a potential as jets, which include its derivatives.
template <int N>
Vec<Jet<double, N, 1>, N> gradientOf(const Jet<double, N, 2>& potential) {
    Vec<Jet<double, N, 1>, N> gradient;
    for (int i = 0; i < N; ++i) gradient[i] = partial(potential, i);
    return gradient;
}

} // namespace

template <int N>
struct FlowN<N>::Measured {
    std::mutex mutex; // of rms
    std::optional<FlowRmsN<N>> rms;
};

template <int N>
void FlowN<N>::changed() {
    mMeasured = std::make_shared<Measured>();
}

template <int N>
FlowN<N>::FlowN(std::vector<Potentials> terms, DomainN<N> domain)
    : mTerms(std::move(terms)), mDomain(std::move(domain)) {
    if (mTerms.empty()) throw ValueError("a flow needs potentials");
    changed();
}

template <int N>
FlowN<N> FlowN<N>::ofComponents(Components components, DomainN<N> domain) {
    FlowN flow;
    flow.mComponents.push_back(std::move(components));
    flow.mDomain = std::move(domain);
    flow.changed();
    return flow;
}

template <int N>
FlowN<N> FlowN<N>::within(DomainN<N> domain) const {
    FlowN flow = *this;
    flow.mDomain = std::move(domain);
    flow.changed();
    return flow;
}

template <int N>
FlowN<N> FlowN<N>::normalized(double speed) const {
    requireSpeed(speed);
    FlowN flow = *this;
    flow.mUniformSpeed = speed;
    flow.mOnLevelSets = false;
    flow.changed();
    return flow;
}

template <int N>
FlowN<N> FlowN<N>::onLevelSets() const {
    if (N < 3) throw ValueError("a flow on level sets needs at least 3 dimensions");
    if (!hasTracks() || mUniformSpeed > 0)
        throw ValueError("only a flow of one term follows level sets, neither a sum nor a normalised flow");
    FlowN flow = *this;
    flow.mOnLevelSets = true;
    flow.changed();
    return flow;
}

template <int N>
template <class T>
void FlowN<N>::eval(const PointBatchN<N>& points, Jets<T>& potentials, VecBatchN<T, N>& velocity) const {
    const auto evalPotential = [&](size_t t, size_t k, JetBatchN<T, N, 1>& jets) { mTerms[t][k].eval(points, jets); };
    evalWith(evalPotential, points, potentials, velocity);
}

template <int N>
std::function<void(const LatticeBatch&, VecBatchN<float, N>&)> FlowN<N>::onLattice(const PointLattice& lattice) const
    requires(N == 3) {
    if constexpr (N == 3) { // Clang 14 instantiates this for other N, too
        std::vector<std::array<OnLattice<float, 1>, kPotentials>> terms(mTerms.size());
        for (size_t t = 0; t < terms.size(); ++t)
            for (size_t k = 0; k < kPotentials; ++k) terms[t][k] = mTerms[t][k].template onLattice<float, 1>(lattice);
        return [this, terms = std::move(terms)](const LatticeBatch& batch, VecBatchN<float, N>& velocity) {
            const auto evalPotential = [&](size_t t, size_t k, JetBatchN<float, N, 1>& jets) {
                terms[t][k](batch, jets);
            };
            Jets<float> potentials;
            evalWith(evalPotential, batch.points(), potentials, velocity);
        };
    }
}

template <int N>
template <class T, class EvalPotential>
void FlowN<N>::evalWith(const EvalPotential& evalPotential, const PointBatchN<N>& points, Jets<T>& potentials,
                        VecBatchN<T, N>& velocity) const {
    const auto addTerm = [&](size_t t, Jets<T>& jets) {
        for (size_t k = 0; k < kPotentials; ++k) evalPotential(t, k, jets[k]);
        const bool first = t == 0;
        runKernel<CrossKernel<N>, T>(std::as_const(jets), points.size, first, velocity);
    };
    if (mTerms.empty()) {
        for (auto& jets : potentials)
            for (auto& values : jets.c) values.fill(0);
        for (auto& values : velocity.c) values.fill(0);
    } else {
        addTerm(0, potentials);
    }
    for (size_t t = 1; t < mTerms.size(); ++t) {
        Jets<T> jets;
        addTerm(t, jets);
    }
    for (const Components& components : mComponents)
        for (size_t axis = 0; axis < components.size(); ++axis) {
            JetBatchN<T, N, 0> values;
            components[axis].eval(points, values);
            for (size_t i = 0; i < static_cast<size_t>(points.size); ++i) velocity.c[axis][i] += values.c[0][i];
        }
    if (mUniformSpeed == 0 && !mOnLevelSets) return;
    // In double, the square of a float neither overflows nor vanishes.
    const auto doubles = [](const Vec<T, N>& v) {
        Vec<double, N> result;
        for (int axis = 0; axis < N; ++axis) result[axis] = static_cast<double>(v[axis]);
        return result;
    };
    for (int i = 0; i < points.size; ++i) {
        const Vec<double, N> c = doubles(velocity[i]);
        const double divisor = length(mOnLevelSets ? doubles(potentials.back()[i].gradient) : c);
        if (!(divisor > 0)) continue; // c is zero, too
        const double factor = (mOnLevelSets ? 1 : mUniformSpeed) / divisor;
        Vec<T, N> v;
        for (int axis = 0; axis < N; ++axis) v[axis] = static_cast<T>(c[axis] * factor);
        velocity.set(i, v);
    }
}

template <int N>
FlowSampleN<N> FlowN<N>::at(const Vec<double, N>& position) const {
    using J = Jet<double, N, 1>;
    FlowSampleN<N> sample;
    Vec<J, N> c, last; // the velocity, and the gradient of the first term's last potential
    for (size_t t = 0; t < mTerms.size(); ++t) {
        std::array<Vec<J, N>, kPotentials> gradients;
        for (size_t k = 0; k < kPotentials; ++k) {
            const auto jet = mTerms[t][k].template at<2>(position);
            gradients[k] = gradientOf(jet);
            if (t == 0) sample.potentials[k] = jet.value;
        }
        c += cross(gradients);
        if (t == 0) last = gradients.back();
    }
    for (const Components& components : mComponents)
        for (int axis = 0; axis < N; ++axis) c[axis] += components[static_cast<size_t>(axis)].template at<1>(position);
    if (mOnLevelSets)
        if (const J squared = dot(last, last); squared.value > 0) c *= reciprocal(sqrt(squared));
    if (mUniformSpeed > 0)
        if (const J squared = dot(c, c); squared.value > 0) c *= reciprocal(sqrt(squared)) * mUniformSpeed;
    for (int i = 0; i < N; ++i) {
        sample.velocity[i] = c[i].value;
        sample.derivative[i] = c[i].gradient;
    }
    return sample;
}

template <int N>
FlowN<N> operator+(const FlowN<N>& a, const FlowN<N>& b) {
    if (a.uniformSpeed() > 0 || b.uniformSpeed() > 0)
        throw ValueError("a normalised flow cannot be part of a sum; normalise the sum instead");
    if (a.preservesArea() || b.preservesArea())
        throw ValueError("a flow that preserves area on level sets cannot be part of a sum");
    FlowN<N> sum = a;
    sum.mTerms.insert(sum.mTerms.end(), b.mTerms.begin(), b.mTerms.end());
    sum.mComponents.insert(sum.mComponents.end(), b.mComponents.begin(), b.mComponents.end());
    sum.changed();
    return sum;
}

template <int N>
FlowN<N> scaled(const FlowN<N>& flow, double factor) {
    FlowN<N> result = flow;
    for (auto& term : result.mTerms) term[0] = factor * term[0];
    for (auto& components : result.mComponents)
        for (auto& component : components) component = factor * component;
    result.changed();
    return result;
}

namespace {

constexpr size_t kCandidates = size_t{1} << 15, kMostCandidates = size_t{1} << 24, kEnoughSamples = 4096;
constexpr size_t kGrain = 2048;

/// Sums of squares over samples.
template <int N>
struct Squares {
    double speed = 0;
    std::array<double, size_t{N - 1}> potentials{};

    void add(const typename FlowN<N>::template Jets<double>& jets, const VecBatchN<double, N>& velocity, int size) {
        for (int i = 0; i < size; ++i) {
            speed += dot(velocity[i], velocity[i]);
            for (size_t k = 0; k < potentials.size(); ++k) {
                const double value = jets[k][i].value;
                potentials[k] += value * value;
            }
        }
    }
    Squares& operator+=(const Squares& o) {
        speed += o.speed;
        for (size_t k = 0; k < potentials.size(); ++k) potentials[k] += o.potentials[k];
        return *this;
    }
    FlowRmsN<N> rms(double count) const {
        FlowRmsN<N> result;
        result.speed = std::sqrt(speed / count);
        for (size_t k = 0; k < potentials.size(); ++k) result.potentials[k] = std::sqrt(potentials[k] / count);
        return result;
    }
};

template <int N>
struct Sums {
    double count = 0;
    Squares<N> whole;
    std::vector<Squares<N>> parts; ///< See partsOf().

    Sums& operator+=(const Sums& o) {
        count += o.count;
        whole += o.whole;
        parts.resize(std::max(parts.size(), o.parts.size()));
        for (size_t k = 0; k < o.parts.size(); ++k) parts[k] += o.parts[k];
        return *this;
    }
};

/// Returns the flows that a sum is the sum of, its terms first. For a flow of one term, nothing.
template <int N>
std::vector<FlowN<N>> partsOf(const FlowN<N>& flow) {
    std::vector<FlowN<N>> parts;
    if (flow.hasTracks()) return parts;
    for (const auto& term : flow.terms()) parts.emplace_back(term, flow.domain());
    for (const auto& components : flow.components()) parts.push_back(FlowN<N>::ofComponents(components, flow.domain()));
    return parts;
}

template <int N>
Sums<N> sumOver(const FlowN<N>& flow, const std::vector<FlowN<N>>& parts, size_t begin, size_t end) {
    Sums<N> sums{.whole = {}, .parts = std::vector<Squares<N>>(parts.size())};
    visitSamples(flow.domain(), begin, end, [&](const PointBatchN<N>& points) {
        typename FlowN<N>::template Jets<double> jets, first;
        VecBatchN<double, N> velocity, sum;
        for (size_t k = 0; k < parts.size(); ++k) {
            parts[k].eval(points, k == 0 ? first : jets, velocity);
            sums.parts[k].add(k == 0 ? first : jets, velocity, points.size);
            for (size_t axis = 0; axis < sum.c.size(); ++axis)
                for (size_t i = 0; i < kBatch; ++i)
                    sum.c[axis][i] = velocity.c[axis][i] + (k == 0 ? 0 : sum.c[axis][i]);
        }
        if (parts.empty() || flow.uniformSpeed() > 0) flow.eval(points, first, sum);
        sums.count += points.size;
        sums.whole.add(first, sum, points.size);
    });
    return sums;
}

template <int N>
FlowRmsN<N> measuredRms(const FlowN<N>& flow, const Monitor& monitor) {
    if (!flow.domain().box.finite()) throw ValueError("the domain of the flow is infinite; give it a box");
    const std::vector<FlowN<N>> parts = partsOf(flow);
    Sums<N> total;
    // A thin domain needs more candidates.
    for (size_t begin = 0, end = kCandidates; begin < kMostCandidates && total.count < kEnoughSamples;
         begin = end, end *= 8)
        total += parallelSum(
            end - begin, kGrain, [&](size_t from, size_t to) { return sumOver(flow, parts, begin + from, begin + to); },
            monitor);
    if (total.count == 0)
        throw ValueError("the domain of the flow is empty: no point of its box lies on the flow's side of the wall");
    FlowRmsN<N> rms = total.whole.rms(total.count);
    if (!parts.empty())
        for (size_t t = 0; t < flow.terms().size(); ++t) rms.terms.push_back(total.parts[t].rms(total.count));
    return rms;
}

} // namespace

template <int N>
FlowRmsN<N> rmsOf(const FlowN<N>& flow, const Monitor& monitor) {
    auto& [mutex, known] = *flow.mMeasured;
    {
        const std::lock_guard lock(mutex);
        if (known) return *known;
    }
    FlowRmsN<N> rms = measuredRms(flow, monitor); // not locked: it runs on all threads
    const std::lock_guard lock(mutex);
    known = rms;
    return rms;
}

template <int N>
FlowN<N> withSpeed(const FlowN<N>& flow, double speed, const Monitor& monitor) {
    const double now = movingSpeedOf(flow, monitor);
    requireSpeed(speed);
    if (speed == now) return flow;
    if (flow.uniformSpeed() > 0) return flow.normalized(speed);
    return scaled(flow, speed / now);
}

#define CURLEW_INSTANTIATE(N)                                                                        \
    template class FlowN<N>;                                                                         \
    template void FlowN<N>::eval(const PointBatchN<N>&, Jets<float>&, VecBatchN<float, N>&) const;   \
    template void FlowN<N>::eval(const PointBatchN<N>&, Jets<double>&, VecBatchN<double, N>&) const; \
    template FlowN<N> operator+(const FlowN<N>&, const FlowN<N>&);                                   \
    template FlowN<N> scaled(const FlowN<N>&, double);                                               \
    template FlowRmsN<N> rmsOf(const FlowN<N>&, const Monitor&);                                     \
    template FlowN<N> withSpeed(const FlowN<N>&, double, const Monitor&);
CURLEW_FOR_FLOW_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
