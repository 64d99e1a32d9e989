// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Action.h"
#include "curlew/app/run/AnyField.h"
#include "curlew/base/Digest.h"
#include "curlew/picture/ColorMap.h"
#include "curlew/picture/Image.h"
#include "curlew/render/Camera.h"
#include "curlew/track/Curves.h"
#include "curlew/track/Points.h"
#include "curlew/vdb/GridTypes.h"
#include "curlew/vdb/LevelSet.h"

#include <memory>
#include <variant>

namespace curlew::app {

/// Where the values of a grid determine a field.
struct SampledRegion {
    Box box;           ///< Of the active voxels.
    double voxel;      ///< Their size.
    double background; ///< The value beyond them, which the field reaches within 2 voxels. NaN: unknown.
};

struct FieldValue {
    AnyField field;
    std::optional<AnySdf> sdf = {};            ///< Set if the field is a signed distance.
    std::optional<AnyWall> wall = {};          ///< Set if the field conforms to a wall.
    std::optional<AnyField> free = {};         ///< The noise before it was made to conform to the wall.
    std::string program = {};                  ///< The program text that made the field; set after the action has run.
    std::optional<SampledRegion> sampled = {}; ///< Set if the field is a grid.
};

/// Returns the region of a field: the box of a shape or of a grid. Nothing if it is everywhere.
std::optional<Box> regionOf(const FieldValue& field);

/// Returns the region to search for an isosurface of a field: that of a shape, padded, or of a grid. Beyond a grid, the
/// surface may lie between its values and the background, unless that has the value `iso` itself.
std::optional<Box> regionOfSurface(const FieldValue& field, double iso);

std::optional<SampledRegion> sampledRegionOf(const openvdb::GridBase& grid);

/// Returns a shape as a field.
inline FieldValue fieldOfShape(const AnySdf& shape) {
    return {std::visit([](const auto& sdf) -> AnyField { return sdf.distance; }, shape), shape};
}

struct GridValue;

/// A level set of a rigid body: as made in the first frame, with the body's pose then and now.
struct RigidBody {
    std::shared_ptr<const GridValue> first;
    Pose home = {}, now = {};
};

/// Where -move has placed a level set.
struct PlacedGrid {
    std::shared_ptr<const openvdb::GridBase> original;
    Pose pose = {};
    double scale = 1;
};

struct GridValue {
    std::shared_ptr<const openvdb::GridBase> grid;
    std::shared_ptr<const Mesh> mesh = {}; ///< Set if the grid is a level set of a mesh.
    std::optional<PlacedGrid> placed = {}; ///< Set if the grid is a level set that -move has placed.
    /// Between two frames: the grid of the earlier frame, and the fraction of the interval between the frames that has
    /// passed.
    std::shared_ptr<const GridValue> earlier = {};
    double part = 1;
    /// Set if the grid is a level set that moves as a rigid body, by itself or as its mesh does. Distances are then
    /// computed from it instead of the grid.
    std::optional<RigidBody> body = {};
};

/// The flow whose track (f and g) the points carry.
struct TrackedFlow {
    Digest identity = {};
    int frame = -1; ///< The frame in which the flow was made; -1: before the frames.
    std::shared_ptr<const AnyFlow> flow = {};
};

struct PointSet {
    Points particles = {};
    TrackedFlow tracked = {};
    int64_t nextId = 0; ///< The id of the next point that -emit adds; 0 before its first point.
    /// Set for points of more than 3 dimensions, which have positions only. `particles` is then empty.
    std::optional<AnyPositions> positionsN = {};

    size_t size() const { return positionsN ? sizeOf(*positionsN) : particles.size(); }
};

/// An image, and the colour map for its first channel.
struct ImageValue {
    Image image;
    ColorMap map = ColorMap::viridis;
    std::optional<Camera> camera = {}; ///< Set for an image in perspective.
};

using MeshPointer = std::shared_ptr<const Mesh>;
using PointsPointer = std::shared_ptr<PointSet>; ///< A shared set is never modified.
using CurvesPointer = std::shared_ptr<const Curves>;

/// The value of an object. Cheap to copy.
using Value = std::variant<std::monostate, FieldValue, AnyFlow, GridValue, MeshPointer, PointsPointer, CurvesPointer,
                           std::shared_ptr<const ImageValue>>;

/// Returns the kind of object that a value is.
Kind kindOf(const Value& value);
/// Returns the bounding box of a shape, level set, mesh, points or curves, of the wall of a field, or of the domain of
/// a flow, in world units. Returns nullopt if the box is infinite or empty, and for other values.
std::optional<Box> boxOf(const Value& value);

} // namespace curlew::app
