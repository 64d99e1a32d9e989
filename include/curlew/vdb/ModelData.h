// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openvdb/math/Mat4.h>
#include <openvdb/math/Quat.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace curlew {

/// What a model file holds, as plain data: nodes that place parts, which skins and morph targets deform, and clips that
/// move them. Matrices are as in OpenVDB: a position is a row vector, p' = p M. Metres, Y up.
struct ModelData {
    struct Node {
        std::string name;
        std::optional<uint32_t> parent; ///< A node before this one; none for the root.
        openvdb::Mat4d local;           ///< From its own space to its parent's, as it is without a clip.
    };

    /// The share of a bone in the position of a point.
    struct Influence {
        uint32_t bone;
        double weight;
    };
    struct Bone {
        uint32_t node;
        openvdb::Mat4d offset; ///< From the space of the part to that of the bone, in the pose of binding.
    };
    struct MorphTarget {
        double weight; ///< Without a clip.
        std::vector<openvdb::Vec3s> offsets;
    };

    /// The faces that one node places.
    struct Part {
        uint32_t node;
        std::vector<openvdb::Vec3s> points;
        std::vector<uint32_t> corners, sizes; ///< Of faces, as in Polygons.
        std::vector<Bone> bones;              ///< None if the part is rigid.
        std::vector<Influence> influences;    ///< Point by point.
        std::vector<size_t> firstInfluence;   ///< Of each point, and the end; empty if the part is rigid.
        std::vector<MorphTarget> targets;
    };

    /// Values at times, seconds, which do not decrease.
    template <class T>
    struct Keys {
        std::vector<double> times;
        std::vector<T> values;
    };
    struct NodeChannel {
        uint32_t node;
        Keys<openvdb::Vec3d> translation;
        Keys<openvdb::math::Quatd> rotation;
        Keys<openvdb::Vec3d> scale;
    };
    struct MorphChannel {
        uint32_t part;
        Keys<std::vector<double>> weights; ///< One for each target.
    };
    struct Clip {
        std::string name;
        double begin = 0, end = 0; ///< Of its keys, seconds.
        std::vector<NodeChannel> nodes;
        std::vector<MorphChannel> morphs;
    };

    std::vector<Node> nodes;
    std::vector<Part> parts;
    std::vector<Clip> clips;
    std::string units; ///< What the file says of its units and axes: "centimetres, Z up".
};

/// Whether all indices are in range, all arrays that belong together have the same length, parents come before their
/// children, keys are in order, and positions are finite. importModel() returns nothing else; data from another process
/// may be anything.
bool isConsistent(const ModelData& data);

/// Reads a .gltf, .glb, .fbx or .dae, by Assimp and nothing else: this function can run in another process. Throws
/// FileError, naming the file, if it is missing, damaged or without faces, if it needs something that is not read, or
/// if a coordinate is not a finite number; ResourceError if it would not fit into memory; Interrupted once `cancelled`
/// says so.
ModelData importModel(const std::filesystem::path& path, const std::function<bool()>& cancelled = {});

/// Whether a model file may hold clips, by its text alone: of .gltf and .glb that is exact; a .fbx or .dae may turn out
/// to have none. False if it cannot be read.
bool mayBeAnimated(const std::filesystem::path& path);

} // namespace curlew
