// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "Glb.h"
#include "curlew/base/Error.h"
#include "curlew/vdb/AnimatedMesh.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace curlew::test {

/// Accuracy of positions up to 3: they are floats, and so are quaternions and matrices in the file.
constexpr double kRounding = 2e-6;

/// Reads a model file with this name and content.
inline AnimatedMesh readModel(const ScratchFolder& folder, const std::string& name, const std::string& bytes) {
    return AnimatedMesh::read(store(folder / name, bytes));
}

/// Returns the error message for a file with this name and content.
inline std::string complaintAbout(const ScratchFolder& folder, const std::string& name, const std::string& bytes) {
    try {
        readModel(folder, name, bytes).at({});
    } catch (const FileError& error) {
        return error.what();
    }
    return "nothing";
}

/// The points of Bar.
inline std::vector<openvdb::Vec3d> barPoints() {
    const Bar bar;
    std::vector<openvdb::Vec3d> points;
    for (size_t n = 0; n < bar.points.size(); n += 3)
        points.push_back(openvdb::Vec3d(openvdb::Vec3s(bar.points[n], bar.points[n + 1], bar.points[n + 2])));
    return points;
}

/// Returns the largest distance of these points from their vertices. A point's vertex is the nearest one that no point
/// before it has, because the order of vertices is not the same in all versions of Assimp.
inline double furthest(const Mesh& mesh, const std::vector<openvdb::Vec3d>& points) {
    REQUIRE(mesh.points.size() == points.size());
    std::vector<openvdb::Vec3d> left(mesh.points.begin(), mesh.points.end());
    double most = 0;
    for (const openvdb::Vec3d& p : points) {
        const auto nearest =
            std::min_element(left.begin(), left.end(), [&](const openvdb::Vec3d& a, const openvdb::Vec3d& b) {
                return (a - p).lengthSqr() < (b - p).lengthSqr();
            });
        most = std::max(most, (*nearest - p).length());
        left.erase(nearest);
    }
    return most;
}

/// Returns a point rotated about the z axis.
inline openvdb::Vec3d turned(const openvdb::Vec3d& p, double angle) {
    return openvdb::Vec3d(std::cos(angle) * p[0] - std::sin(angle) * p[1],
                          std::sin(angle) * p[0] + std::cos(angle) * p[1], p[2]);
}

/// Returns the points of bendingBar() when its second bone is rotated by `angle`. `share`: the weight of the first bone
/// at y = 1.
inline std::vector<openvdb::Vec3d> bentBar(double angle, double share = 0.5) {
    std::vector<openvdb::Vec3d> points = barPoints();
    const openvdb::Vec3d joint(0, 1, 0);
    for (openvdb::Vec3d& p : points) {
        const double first = p[1] < 1 ? 1 : p[1] > 1 ? 0 : share;
        p = p * first + (turned(p - joint, angle) + joint) * (1 - first);
    }
    return points;
}

} // namespace curlew::test
