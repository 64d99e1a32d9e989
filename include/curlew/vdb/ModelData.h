// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openvdb/Types.h>
#include <openvdb/math/Quat.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace curlew {

/// The content of a model file as plain data: nodes that place parts, skins and morph targets that deform the parts,
/// and clips that animate both. Matrices follow OpenVDB's convention: a position is a row vector, p' = p M. Metres, Y
/// up.
struct ModelData {
    struct Node {
        std::string name;
        std::optional<uint32_t> parent; ///< Index of a preceding node; nullopt for the root.
        openvdb::Mat4d local;           ///< Transform from the node's space to its parent's, without a clip.
    };

    /// The weight of a bone for a point.
    struct Influence {
        uint32_t bone;
        double weight;
    };
    struct Bone {
        uint32_t node;
        openvdb::Mat4d offset; ///< Transform from the part's space to the bone's, in the bind pose.
    };
    struct MorphTarget {
        double weight; ///< Weight without a clip.
        std::vector<openvdb::Vec3s> offsets;
    };

    /// A set of faces that one node places.
    struct Part {
        uint32_t node;
        std::vector<openvdb::Vec3s> points;
        std::vector<uint32_t> corners, sizes; ///< Faces, as in Polygons.
        std::vector<Bone> bones;              ///< Empty if the part is rigid.
        std::vector<Influence> influences;    ///< Influences of all points, one point after another.
        std::vector<size_t> firstInfluence;   ///< Index of each point's first influence, and the end; empty if the part
                                              ///< is rigid.
        std::vector<MorphTarget> targets;
    };

    /// Values at non-decreasing times in seconds.
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
        Keys<std::vector<double>> weights; ///< One weight per target.
    };
    struct Clip {
        std::string name;
        double begin = 0, end = 0; ///< First and last time of the keys, in seconds.
        std::vector<NodeChannel> nodes;
        std::vector<MorphChannel> morphs;
    };

    std::vector<Node> nodes;
    std::vector<Part> parts;
    std::vector<Clip> clips;
    std::string units; ///< The units and axes that the file declares, such as "centimetres, Z up".
};

/// Returns whether all indices are in range, arrays that belong together have the same length, parents precede their
/// children, keys are sorted and positions are finite. Data from importModel() always is consistent; data from another
/// process may not be.
bool isConsistent(const ModelData& data);

/// Reads a .gltf, .glb, .fbx or .dae. Depends on Assimp and nothing else, so it can run in another process. Throws
/// FileError, naming the file, if it is missing, damaged or without faces, if it requires an unsupported feature, or if
/// a coordinate is not a finite number; ResourceError if the model would not fit in memory; Interrupted once
/// `cancelled` returns true.
ModelData importModel(const std::filesystem::path& path, const std::function<bool()>& cancelled = {});

/// Returns whether a model file may hold clips, by searching its text. The answer is exact for .gltf and .glb; a .fbx
/// or .dae may turn out to have none. Returns false if the file cannot be read.
bool mayBeAnimated(const std::filesystem::path& path);

} // namespace curlew
