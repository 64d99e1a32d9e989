// SPDX-License-Identifier: Apache-2.0
#include "SolidWinding.h"

#include "MeshShells.h"

#include <algorithm>

namespace curlew {

namespace {

/// `ofClosed`: the winding number of the closed shells.
double combined(double w, double ofClosed) {
    return SolidWinding::isInside(ofClosed) ? ofClosed + std::copysign(1.0, ofClosed) : w;
}

} // namespace

SolidWinding::SolidWinding(const Mesh& mesh, const Monitor& monitor) : mAll(mesh, monitor) {
    if (const Mesh closed = closedBesideOpen(mesh, monitor); closed.faces() > 0) mClosed.emplace(closed, monitor);
}

double SolidWinding::at(const Vec3d& position) const {
    const double w = mAll.at(position);
    return mClosed ? combined(w, mClosed->at(position)) : w;
}

std::vector<double> SolidWinding::at(std::span<const Vec3d> positions, const Monitor& monitor) const {
    std::vector<double> w = mAll.at(positions, monitor);
    if (mClosed) {
        const std::vector<double> ofClosed = mClosed->at(positions, monitor);
        std::transform(w.begin(), w.end(), ofClosed.begin(), w.begin(), combined);
    }
    return w;
}

std::array<double, 2> SolidWinding::beside(const Vec3d& position, const Vec3d& step) const {
    const auto [above, below] = mAll.beside(position, step);
    if (!mClosed) return {above, below};
    const auto [closedAbove, closedBelow] = mClosed->beside(position, step);
    return {combined(above, closedAbove), combined(below, closedBelow)};
}

} // namespace curlew
