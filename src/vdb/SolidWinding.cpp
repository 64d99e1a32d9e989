// SPDX-License-Identifier: Apache-2.0
#include "SolidWinding.h"

#include "MeshShells.h"

#include <algorithm>

namespace curlew {

namespace {

/// The winding number that decides, from those of the closed shells and of the others.
double combined(double closed, double others) {
    return SolidWinding::isInside(closed) ? closed + std::copysign(1.0, closed) : closed + others;
}

} // namespace

SolidWinding::SolidWinding(const SolidFaces& faces, const Monitor& monitor) {
    const SolidShells parts = solidShells(faces, monitor);
    if (parts.closed.faces() > 0) mClosed.emplace(parts.closed, monitor);
    if (parts.others.faces() > 0 || !mClosed) mOthers.emplace(parts.others, monitor);
}

double SolidWinding::at(const Vec3d& position) const {
    if (!mOthers) return mClosed->at(position);
    return mClosed ? combined(mClosed->at(position), mOthers->at(position)) : mOthers->at(position);
}

std::vector<double> SolidWinding::at(std::span<const Vec3d> positions, const Monitor& monitor) const {
    if (!mOthers) return mClosed->at(positions, monitor);
    std::vector<double> w = mOthers->at(positions, monitor);
    if (mClosed) {
        const std::vector<double> closed = mClosed->at(positions, monitor);
        std::transform(closed.begin(), closed.end(), w.begin(), w.begin(), combined);
    }
    return w;
}

std::array<double, 2> SolidWinding::beside(const Vec3d& position, const Vec3d& step) const {
    if (!mOthers) return mClosed->beside(position, step);
    const auto others = mOthers->beside(position, step);
    if (!mClosed) return others;
    const auto closed = mClosed->beside(position, step);
    return {combined(closed[0], others[0]), combined(closed[1], others[1])};
}

} // namespace curlew
