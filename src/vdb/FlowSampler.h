// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "WallFade.h"
#include "curlew/track/WallVelocity.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/VelocityGrid.h"

#include <array>
#include <cmath>
#include <span>
#include <vector>

namespace curlew {

using VelocityLeaf = openvdb::Vec3STree::LeafNodeType;

constexpr int kLeafEdge = VelocityLeaf::DIM;
constexpr size_t kLeafCorners = kLeafEdge + 1; ///< Of voxels along an edge of a leaf.

/// A flow to be sampled on the voxels of a grid. Refers to the flow, the fade and the motion of the wall (nullptr if
/// the wall is at rest).
struct FlowOnVoxels {
    const Flow& flow;
    Voxels voxels;
    const WallFade& fade;
    const WallVelocity* moving = nullptr;

    Vec3d centre(const openvdb::Coord& ijk) const { return voxels.centre(ijk[0], ijk[1], ijk[2]); }

    /// Whether the wall is a level set: its distances are exact in a band only.
    bool inLevelSet() const {
        const auto& wall = flow.domain().wall;
        return wall && wall->sdf.reach > 0 && std::isfinite(wall->sdf.reach);
    }
    /// Returns whether the centres of all voxels of a leaf are in the domain's box.
    bool inBox(const openvdb::Coord& origin) const {
        const Box& box = flow.domain().box;
        return box.contains(centre(origin)) && box.contains(centre(origin.offsetBy(kLeafEdge - 1)));
    }
    /// Returns whether the fade factor is 1 at the centres and corners of the voxels of a cube with `edge` voxels per
    /// edge.
    bool isFar(const openvdb::Coord& origin, int edge = kLeafEdge) const {
        if (!fade.oneSided()) return true;
        const Vec3d middle = middleOf(origin, edge);
        return fade.isFar(flow.domain().wall->sdf.distance.at<0>(middle).value, radiusOf(edge));
    }
    /// Returns whether the moving wall adds no velocity in the cube, the faces of its voxels included.
    bool rests(const openvdb::Coord& origin, int edge = kLeafEdge) const {
        return !moving || moving->isFar(middleOf(origin, edge), radiusOf(edge));
    }

  private:
    Vec3d middleOf(const openvdb::Coord& origin, int edge) const {
        return centre(origin) + Vec3d{{1, 1, 1}} * ((0.5 * edge - 0.5) * voxels.size);
    }
    double radiusOf(int edge) const { return 0.5 * edge * std::sqrt(3.0) * voxels.size; }
};

/// Fills a leaf with velocities at the centres of its voxels.
void sampleCollocated(const FlowOnVoxels& sampled, VelocityLeaf& leaf);

/// Fills leaves in the same way, with velocities from a source, which gets the positions of many leaves at once.
void sampleCollocated(const FlowOnVoxels& sampled, const VelocitySource& source,
                      const std::vector<VelocityLeaf*>& leaves, const Monitor& monitor);

/// Returns the flow with the potentials that suit a StaggeredBrick best. Where f fades beyond the wall, the slope of
/// the fade adds velocity, the more the larger f is there. So the potentials (f, g) become (f - m, g) or (m - g, f),
/// whichever adds less, with the same velocity; m is the mean of f or g there. A potential that vanishes at the wall is
/// nearly constant there. If both add about as much, they become two terms, a share of each, so that a flow that
/// changes smoothly in time changes smoothly beyond the wall too. The choice depends on the flow, the size of the
/// voxels and the fade; if the wall is unbounded, on the box of the flow's domain too.
Flow potentialsToFade(const FlowOnVoxels& sampled);

/// Fills the leaves of a brick with velocities at the faces of their voxels. Each potential is computed once per voxel
/// corner.
class StaggeredBrick {
  public:
    static constexpr int kLeaves = 4; ///< Per edge; this gives 33³ corners for up to 32³ voxels.

    /// The potentials at the corners, z fastest; 0 where no face needs them.
    struct Term {
        std::vector<double> f, g;
    };

    /// Computes the potentials at the corners of the voxels of these leaves, which must be in one brick.
    StaggeredBrick(const FlowOnVoxels& sampled, std::span<const openvdb::Coord> leaves);

    /// Computes the velocities of one of the leaves. The flux through a face is the circulation of f dg around it; the
    /// velocity is the flux divided by the area of the face.
    void sample(VelocityLeaf& leaf) const;

  private:
    // Integrals over the edges from each of the 9³ corners of a leaf to the next corner along each axis, z fastest.
    static constexpr size_t kEdgeY = kLeafCorners, kEdgeX = kLeafCorners * kLeafCorners;
    using Edges = std::array<std::array<double, kEdgeX * kLeafCorners>, 3>;
    /// Some property of the rows of corners along z, [x][y].
    using Rows = std::array<std::array<bool, kLeafCorners>, kLeafCorners>;

    void integrate(const openvdb::Coord& leaf, Edges& edges, Rows& flowing) const;
    void addPointValues(VelocityLeaf& leaf) const;
    void activate(VelocityLeaf& leaf) const;

    const FlowOnVoxels& mSampled;
    openvdb::Coord mOrigin;      ///< The lowest voxel of all leaves.
    std::array<size_t, 3> mStep; ///< From a corner to the next one along each axis.
    bool mFar = false;           ///< Whether the flow fades nowhere in the brick.
    std::vector<Term> mTerms;    ///< Those of the flow that do not vanish, followed by those of its moving wall.
};

} // namespace curlew
