#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Domain.h"

namespace curlew {

/// One vector per position, as a structure of arrays.
template <class T>
struct VecBatch {
    alignas(64) std::array<std::array<T, kBatch>, 3> c;

    Vec3<T> operator[](int i) const {
        const auto k = static_cast<size_t>(i);
        return {{c[0][k], c[1][k], c[2][k]}};
    }
    void set(int i, const Vec3<T>& v) {
        for (size_t axis = 0; axis < 3; ++axis) c[axis][static_cast<size_t>(i)] = v[static_cast<int>(axis)];
    }
};

/// What a flow knows at one position.
struct FlowSample {
    Vec3d velocity;     ///< World units per second.
    double f, g;        ///< Constant along a streamline.
    Matrix3 derivative; ///< d velocity_i / d x_j; its trace is the divergence.
};

/// Divergence-free vector noise: the velocity field c = grad f x grad g (DeWolf Eq. 2; ICN §3.3), which remembers its
/// potentials f and g: streamlines are the intersections of their iso-surfaces, and f grad g is a vector potential.
/// Immutable, cheap to copy, safe to share between threads.
class Dfvn {
  public:
    Dfvn(ScalarField f, ScalarField g, Domain domain = {})
        : mF(std::move(f)), mG(std::move(g)), mDomain(std::move(domain)) {}

    const ScalarField& f() const { return mF; }
    const ScalarField& g() const { return mG; }
    const Domain& domain() const { return mDomain; }

    /// Velocities at a batch of positions; also the jets that they are made of.
    template <class T>
    void eval(const PointBatch& points, JetBatch<T, 1>& f, JetBatch<T, 1>& g, VecBatch<T>& velocity) const {
        mF.eval(points, f);
        mG.eval(points, g);
        for (int i = 0; i < points.size; ++i) velocity.set(i, cross(f[i].gradient, g[i].gradient));
    }
    template <class T>
    void velocity(const PointBatch& points, VecBatch<T>& velocity) const {
        JetBatch<T, 1> f, g;
        eval(points, f, g, velocity);
    }

    /// Everything at one position, from Hessians.
    FlowSample at(const Vec3d& position) const;

  private:
    ScalarField mF, mG;
    Domain mDomain;
};

/// Root mean squares over the domain of a flow, from the same pseudo-random positions at every call.
struct FlowMagnitudes {
    double speed = 0, f = 0, g = 0;
};

/// Throws ValueError where no sample falls into the domain, and for an infinite one.
FlowMagnitudes magnitudesOf(const Dfvn& flow, const Monitor& monitor = {});

/// The same streamlines at another pace: f is scaled so that the root mean square of the speed over the domain is
/// `speed`, world units per second. Throws ValueError for a flow that does not move, and for a speed that is not
/// positive.
Dfvn withSpeed(const Dfvn& flow, double speed, const Monitor& monitor = {});

} // namespace curlew
