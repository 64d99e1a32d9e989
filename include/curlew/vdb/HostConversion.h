// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Curves.h"
#include "curlew/track/Points.h"
#include "curlew/vdb/GridTypes.h"
#include "curlew/vdb/HostProfile.h"
#include "curlew/vdb/MeshFile.h"

#include <vector>

namespace curlew {

/// The axis of a scene that points up. Scenes are right-handed.
enum class UpAxis { y, z };
inline constexpr std::array<std::string_view, 2> kUpAxisNames{"y", "z"};

/// A change of axes and of the unit of length: component k of the result is sign[k] · scale · component from[k].
struct AxisMap {
    std::array<int, 3> from{0, 1, 2};
    std::array<double, 3> sign{1, 1, 1};
    double scale = 1;

    bool turns() const { return from != std::array{0, 1, 2} || sign != std::array{1.0, 1.0, 1.0}; }
    bool identity() const { return !turns() && scale == 1; }
    /// Returns whether the map turns right-handed axes into left-handed ones.
    bool mirrors() const {
        const bool even = (from[1] + 3 - from[0]) % 3 == 1; // a cyclic permutation
        return (sign[0] * sign[1] * sign[2] > 0) != even;
    }
    /// Returns the map of positions, and of velocities per second.
    template <class Vector>
    Vector operator()(const Vector& v) const {
        using Number = std::remove_cvref_t<decltype(v[0])>;
        Vector result = v;
        for (size_t k = 0; k < 3; ++k)
            result[static_cast<int>(k)] = static_cast<Number>(sign[k] * scale * static_cast<double>(v[from[k]]));
        return result;
    }
};

/// Returns the map from a scene, in metres, to a host's world. From Y up (x, y, z): to (x, -z, y) for Z up, (x, z, y)
/// for Z up left-handed and (-x, y, z) for Y up left-handed, as the hosts' own importers convert glTF and FBX.
AxisMap axesFor(const HostProfile& host, UpAxis up);

struct HostOptions {
    const HostProfile* host = nullptr; ///< Null: axes, names and classes stay as they are.
    UpAxis up = UpAxis::y;             ///< The scene's up axis.
    double velocityScale = 1;          ///< Factor for velocities: 1/fps makes them velocities per frame.
    bool split = false;                ///< Splits vector grids into three grids of their components.
};

/// Return the mesh, points and curves in the host's world. Faces of a mesh keep their outer side.
Mesh forHost(Mesh mesh, const HostOptions& options);
Points forHost(Points points, const HostOptions& options);
Curves forHost(Curves curves, const HostOptions& options);

/// Returns a grid in the host's world, as one grid or as three (`split`). The values of a grid of vectors rotate and
/// scale as vectors, unless followsSpace() is false (colours); vec3d becomes vec3s if they change. Those of a level
/// set, float or double, scale as distances. A velocity grid (vec3s, called vel, v, velocity or by the name of a host)
/// gets the host's name and class. A change of axes becomes part of the grid's transform. Staggered velocities are
/// averaged to voxel centres if the host cannot read them, if the axes change, and if they are split. The given grid is
/// not changed; the result may share its tree. Throws ValueError if `split` is true and the host takes no components,
/// and ResourceError if a copy would not fit in memory. Safe to call from several threads.
std::vector<std::shared_ptr<const openvdb::GridBase>> forHost(const std::shared_ptr<const openvdb::GridBase>& given,
                                                              const HostOptions& options);

/// Returns whether a grid is a velocity by its type and name.
bool isVelocity(const openvdb::GridBase& grid);

/// Returns whether the values of a grid of vectors rotate and scale with it: false if its vector_type is given as
/// invariant, as for colours, except for velocities and staggered grids.
bool followsSpace(const openvdb::GridBase& grid);

/// Returns a copy of a staggered grid with the velocities at voxel centres: the mean of the two faces along each axis.
/// The same voxels are active. Upper faces that the grid lacks are at rest if the voxel is divergence-free then, at a
/// wall; else, in the last layer of a box, they move as the lower ones do.
std::shared_ptr<openvdb::Vec3SGrid> collocated(const openvdb::Vec3SGrid& staggered);

} // namespace curlew
