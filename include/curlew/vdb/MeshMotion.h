// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/RigidMotion.h"
#include "curlew/vdb/MeshFile.h"

#include <memory>

namespace curlew {

/// Returns whether two meshes have the same faces, so that point k of one is point k of the other at another time.
bool correspond(const Mesh& a, const Mesh& b);

/// Returns the bounding box of a mesh.
Box boundsOf(const Mesh& mesh);

/// The rigid motion from a mesh to another that corresponds to it, with the least sum of squared distances (Kabsch
/// 1976). The home pose is that of the first mesh: its origin is the mean of the points, and its axes are not rotated.
struct RigidFit {
    Pose home, now;
    double residual = 0; ///< The largest remaining distance, relative to the diagonal of the mesh's box.

    /// Whether the two meshes are the same rigid body, up to the rounding of files.
    bool rigid() const { return residual < 1e-5; }
};

/// Fits a rigid motion. The residual is infinite if the points are collinear.
RigidFit rigidFit(const Mesh& from, const Mesh& to);

/// A mesh in four consecutive frames that correspond. `before` and `after` may be null.
struct MeshKeys {
    std::shared_ptr<const Mesh> before, from, to, after;
};

/// Returns the mesh at `part` = 0 … 1 of the interval between two frames. Each point follows the cubic Hermite curve of
/// poseBetween().
Mesh meshBetween(const MeshKeys& keys, double part);

/// Returns the velocities of the points of meshBetween(), the derivatives of those curves, in world units per second.
/// `seconds`: the time between two frames.
std::vector<openvdb::Vec3s> velocitiesBetween(const MeshKeys& keys, double part, double seconds);

} // namespace curlew
