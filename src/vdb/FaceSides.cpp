// SPDX-License-Identifier: Apache-2.0
#include "FaceSides.h"

#include "curlew/vdb/Openvdb.h"

#include <openvdb/math/Proximity.h>

#include <algorithm>
#include <cmath>

namespace curlew {

using openvdb::Index32;

FaceSides::FaceSides(const Mesh& mesh, const openvdb::math::Transform& transform)
    : mMesh(mesh), mIndexMesh(mesh, transform), mFaces(mIndexMesh) {}

openvdb::Vec3d FaceSides::cornerOf(size_t face, size_t k) const {
    const Vec3d& p = mIndexMesh.indexPoint(face, k);
    return {p[0], p[1], p[2]};
}

openvdb::Vec3d FaceSides::normalOf(size_t face) const {
    const openvdb::Vec3d a = cornerOf(face, 0);
    const openvdb::Vec3d normal = (cornerOf(face, 1) - a).cross(cornerOf(face, 2) - a);
    const double size = normal.length();
    return size > 0 ? normal / size : openvdb::Vec3d(0.0);
}

double FaceSides::sideOf(size_t face, const openvdb::Vec3d& p) const {
    openvdb::Vec3d uvw;
    const openvdb::Vec3d closest =
        openvdb::math::closestPointOnTriangleToPoint(cornerOf(face, 0), cornerOf(face, 1), cornerOf(face, 2), p, uvw);
    const auto& corner = mMesh.triangles[face];
    int zeros = 0, biggest = 0;
    for (int k = 0; k < 3; ++k) {
        zeros += !(uvw[k] > 0);
        if (uvw[k] > uvw[biggest]) biggest = k;
    }
    openvdb::Vec3d normal(0.0);
    if (zeros == 0) {
        normal = normalOf(face);
    } else {
        const Index32 vertex = corner[biggest];
        Index32 other = vertex; // other end of the edge; at a vertex there is none
        for (int k = 0; k < 3; ++k)
            if (k != biggest && uvw[k] > 0) other = corner[k];
        for (const Index32 at : mFaces.at(vertex)) {
            const auto& t = mMesh.triangles[at];
            if (other != vertex) {
                if (t[0] == other || t[1] == other || t[2] == other) normal += normalOf(at);
                continue;
            }
            const size_t k = t[0] == vertex ? 0 : t[1] == vertex ? 1 : 2;
            const openvdb::Vec3d here = cornerOf(at, k), u = cornerOf(at, (k + 1) % 3) - here,
                                 v = cornerOf(at, (k + 2) % 3) - here;
            normal += normalOf(at) * std::atan2(u.cross(v).length(), u.dot(v));
        }
    }
    return normal.dot(p - closest);
}

} // namespace curlew
