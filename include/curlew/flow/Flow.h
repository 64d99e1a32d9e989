// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Domain.h"
#include "curlew/math/Cross.h"

#include <vector>

namespace curlew {

/// One vector per position, as a structure of arrays.
template <class T, int N>
struct VecBatchN {
    alignas(64) std::array<std::array<T, kBatch>, N> c;

    /// The vectors from i on, as many as P, a type of Ts, has lanes.
    template <class P>
    Vec<P, N> lanes(int i) const {
        Vec<P, N> v;
        for (int axis = 0; axis < N; ++axis) v[axis] = load<P>(&c[static_cast<size_t>(axis)][static_cast<size_t>(i)]);
        return v;
    }
    template <class P = T>
    void set(int i, const Vec<P, N>& v) {
        for (int axis = 0; axis < N; ++axis) store(v[axis], &c[static_cast<size_t>(axis)][static_cast<size_t>(i)]);
    }
    Vec<T, N> operator[](int i) const { return lanes<T>(i); }
};
template <class T>
using VecBatch = VecBatchN<T, 3>;

/// What a flow knows at one position.
template <int N>
struct FlowSampleN {
    Vec<double, N> velocity;                        ///< World units per second.
    std::array<double, size_t{N - 1}> potentials{}; ///< f, g, …: those of the flow's first term.
    Matrix<N, N> derivative;                        ///< d velocity_i / d x_j; its trace is the divergence.
};
using FlowSample = FlowSampleN<3>;

/// A velocity field made of scalar fields, its potentials, which it remembers. N = 2 … 7.
///
/// Of one term, it is divergence-free vector noise: the cross product of N - 1 gradients, in 3D c = ∇f × ∇g (DeWolf Eq.
/// 2; ICN §3.3), in N dimensions ICN Eq. 8, in 2D (f_y, -f_x). Its streamlines are tracks: the potentials are constant
/// along each of them, so a point can be put back onto its own (track/Reproject.h). A sum of such terms is
/// divergence-free too, but has no tracks. Every flow that is a curl is one: curl ψ = Σ ∇ψ_i × ∇x_i.
///
/// Immutable, cheap to copy, safe to share between threads.
template <int N>
class FlowN {
  public:
    static constexpr int kDimension = N;
    static constexpr size_t kPotentials{N - 1};
    using Potentials = std::array<ScalarFieldN<N>, kPotentials>;
    template <class T>
    using Jets = std::array<JetBatchN<T, N, 1>, kPotentials>;

    explicit FlowN(Potentials potentials, DomainN<N> domain = {}) : FlowN(std::vector{std::move(potentials)}, domain) {}
    /// Throws ValueError where there is no term.
    FlowN(std::vector<Potentials> terms, DomainN<N> domain);
    /// In space: f and g. (Templates, so that no other dimension sees them.)
    template <int M = N>
    requires(M == 3) FlowN(ScalarFieldN<M> f, ScalarFieldN<M> g, DomainN<M> domain = {})
        : FlowN(Potentials{std::move(f), std::move(g)}, std::move(domain)) {}

    const std::vector<Potentials>& terms() const { return mTerms; }
    /// Whether the potentials are constant along streamlines: the flow has one term.
    bool hasTracks() const { return mTerms.size() == 1; }
    /// Those of the first term.
    const Potentials& potentials() const { return mTerms.front(); }
    const ScalarFieldN<N>& f() const { return mTerms.front()[0]; }
    template <int M = N>
    requires(M == 3) const ScalarFieldN<M>& g() const { return mTerms.front()[1]; }

    const DomainN<N>& domain() const { return mDomain; }
    FlowN within(DomainN<N> domain) const;

    /// The same directions at the same speed everywhere, zero where the flow stands still (DeWolf §5). It keeps its
    /// tracks but is no longer divergence-free. Throws ValueError for a speed that is not positive and finite.
    FlowN normalized(double speed) const;
    /// The speed of a normalised flow, else 0.
    double uniformSpeed() const { return mUniformSpeed; }
    bool divergenceFree() const { return mUniformSpeed == 0; }

    /// Velocities at a batch of positions; also the jets of the first term's potentials.
    template <class T>
    void eval(const PointBatchN<N>& points, Jets<T>& potentials, VecBatchN<T, N>& velocity) const;
    template <class T>
    void velocity(const PointBatchN<N>& points, VecBatchN<T, N>& velocity) const {
        Jets<T> potentials;
        eval(points, potentials, velocity);
    }

    /// Everything at one position, from Hessians.
    FlowSampleN<N> at(const Vec<double, N>& position) const;

  private:
    std::vector<Potentials> mTerms;
    DomainN<N> mDomain;
    double mUniformSpeed = 0;
};
using Flow = FlowN<3>;

/// The sum of two flows, in the domain of the first. It has no tracks. Throws ValueError where one of them is
/// normalised.
template <int N>
FlowN<N> operator+(const FlowN<N>& a, const FlowN<N>& b);

/// Root mean squares over the domain of a flow, from the same pseudo-random positions at every call.
template <int N>
struct FlowMagnitudesN {
    double speed = 0;
    std::array<double, size_t{N - 1}> potentials{}; ///< Of the first term.
};
using FlowMagnitudes = FlowMagnitudesN<3>;

/// Throws ValueError where no sample falls into the domain, and for an infinite one.
template <int N>
FlowMagnitudesN<N> magnitudesOf(const FlowN<N>& flow, const Monitor& monitor = {});

/// The same streamlines at another pace: the first potential of each term is scaled so that the root mean square of the
/// speed over the domain is `speed`, world units per second; a normalised flow has that speed wherever it moves. Throws
/// ValueError for a flow that does not move, and for a speed that is not positive.
template <int N>
FlowN<N> withSpeed(const FlowN<N>& flow, double speed, const Monitor& monitor = {});

} // namespace curlew
