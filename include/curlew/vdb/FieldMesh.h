// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/field/ScalarField.h"
#include "curlew/vdb/MeshFile.h"

namespace curlew {

// Surfaces of fields as meshes. Vertices are shared between faces, and have exact positions and normals: the normals
// are the field's gradients, not averages over faces.

struct IsosurfaceOptions {
    double iso = 0;        ///< The value of the field on the surface.
    Box box;               ///< The surface ends where it leaves the box, within a voxel of it.
    double voxel = 0;      ///< Size of the sampled voxels, and so of the faces; 0: from `dim`.
    int dim = 128;         ///< Number of voxels along the longest edge of the box.
    double adaptivity = 0; ///< As in levelSetToMesh().
    bool reversed = false; ///< The inside is where the field is above `iso`, as in a density.
};

/// Returns the surface on which a field has the value `iso`, by OpenVDB's volumeToMesh. Then Newton's method moves each
/// vertex onto the surface (a vertex that it would move by more than a voxel, as at a kink, stays). Faces run
/// counter-clockwise as seen from outside; the outside is where the field is larger, and normals point there. Parts
/// thinner than a voxel may be missing. Where the gradient is zero, a normal is the average over the faces around it.
/// Throws ValueError if the box is infinite or empty, if an option is invalid, or if there is no surface in the box;
/// ResourceError if there is not enough memory. The result has the same bytes for any number of threads.
Mesh isosurface(const ScalarField& field, const IsosurfaceOptions& options, const Monitor& monitor = {});

struct HeightMeshOptions {
    BoxN<2> box = BoxN<2>{}.padded(1);
    double edge = 0; ///< Edge of the quads, world units; 0: from `dim`. It is rounded so that whole quads fill the box.
    int dim = 128;   ///< Number of quads along the longest edge of the box.
};

/// Returns the surface z = field(x, y) over a box as quads, with UVs that go from 0 to 1 over the box. Faces run
/// counter-clockwise as seen from above. Errors as isosurface().
Mesh heightMesh(const ScalarFieldN<2>& field, const HeightMeshOptions& options, const Monitor& monitor = {});

} // namespace curlew
