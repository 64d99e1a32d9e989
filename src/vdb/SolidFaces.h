// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/vdb/MeshFile.h"

namespace curlew {

/// The triangles of a mesh, repaired as far as its topology tells: without duplicates, and those that run against their
/// neighbours reversed. The solid of the mesh (MeshSolid.h) is theirs.
struct SolidFaces {
    Mesh triangles;    ///< Those of closed shells first.
    size_t closed = 0; ///< The number of triangles of closed shells. Each of their edges has at least two of these
                       ///< triangles. Open sheets that are joined to a closed shell are no part of it.
    size_t boundaryEdges = 0;
    size_t duplicates = 0, reversed = 0, turnedShells = 0; ///< As in SolidFigures.
    bool oriented = false; ///< Each edge is used equally often in both directions, so winding numbers are integers.
    bool manifold = false; ///< Each edge has two triangles.

    bool hasOpen() const { return closed < triangles.triangles.size(); }
    Mesh closedOnes() const;
    Mesh openOnes() const;
};

/// `topology`: that of the mesh.
SolidFaces solidFacesOf(const Mesh& mesh, const MeshTopology& topology, const Monitor& monitor);

} // namespace curlew
