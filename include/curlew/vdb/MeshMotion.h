// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/field/RigidMotion.h"
#include "curlew/vdb/MeshFile.h"

#include <memory>

namespace curlew {

/// Whether two meshes have the same faces: then point k of one is point k of the other, at another time.
bool correspond(const Mesh& a, const Mesh& b);

/// The box around the points of a mesh.
Box boundsOf(const Mesh& mesh);

/// Where a mesh is, seen from another that corresponds to it: the rigid motion that leaves the least squares of
/// distances (Kabsch 1976). The home pose of the first is its mean point, unturned.
struct RigidFit {
    Pose home, now;
    double residual = 0; ///< The greatest distance that is left, relative to the diagonal of the mesh's box.

    /// Both are one body: what is left is the rounding of files.
    bool rigid() const { return residual < 1e-5; }
};

/// Infinite residual if the points are on a line.
RigidFit rigidFit(const Mesh& from, const Mesh& to);

/// A mesh in four frames that correspond. The outer ones may be null.
struct MeshKeys {
    std::shared_ptr<const Mesh> before, from, to, after;
};

/// The mesh on the way from one frame to the next, `part` = 0 … 1 of it: each point on the curve of poseBetween().
Mesh meshBetween(const MeshKeys& keys, double part);

} // namespace curlew
