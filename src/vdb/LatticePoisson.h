// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "FaceVelocities.h"
#include "curlew/vdb/Openvdb.h"

#include <functional>
#include <optional>
#include <string>

namespace curlew {

/// Solves Poisson's equation on the points of a lattice: at each unknown point, the sum of the differences to its
/// neighbours is a source. Points that are not set are no neighbours, unless they have a fixed value. Uses OpenVDB's
/// preconditioned conjugate gradients. In a region without fixed values, there is a solution only if the sources add up
/// to 0, and it is unique up to a constant: their mean is subtracted, and the constant is arbitrary.
class LatticePoisson {
  public:
    /// `what` is named in errors.
    LatticePoisson(const Vec<int, 3>& size, std::string what);

    /// Makes a point unknown.
    void set(const Vec<int, 3>& point, double source);
    /// Gives a point a value.
    void fix(const Vec<int, 3>& point, double value);
    /// The value beyond the sides of the lattice; nullopt (the default): no neighbours.
    void setOutside(std::function<std::optional<double>(int axis, bool upper)> outside) {
        mOutside = std::move(outside);
    }

    /// Returns the values, 0 at points that were neither set nor fixed. Stops when the largest residual is at most
    /// `tolerance`, or about that if rounding allows no less. Throws ValueError if it does not converge.
    Lattice<double> solve(double tolerance, int& iterations, const Monitor& monitor);

  private:
    std::optional<double> given(const openvdb::Coord& neighbour) const;
    void closeRegions();

    Vec<int, 3> mSize;
    std::string mWhat;
    std::function<std::optional<double>(int, bool)> mOutside;
    openvdb::DoubleTree mSources{0}, mFixed{0};
    openvdb::tree::ValueAccessor<openvdb::DoubleTree> mSetSource{mSources}, mSetFixed{mFixed};
};

} // namespace curlew
