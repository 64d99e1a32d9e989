// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Domain.h"
#include "curlew/math/Cross.h"

#include <functional>
#include <memory>
#include <vector>

namespace curlew {

/// One vector per position, as a structure of arrays.
template <class T, int N>
struct VecBatchN {
    alignas(64) std::array<std::array<T, kBatch>, N> c;

    /// Returns the vectors from i on, as many as P has lanes. P is T or lanes of T.
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

/// The velocity and related values of a flow at one position.
template <int N>
struct FlowSampleN {
    Vec<double, N> velocity;                        ///< World units per second.
    std::array<double, size_t{N - 1}> potentials{}; ///< f, g, … of the flow's first term.
    Matrix<N, N> derivative; ///< Velocity gradient d velocity_i / d x_j; its trace is the divergence.
};
using FlowSample = FlowSampleN<3>;

/// Root mean squares (rms) over the domain of a flow.
template <int N>
struct FlowRmsN {
    double speed = 0;
    std::array<double, size_t{N - 1}> potentials{}; ///< Of the first term.
    std::vector<FlowRmsN> terms;                    ///< Each term by itself, if the flow is a sum.
};
using FlowRms = FlowRmsN<3>;

/// A velocity field made of scalar fields, its potentials, which it stores. N = 2 … 7.
///
/// A flow of one term is divergence-free vector noise (DFVN): the cross product of N - 1 gradients, in 3D c = ∇f × ∇g
/// (DeWolf Eq. 2; ICN §3.3), in N dimensions ICN Eq. 8, in 2D (f_y, -f_x). Its streamlines are tracks: the potentials
/// are constant along each of them, so a point can be moved back onto its own track (reprojection, track/Reproject.h).
/// A sum of such terms is also divergence-free but has no tracks. Every curl is such a sum: curl ψ = Σ ∇ψ_i × ∇x_i.
///
/// A flow may also contain velocities that are given by their components, such as an interpolated grid or a gradient
/// (ofComponents). It is then not divergence-free in general, has no tracks, and cannot be split into terms.
///
/// Immutable, cheap to copy, safe to share between threads.
template <int N>
class FlowN {
  public:
    static constexpr int kDimension = N;
    static constexpr size_t kPotentials{N - 1};
    using Potentials = std::array<ScalarFieldN<N>, kPotentials>;
    using Components = std::array<ScalarFieldN<N>, size_t{N}>;
    template <class T>
    using Jets = std::array<JetBatchN<T, N, 1>, kPotentials>;

    explicit FlowN(Potentials potentials, DomainN<N> domain = {}) : FlowN(std::vector{std::move(potentials)}, domain) {}
    /// Throws ValueError if there are no terms.
    FlowN(std::vector<Potentials> terms, DomainN<N> domain);
    /// 3D: f and g. (A template, so that it exists for N = 3 only.)
    template <int M = N>
    requires(M == 3) FlowN(ScalarFieldN<M> f, ScalarFieldN<M> g, DomainN<M> domain = {})
        : FlowN(Potentials{std::move(f), std::move(g)}, std::move(domain)) {}

    /// Returns a flow whose velocity has these components, in world units per second.
    static FlowN ofComponents(Components components, DomainN<N> domain = {});

    const std::vector<Potentials>& terms() const { return mTerms; }
    /// Velocities that are given by their components. The velocity of the flow is the sum of them and of the terms.
    const std::vector<Components>& components() const { return mComponents; }
    /// Whether the potentials are constant along streamlines: the flow is one term.
    bool hasTracks() const { return mTerms.size() == 1 && mComponents.empty(); }
    /// Returns the potentials of the first term. Requires one.
    const Potentials& potentials() const { return mTerms.front(); }
    const ScalarFieldN<N>& f() const { return mTerms.front()[0]; }
    template <int M = N>
    requires(M == 3) const ScalarFieldN<M>& g() const { return mTerms.front()[1]; }

    const DomainN<N>& domain() const { return mDomain; }
    FlowN within(DomainN<N> domain) const;

    /// Returns the flow c / |c| times `speed`, zero where c is zero (DeWolf §5). It keeps its tracks but is no longer
    /// divergence-free. Throws ValueError if `speed` is not positive or exceeds 1e15.
    FlowN normalized(double speed) const;
    /// Returns the speed of a normalised flow, else 0.
    double uniformSpeed() const { return mUniformSpeed; }
    /// Returns the flow c / |∇F|, F being its last potential, zero where ∇F is zero: in 3D ∇f × ∇g / |∇g|. It moves on
    /// the level sets of F and preserves their area (in 4D, their volume): its divergence within each of them is zero.
    /// (c itself preserves the volume, which is the area times the distance to the next level set.) It keeps its
    /// tracks. N >= 3. Throws ValueError for a sum, and for a normalised flow.
    FlowN onLevelSets() const;
    /// Whether the flow preserves the area of the level sets of its last potential instead of the volume.
    bool preservesArea() const { return mOnLevelSets; }
    /// Whether the velocity is a sum of terms: neither normalised, nor divided by a gradient, nor given by components.
    bool divergenceFree() const { return mUniformSpeed == 0 && !mOnLevelSets && mComponents.empty(); }

    /// Computes the velocities at a batch of positions, and the jets of the first term's potentials (zero if there are
    /// no terms).
    template <class T>
    void eval(const PointBatchN<N>& points, Jets<T>& potentials, VecBatchN<T, N>& velocity) const;
    template <class T>
    void velocity(const PointBatchN<N>& points, VecBatchN<T, N>& velocity) const {
        Jets<T> potentials;
        eval(points, potentials, velocity);
    }
    /// Returns a function that computes the velocities at batches of a lattice: the same bits as velocity(). It refers
    /// to the flow (ScalarField::onLattice).
    std::function<void(const LatticeBatch&, VecBatchN<float, N>&)> onLattice(const PointLattice& lattice) const
        requires(N == 3);

    /// Computes velocity, potentials and velocity gradient at one position. Uses the potentials' Hessians.
    FlowSampleN<N> at(const Vec<double, N>& position) const;

  private:
    /// evalPotential(t, k, jets) computes the jets of potential k of term t.
    template <class T, class EvalPotential>
    void evalWith(const EvalPotential& evalPotential, const PointBatchN<N>& points, Jets<T>& potentials,
                  VecBatchN<T, N>& velocity) const;

    struct Measured; // what has been measured of this flow, shared by its copies

    FlowN() = default;
    /// Forgets what has been measured, after a change of a copy.
    void changed();
    template <int M>
    friend FlowN<M> operator+(const FlowN<M>&, const FlowN<M>&);
    template <int M>
    friend FlowN<M> scaled(const FlowN<M>&, double);
    template <int M>
    friend FlowRmsN<M> rmsOf(const FlowN<M>&, const Monitor&);

    std::vector<Potentials> mTerms;
    std::vector<Components> mComponents;
    DomainN<N> mDomain;
    double mUniformSpeed = 0;
    bool mOnLevelSets = false;
    std::shared_ptr<Measured> mMeasured;
};
using Flow = FlowN<3>;

/// The sum of two flows in the domain of the first. It has no tracks. Throws ValueError if either is normalised or
/// preserves area.
template <int N>
FlowN<N> operator+(const FlowN<N>& a, const FlowN<N>& b);

/// Returns the same velocity `factor` times as fast. A normalised flow keeps its uniform speed.
template <int N>
FlowN<N> scaled(const FlowN<N>& flow, double factor);

/// Measures a flow at the same positions at every call, to about 0.3 %. A flow and its copies are measured once. Throws
/// ValueError if the domain is infinite or no sample lies in it.
template <int N>
FlowRmsN<N> rmsOf(const FlowN<N>& flow, const Monitor& monitor = {});

/// Returns a flow with the same streamlines and the rms speed `speed` over the domain, in world units per second.
/// Scales the first potential of each term. A normalised flow gets that speed wherever it moves. Throws ValueError if
/// the flow does not move, or if `speed` is not positive or exceeds 1e15.
template <int N>
FlowN<N> withSpeed(const FlowN<N>& flow, double speed, const Monitor& monitor = {});

} // namespace curlew
