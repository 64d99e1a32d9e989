// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "MeshParser.h"

#include <assimp/Importer.hpp>

namespace curlew {

/// Returns the JSON of a glTF: the whole file, or the first chunk of a .glb (Khronos, glTF 2.0, 4.4).
std::string gltfJson(const std::filesystem::path& path);

/// Lets Assimp read positions, skin weights and animations that a glTF stores as integers (glTF 2.0, 3.6.2.2, and
/// KHR_mesh_quantization). Assimp 5.2 to 5.4 copy the bytes of these integers into floats; weights in bytes then bind
/// each point to its first joint only. If the file has such numbers, the importer is given a copy of the file in which
/// they are floats. Throws FileError if the numbers are not in the file, or its JSON is nested too deeply.
void readIntegersAsFloats(Assimp::Importer& importer, const std::filesystem::path& path, const MeshSource& source);

} // namespace curlew
