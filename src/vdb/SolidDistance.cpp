// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/SolidDistance.h"

#include "SolidChecks.h"
#include "SolidFaces.h"
#include "SolidWinding.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/RayMesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace curlew {

struct SolidDistance::Parts {
    Parts(const Mesh& mesh, double thickness, const Monitor& monitor) : faces(mesh, monitor), half(thickness / 2) {}

    RayMesh faces;
    std::optional<SolidWinding> winding; ///< Not for a sheet.
    double half = 0;                     ///< Half the thickness of a sheet.

    /// Estimates the distance to the surface |w| = 1/2 across a hole, by Newton's step on w.
    double toHoleSurface(const Vec3d& position, double w, double nearest) const {
        const double step = 0.1 * nearest; // no face is that close
        if (!(step > 0)) return nearest;
        Vec3d slope;
        for (int axis = 0; axis < 3; ++axis) {
            Vec3d by;
            by[axis] = step;
            slope[axis] = (winding->at(position + by) - winding->at(position - by)) / (2 * step);
        }
        const double gradient = length(slope);
        return gradient > 0 ? std::min(nearest, std::abs(std::abs(w) - 0.5) / gradient) : nearest;
    }
};

SolidDistance::SolidDistance(const Mesh& mesh, double thickness, const Monitor& monitor) {
    auto parts = std::make_unique<Parts>(mesh, thickness, monitor);
    if (!(thickness > 0)) parts->winding.emplace(solidFacesOf(mesh, topologyOf(mesh), monitor), monitor);
    mParts = std::move(parts);
}

namespace {

const Mesh& meshOf(const LevelSet& levelSet) {
    if (!levelSet.mesh) throw ValueError(fmt::format("level set '{}' has no mesh", levelSet.grid->getName()));
    return *levelSet.mesh;
}

} // namespace

SolidDistance::SolidDistance(const LevelSet& levelSet, const Monitor& monitor)
    : SolidDistance(meshOf(levelSet), thicknessOf(*levelSet.grid), monitor) {}

SolidDistance::~SolidDistance() = default;
SolidDistance::SolidDistance(SolidDistance&&) noexcept = default;
SolidDistance& SolidDistance::operator=(SolidDistance&&) noexcept = default;

bool SolidDistance::inside(const Vec3d& position) const {
    if (!mParts->winding) return mParts->faces.distanceTo(position) < mParts->half;
    return SolidWinding::isInside(mParts->winding->at(position));
}

double SolidDistance::at(const Vec3d& position) const {
    const double nearest = mParts->faces.distanceTo(position);
    if (!mParts->winding) return nearest - mParts->half;
    const double w = mParts->winding->at(position), size = std::abs(w);
    const bool undecided = size > 0.1 && size < 0.9;
    const double distance = undecided ? mParts->toHoleSurface(position, w, nearest) : nearest;
    return SolidWinding::isInside(w) ? -distance : distance;
}

WrongSide wrongSideOf(std::span<const SolidDistance* const> solids, Side side, std::span<const double> x,
                      std::span<const double> y, std::span<const double> z, const Monitor& monitor) {
    if (side == Side::both || solids.empty()) return {};
    struct Tally : WrongSide {
        Tally& operator+=(const Tally& o) {
            points += o.points;
            depth = std::max(depth, o.depth);
            return *this;
        }
    };
    return parallelSum(
        x.size(), 256,
        [&](size_t begin, size_t end) {
            Tally tally;
            for (size_t k = begin; k < end; ++k) {
                const Vec3d position{{x[k], y[k], z[k]}};
                const bool inside = std::any_of(solids.begin(), solids.end(),
                                                [&](const SolidDistance* solid) { return solid->inside(position); });
                if (inside == (side == Side::inside)) continue;
                double distance = std::numeric_limits<double>::infinity(); // of the union
                for (const SolidDistance* solid : solids) distance = std::min(distance, solid->at(position));
                ++tally.points;
                tally.depth = std::max(tally.depth, std::abs(distance));
            }
            return tally;
        },
        monitor);
}

} // namespace curlew
