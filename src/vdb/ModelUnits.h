// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "MeshParser.h"
#include "curlew/vdb/ModelData.h"

#include <assimp/scene.h>

namespace curlew {

/// The length unit and the axes of a model file.
struct ModelUnits {
    std::string text;                   ///< As the file declares them, such as "centimetres, Z up".
    std::optional<openvdb::Mat4d> root; ///< Transform of the root node to metres with Y up, if Assimp has not applied
                                        ///< it.
};

/// Returns the units of a scene. `ending` is .gltf, .glb, .fbx or .dae. For an .fbx, `root` is the whole transform of
/// the root node.
ModelUnits unitsOf(const aiScene& scene, const std::string& ending);

/// Throws FileError if a glTF requires an unsupported extension that changes its geometry.
void checkExtensions(const std::filesystem::path& path, const MeshSource& source);

/// Throws FileError if an integer list of a .dae contains anything else, on which Assimp 5.2 would loop forever.
void checkLists(const std::filesystem::path& path, const MeshSource& source);

} // namespace curlew
