// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Isolated.h"
#include "curlew/picture/Image.h"
#include "curlew/track/Points.h"
#include "curlew/vdb/AnimatedMesh.h"

#include <openvdb/Grid.h>

#include <filesystem>
#include <string>
#include <variant>
#include <vector>

namespace curlew::app {

/// What a .vdb file holds, in the order of the file: points are read, other grids stay grids.
struct VdbContent {
    std::string name;
    std::variant<openvdb::GridBase::Ptr, Points> value;
};

/// Points are read by another process if readsIsolated(). Files without points are walked whole before OpenVDB reads
/// them, and are read in this process. Throws as readVdb(),
/// pointsOf() and readIsolated().
std::vector<VdbContent> readVdbContent(const std::filesystem::path& path, const Monitor& monitor);

/// By another process if readsIsolated(). Throws as readExr() and readIsolated().
Image readExrImage(const std::filesystem::path& path, const Monitor& monitor);

/// A .gltf, .glb, .fbx or .dae. Assimp reads it, in another process if readsIsolated(). Throws as AnimatedMesh::read()
/// and readIsolated().
AnimatedMesh readModel(const std::filesystem::path& path, const Monitor& monitor);

/// The readers of the other process, by name; null if there is none of that name.
IsolatedReader isolatedReaderOf(const std::string& name);

} // namespace curlew::app
