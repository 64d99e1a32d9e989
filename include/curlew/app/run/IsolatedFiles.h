// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Isolated.h"
#include "curlew/picture/Image.h"
#include "curlew/track/Points.h"
#include "curlew/vdb/AnimatedMesh.h"
#include "curlew/vdb/GridTypes.h"

#include <filesystem>
#include <string>
#include <variant>
#include <vector>

namespace curlew::app {

/// An object of a .vdb file. Point grids are converted to Points; other grids are kept.
struct VdbContent {
    std::string name;
    std::variant<std::shared_ptr<openvdb::GridBase>, Points> value;
};

/// Returns the objects of a .vdb file, in its order. If readsIsolated(), files with points are read by another process.
/// Files without points are read in this process, after their whole structure was validated. Throws as readVdb(),
/// pointsOf() and readIsolated().
std::vector<VdbContent> readVdbContent(const std::filesystem::path& path, const Monitor& monitor);

/// Returns the grids of a .nvdb file; read by another process if readsIsolated(). Throws as readNano() and
/// readIsolated().
std::vector<VdbContent> readNanoContent(const std::filesystem::path& path, const Monitor& monitor);

/// Reads an image; in another process if readsIsolated(). Throws as readExr() and readIsolated().
Image readExrImage(const std::filesystem::path& path, const Monitor& monitor);

/// Reads a .gltf, .glb, .fbx or .dae with Assimp; in another process if readsIsolated(). Throws as AnimatedMesh::read()
/// and readIsolated().
AnimatedMesh readModel(const std::filesystem::path& path, const Monitor& monitor);

/// Returns the reader with this name, for the other process; null if there is none.
IsolatedReader isolatedReaderOf(const std::string& name);

} // namespace curlew::app
