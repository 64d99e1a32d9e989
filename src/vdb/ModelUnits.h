// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "MeshParser.h"
#include "curlew/vdb/ModelData.h"

#include <assimp/scene.h>

namespace curlew {

/// The lengths and axes of a model file.
struct ModelUnits {
    std::string text;                   ///< As the file has them: "centimetres, Z up".
    std::optional<openvdb::Mat4d> root; ///< What makes them metres with Y up, if Assimp has not.
};

/// `ending`: .gltf, .glb, .fbx or .dae. Of an .fbx the result is the whole transform of the root node.
ModelUnits unitsOf(const aiScene& scene, const std::string& ending);

/// Throws FileError if a glTF needs an extension without which its geometry means something else.
void checkExtensions(const std::filesystem::path& path, const MeshSource& source);

/// Throws FileError if a list of whole numbers of a .dae has something else, at which Assimp 5.2 would never end.
void checkLists(const std::filesystem::path& path, const MeshSource& source);

} // namespace curlew
