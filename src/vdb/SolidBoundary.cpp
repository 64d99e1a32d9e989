// SPDX-License-Identifier: Apache-2.0
#include "SolidBoundary.h"

#include "FacePieces.h"
#include "HoleSurface.h"
#include "MeshDistances.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>
#include <cmath>

namespace curlew {

using openvdb::Coord;

SolidBoundary::SolidBoundary(const SolidFaces& faces, const openvdb::math::Transform& transform, const Monitor& monitor)
    : mTransform(transform), mWinding(faces, monitor.quiet()) {
    const Monitor quiet = monitor.quiet();
    computeNear(faces.triangles, quiet);
    sortFaces(faces.triangles, quiet);
    if (!faces.oriented) closeHoles(quiet);
}

void SolidBoundary::computeNear(const Mesh& mesh, const Monitor& monitor) {
    const auto distances = distancesTo(mesh, mTransform, 2, monitor).distance;
    const double limit = kNear * mTransform.voxelSize()[0];
    std::vector<Coord> voxels;
    for (auto value = distances->cbeginValueOn(); value; ++value)
        if (static_cast<double>(*value) < limit) voxels.push_back(value.getCoord());
    compute(voxels, monitor);
    size_t undecided = 0, positive = 0, negative = 0;
    for (auto w = mKnown.cbeginValueOn(); w; ++w) {
        const double size = std::abs(static_cast<double>(*w));
        undecided += size > 0.25 && size < 0.75;
        if (SolidWinding::isInside(static_cast<double>(*w))) ++(*w > 0 ? positive : negative);
    }
    mUndecided = static_cast<double>(undecided) / static_cast<double>(std::max<size_t>(voxels.size(), 1));
    mTurned = negative > positive;
}

void SolidBoundary::compute(const std::vector<Coord>& voxels, const Monitor& monitor) {
    std::vector<Vec3d> positions(voxels.size());
    for (size_t n = 0; n < voxels.size(); ++n) {
        const openvdb::Vec3d p = mTransform.indexToWorld(voxels[n]);
        positions[n] = {{p[0], p[1], p[2]}};
    }
    const std::vector<double> w = mWinding.at(positions, monitor);
    Accessor access(mKnown);
    for (size_t n = 0; n < voxels.size(); ++n) access.setValueOn(voxels[n], static_cast<float>(w[n]));
}

void SolidBoundary::sortFaces(const Mesh& mesh, const Monitor& monitor) {
    const auto bounds = [this](const Vec3d& position, const Vec3d& step) {
        auto [above, below] = mWinding.beside(position, step);
        // Beside a sheet, both are 1/2, give or take the error of beside(), which is greater than that of at().
        const auto isClose = [](double w) { return std::abs(std::abs(w) - 0.5) < 0.01; };
        if (isClose(above) || isClose(below))
            above = mWinding.at(position + step), below = mWinding.at(position - step);
        return SolidWinding::isInside(above) != SolidWinding::isInside(below);
    };
    FacePieces pieces(mesh, mTransform.voxelSize()[0], bounds, monitor);
    mHidden = pieces.hidden();
    mSurface = pieces.takeSurface();
}

void SolidBoundary::closeHoles(const Monitor& monitor) {
    const auto extend = [&](const std::vector<Coord>& voxels) { compute(voxels, monitor); };
    const auto at = [this](const openvdb::Vec3d& ijk) {
        const openvdb::Vec3d p = mTransform.indexToWorld(ijk);
        return mWinding.at(Vec3d{{p[0], p[1], p[2]}});
    };
    appendHoleSurface(mKnown, extend, at, mTransform, mSurface, monitor);
}

std::vector<uint8_t> SolidBoundary::inside(const std::vector<Coord>& voxels, const Monitor& monitor) {
    std::vector<Coord> unknown;
    {
        openvdb::tree::ValueAccessor<const openvdb::FloatTree> known(mKnown);
        for (const Coord& voxel : voxels)
            if (!known.isValueOn(voxel)) unknown.push_back(voxel);
    }
    compute(unknown, monitor);
    std::vector<uint8_t> result(voxels.size());
    openvdb::tree::ValueAccessor<const openvdb::FloatTree> known(mKnown);
    for (size_t n = 0; n < voxels.size(); ++n)
        result[n] = SolidWinding::isInside(static_cast<double>(known.getValue(voxels[n])));
    return result;
}

} // namespace curlew
