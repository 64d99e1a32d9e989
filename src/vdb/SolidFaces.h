// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/vdb/MeshFile.h"

namespace curlew {

/// The triangles of a mesh, repaired as far as its topology tells: without duplicates, and those that run against their
/// neighbours reversed. The solid of the mesh (MeshSolid.h) is theirs.
struct SolidFaces {
    Mesh triangles;
    size_t boundaryEdges = 0;
    size_t duplicates = 0, reversed = 0, turnedShells = 0; ///< As in SolidFigures.
    bool oriented = false; ///< Closed, and each edge is used equally often in both directions.
    bool manifold = false; ///< Closed, and no edge has more than two faces.
};

/// `topology`: that of the mesh.
SolidFaces solidFacesOf(const Mesh& mesh, const MeshTopology& topology, const Monitor& monitor);

} // namespace curlew
