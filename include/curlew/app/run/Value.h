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
#include "curlew/vdb/LevelSet.h"

#include <memory>
#include <variant>

namespace curlew::app {

struct FieldValue {
    AnyField field;
    std::optional<AnySdf> sdf = {};    ///< If the field is a signed distance.
    std::optional<AnyWall> wall = {};  ///< If the field conforms to one.
    std::optional<AnyField> free = {}; ///< The noise that was made to conform to it.
    std::string program = {};          ///< What made it, as text; filled in after the action has run.
};

struct GridValue;

/// A level set of a body that moves without changing its form: as it was made in the first frame, and where that is
/// now.
struct RigidBody {
    std::shared_ptr<const GridValue> first;
    Pose home = {}, now = {};
};

struct GridValue {
    openvdb::GridBase::ConstPtr grid;
    std::shared_ptr<const Mesh> mesh = {}; ///< If the grid is a level set of one.
    /// Between two frames: the level set of the earlier one, and which part of the way it has gone from there to this
    /// one.
    std::shared_ptr<const GridValue> earlier = {};
    double part = 1;
    /// What stands for the grid as a distance, if it is a level set of a mesh that moves as a rigid body.
    std::optional<RigidBody> body = {};
};

/// The flow that points carry the track of (their f and g).
struct TrackedFlow {
    Digest identity = {};
    int frame = -1; ///< In which it was made; -1: before the frames.
    std::shared_ptr<const AnyFlow> flow = {};
};

struct PointSet {
    Points particles = {};
    TrackedFlow tracked = {};
    int64_t nextId = 0; ///< Of the next point that -emit adds; 0 before its first.
};

/// A picture, with how its first channel is shown in colour.
struct ImageValue {
    Image image;
    ColorMap map = ColorMap::viridis;
    std::optional<Camera> camera = {}; ///< Of a picture in perspective.
};

using MeshPointer = std::shared_ptr<const Mesh>;
using PointsPointer = std::shared_ptr<PointSet>; ///< Shared ones are never written to.
using CurvesPointer = std::shared_ptr<const Curves>;

/// An object: what an action takes or makes. Cheap to copy, but for images.
using Value = std::variant<std::monostate, FieldValue, AnyFlow, GridValue, MeshPointer, PointsPointer, CurvesPointer,
                           std::shared_ptr<const ImageValue>>;

/// What kind of object a value is.
Kind kindOf(const Value& value);
/// What is in it: a shape, level set, mesh, points or curves; the wall of a field, the domain of a flow. World units;
/// nullopt if it is infinite or empty, and for other values.
std::optional<Box> boxOf(const Value& value);

} // namespace curlew::app
