// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/vdb/MeshFile.h"

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace curlew {

struct ModelData;

/// How a clip continues after its last key.
enum class ClipEnd {
    automatic, ///< `loop` if the clip ends in the pose in which it begins, otherwise `hold`.
    loop,
    hold,
};
inline constexpr std::array<std::string_view, 3> kClipEndNames{"auto", "loop", "hold"};

/// The pose of an animated mesh: a time of one of its clips.
struct MeshPose {
    std::optional<size_t> clip = 0; ///< nullopt: the rest pose, in which the file's nodes place the mesh without a
                                    ///< clip.
    double seconds = 0;             ///< Since the clip's first key. If negative, the clip shows its first pose.
    ClipEnd end = ClipEnd::automatic;
};

/// The mesh of a .gltf, .glb, .fbx or .dae file, animated by its clips: node transforms, linear blend skinning and
/// morph targets. Units are metres, Y is up. Keys are interpolated linearly, rotations along the great circle (slerp;
/// Shoemake 1985).
///
/// All poses have the same points in the same order, and the same faces. Points are joined and polygons are cut once,
/// without a clip. Two points are joined only if they coincide in every pose. Immutable; safe to use from several
/// threads.
class AnimatedMesh {
  public:
    /// Reads a model file. Throws FileError, ResourceError and Interrupted as importModel() does.
    static AnimatedMesh read(const std::filesystem::path& path, const std::function<bool()>& cancelled = {});
    explicit AnimatedMesh(ModelData data);

    /// Returns whether a file may hold clips, without importing it. A .fbx or .dae may turn out to have none.
    static bool mayMove(const std::filesystem::path& path);

    struct Clip {
        std::string name;
        double seconds; ///< From the first key to the last.
        bool cyclic;    ///< The last pose equals the first to within a thousandth of the mesh's size.
    };
    const std::vector<Clip>& clips() const { return mClips; }
    /// Returns the index of the clip with this name, or with this number, counted from 0. Throws ValueError, listing
    /// the clips of the file, if there is none.
    size_t clip(const std::string& nameOrNumber) const;

    /// The units and axes that the file declares, such as "centimetres, Z up".
    const std::string& units() const;

    /// Returns the time within the clip that a pose shows, from 0 to the clip's length.
    double timeIn(const MeshPose& pose) const;
    /// Returns the mesh in a pose. If the file has no clips, every pose is the rest pose. Throws ValueError if the clip
    /// does not exist, or if a position is not finite.
    Mesh at(const MeshPose& pose) const;

  private:
    std::vector<openvdb::Vec3s> pointsAt(const MeshPose& pose) const;

    std::shared_ptr<const ModelData> mData;
    Mesh mMesh;                     ///< In the rest pose.
    std::vector<uint32_t> mSources; ///< For each point of the mesh, its index among the points of all parts of the
                                    ///< file.
    std::vector<Clip> mClips;
};

} // namespace curlew
