// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Curves.h"
#include "curlew/track/Points.h"
#include "curlew/vdb/GridTypes.h"

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace curlew {

// Writers of .usda, the text form of OpenUSD layers (openusd.org). A layer holds one prim, the default prim, named
// after the file. All functions write atomically, throw FileError as writeAtomically() does and Interrupted once
// `cancelled` returns true, and are safe to call from several threads.

/// Metadata of a layer.
struct UsdOptions {
    std::optional<double> fps = {}; ///< Frames per second; nullopt: a layer without time.
    double first = 1, last = 1;     ///< The frames of the sequence, if there is one.
    bool zUp = false;               ///< The up axis is Z instead of Y.
    double metresPerUnit = 1;
};

/// Points or curves at a frame; without time, the frame is ignored.
template <class Geometry>
struct UsdSample {
    double frame = 1;
    std::shared_ptr<const Geometry> geometry;
};

/// Writes a Points prim: points, velocities (world units per second), ids, a constant width (a quarter of the
/// distance between neighbours if the points of the first sample filled their box evenly, 0.01 if there are none;
/// change it in the host) and the primvars age, life, fade, f and g. With time, all of them are time samples. Throws
/// ValueError if arrays differ in length, a position or velocity is not finite, or there is no sample.
void writeUsda(const std::filesystem::path& path, const std::vector<UsdSample<Points>>& samples,
               const UsdOptions& options = {}, const std::function<bool()>& cancelled = {});

/// Writes an Xform with one BasisCurves prim for the open curves, `open`, and one for the closed curves, `closed`:
/// linear curves with points, velocities, a constant width, the primvar id per curve, and f and g per vertex. Curves
/// without vertices are omitted. Throws as above.
void writeUsda(const std::filesystem::path& path, const std::vector<UsdSample<Curves>>& samples,
               const UsdOptions& options = {}, const std::function<bool()>& cancelled = {});

/// A .vdb file that holds the grids of a volume at a frame.
struct UsdAsset {
    double frame = 1;
    std::filesystem::path file;
};

/// Writes a Volume prim with one OpenVDBAsset per grid: fieldName, fieldClass, fieldDataType, for vectors
/// vectorDataRoleHint = "Vector", and filePath, with time samples if there is time. Paths are relative to the layer's
/// folder. The grids are those of one frame: all frames must have grids of the same names, types and classes. Throws
/// ValueError if there are no grids or no assets, if two grids share a name, or if a grid's type has no name in USD.
void writeUsda(const std::filesystem::path& path, const std::vector<std::shared_ptr<const openvdb::GridBase>>& grids,
               const std::vector<UsdAsset>& assets, const UsdOptions& options = {},
               const std::function<bool()>& cancelled = {});

} // namespace curlew
