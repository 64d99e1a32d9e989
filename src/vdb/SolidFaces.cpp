// SPDX-License-Identifier: Apache-2.0
#include "SolidFaces.h"

#include "MeshShells.h"
#include "SolidChecks.h"

namespace curlew {

SolidFaces solidFacesOf(const Mesh& mesh, const MeshTopology& topology, const Monitor& monitor) {
    const auto manifold = [](const MeshTopology& t) { return t.closed() && t.nonManifoldEdges == 0; };
    const bool plain = manifold(topology);
    SolidFaces faces;
    faces.triangles = plain ? inTriangles(mesh) : distinctTriangles(mesh, faces.duplicates);
    const MeshTopology joined = plain ? topology : topologyOf(faces.triangles);
    faces.boundaryEdges = joined.boundaryEdges;
    faces.manifold = manifold(joined);
    faces.oriented = joined.closed() && isOriented(faces.triangles);
    if (!faces.oriented) {
        faces.reversed = orient(faces.triangles);
        faces.oriented = faces.reversed > 0 && joined.closed() && isOriented(faces.triangles);
    }
    if (faces.oriented) faces.turnedShells = turnProtruding(faces.triangles, monitor);
    return faces;
}

} // namespace curlew
