// SPDX-License-Identifier: Apache-2.0
#include "Inputs.h"

#include "curlew/field/NoiseField.h"
#include "curlew/vdb/MeshFile.h"
#include "curlew/vdb/MeshMotion.h"

#include <openvdb/tools/MeshToVolume.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

namespace curlew::bench {

std::shared_ptr<const Mesh> spot() { return std::make_shared<const Mesh>(readMesh(CURLEW_SCENES "/spot.obj")); }

std::shared_ptr<const Mesh> bumpyBall(int n) {
    auto mesh = std::make_shared<Mesh>();
    std::map<std::array<int, 3>, openvdb::Index32> known;
    const auto vertex = [&](const std::array<int, 3>& at) {
        const auto [entry, isNew] = known.emplace(at, static_cast<openvdb::Index32>(mesh->points.size()));
        if (isNew) {
            openvdb::Vec3d p;
            for (int axis = 0; axis < 3; ++axis)
                p[axis] = std::tan((2.0 * at[static_cast<size_t>(axis)] / n - 1) * std::numbers::pi / 4);
            p.normalize();
            p *= 1 + 0.1 * std::sin(7 * p[1]) * std::sin(5 * p[0]) + 0.05 * std::sin(9 * p[2]);
            mesh->points.emplace_back(openvdb::Vec3s(p));
        }
        return entry->second;
    };
    for (size_t axis = 0; axis < 3; ++axis)
        for (const int side : {0, n})
            for (int i = 0; i < n; ++i)
                for (int j = 0; j < n; ++j) {
                    const auto corner = [&](int a, int b) {
                        std::array<int, 3> at{};
                        at[axis] = side, at[(axis + 1) % 3] = a, at[(axis + 2) % 3] = b;
                        return vertex(at);
                    };
                    openvdb::Vec4I q(corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1));
                    if (side == 0) std::swap(q[1], q[3]);
                    mesh->triangles.emplace_back(q[0], q[1], q[2]);
                    mesh->triangles.emplace_back(q[0], q[2], q[3]);
                }
    return mesh;
}

std::shared_ptr<openvdb::FloatGrid> openVdbLevelSet(const Mesh& mesh, int dim) {
    const Vec3d size = boundsOf(mesh).size();
    const double voxel = std::max({size[0], size[1], size[2]}) / dim;
    const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
    return openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(*transform, mesh.points, mesh.triangles, mesh.quads, 3);
}

const Domain& insideSpot() {
    static const Domain domain = [] {
        constexpr int kDim = 192, kLayer = kDim / 12; // voxels
        const LevelSet narrow = meshToLevelSet(spot(), {.dim = kDim});
        return Domain::of({.sdf = sdfOf(widened(narrow, kLayer + kSplineSupport)),
                           .side = Side::inside,
                           .width = kLayer * narrow.voxelSize()});
    }();
    return domain;
}

Flow flowInSpot(bool walled) {
    const Domain& inside = insideSpot();
    const auto noise = [](uint64_t seed) {
        return noiseField<Psrd3>({.seed = seed}, {.frequency = 2.5, .octaves = 2});
    };
    return withSpeed(walled ? Flow(noise(1), bounded(noise(2), *inside.wall), inside)
                            : Flow(noise(1), noise(2), {.box = inside.box, .wall = std::nullopt}),
                     1);
}

} // namespace curlew::bench
