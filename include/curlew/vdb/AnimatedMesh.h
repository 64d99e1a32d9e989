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

/// What a clip does after its last key.
enum class ClipEnd {
    automatic, ///< It begins again if it ends in the pose in which it begins, otherwise it stays.
    loop,
    hold,
};
inline constexpr std::array<std::string_view, 3> kClipEndNames{"auto", "loop", "hold"};

/// A moment of an animated mesh.
struct MeshPose {
    std::optional<size_t> clip = 0; ///< nullopt: as the file's nodes place it without one.
    double seconds = 0;             ///< Since the clip's first key; before it, the clip stays in its first pose.
    ClipEnd end = ClipEnd::automatic;
};

/// The mesh of a .gltf, .glb, .fbx or .dae file as its clips move it: nodes with their transforms, linear blend skins
/// and morph targets, in metres with Y up. Keys are blended linearly, rotations along the great circle (Shoemake 1985).
///
/// All poses have the same points in the same order, and the same faces: what is joined or cut is decided without a
/// clip, and points are joined only if they can never part. Immutable; safe to use from several threads.
class AnimatedMesh {
  public:
    /// Throws as importModel() (FileError, ResourceError, Interrupted).
    static AnimatedMesh read(const std::filesystem::path& path, const std::function<bool()>& cancelled = {});
    explicit AnimatedMesh(ModelData data);

    /// Whether a file may hold clips, told without reading all of it; a .fbx or .dae may turn out to have none.
    static bool mayMove(const std::filesystem::path& path);

    struct Clip {
        std::string name;
        double seconds; ///< From its first key to its last.
        bool cyclic;    ///< It ends as it begins, to within a thousandth of the mesh's size.
    };
    const std::vector<Clip>& clips() const { return mClips; }
    /// The clip of that name, or of that number, the first being 0. Throws ValueError with the names that there are.
    size_t clip(const std::string& nameOrNumber) const;

    /// What the file says of its units and axes: "centimetres, Z up".
    const std::string& units() const;

    /// The time, from 0 to the length of the clip, that a pose shows.
    double timeIn(const MeshPose& pose) const;
    /// Throws ValueError if there is no such clip, or if a pose makes a position that is not finite. A pose without a
    /// clip is that of a file that has none.
    Mesh at(const MeshPose& pose) const;

  private:
    std::vector<openvdb::Vec3s> pointsAt(const MeshPose& pose) const;

    std::shared_ptr<const ModelData> mData;
    Mesh mMesh;                     ///< Without a clip.
    std::vector<uint32_t> mSources; ///< Of each point of the mesh, the point of the file, all parts in a row.
    std::vector<Clip> mClips;
};

} // namespace curlew
