// SPDX-License-Identifier: Apache-2.0
#include "ModelUnits.h"

#include "GltfFloats.h"
#include "curlew/base/LocalFile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>

namespace curlew {

namespace {

using openvdb::Mat4d;

std::string unitName(double metres) {
    struct Unit {
        double metres;
        const char* name;
    };
    constexpr std::array<Unit, 6> kUnits{{{1, "metres"},
                                          {0.01, "centimetres"},
                                          {0.001, "millimetres"},
                                          {0.0254, "inches"},
                                          {0.3048, "feet"},
                                          {0.9144, "yards"}}};
    for (const Unit& unit : kUnits)
        if (std::abs(metres / unit.metres - 1) < 1e-4) return unit.name;
    return fmt::format("units of {:.4g} m", metres);
}

/// Returns the matrix that rotates the up axis to Y and scales. The frame stays right-handed.
Mat4d upright(int axis, double scale) {
    Mat4d matrix = Mat4d::identity();
    matrix.setMat3(axis == 0   ? openvdb::Mat3d(0., 1., 0., -1., 0., 0., 0., 0., 1.) * scale
                   : axis == 2 ? openvdb::Mat3d(1., 0., 0., 0., 0., -1., 0., 1., 0.) * scale
                               : openvdb::Mat3d::identity() * scale);
    return matrix;
}

ModelUnits textOf(double metres, int up) {
    return {.text = fmt::format("{}, {} up", unitName(metres), "XYZ"[up]), .root = {}};
}

/// UnitScaleFactor is in centimetres (Autodesk, FBX SDK, FbxSystemUnit).
ModelUnits fbxUnits(const aiScene& scene) {
    float single = 1;
    double centimetres = 1;
    int32_t up = 1;
    if (const aiMetadata* about = scene.mMetaData) {
        if (about->Get("UnitScaleFactor", single)) centimetres = static_cast<double>(single);
        about->Get("UnitScaleFactor", centimetres);
        about->Get("UpAxis", up);
    }
    if (!(centimetres > 0) || !std::isfinite(centimetres)) centimetres = 1;
    if (up < 0 || up > 2) up = 1;
    ModelUnits units = textOf(centimetres / 100, up);
    units.root = upright(up, centimetres / 100);
    return units;
}

/// Reads the unit and axes of a COLLADA file from the root node, where Assimp has applied them.
ModelUnits colladaUnits(const aiScene& scene) {
    const aiMatrix4x4& m = scene.mRootNode->mTransformation;
    const std::array<double, 3> towardsY{std::abs(double(m.b1)), std::abs(double(m.b2)), std::abs(double(m.b3))};
    const auto up = std::max_element(towardsY.begin(), towardsY.end()) - towardsY.begin();
    return textOf(std::cbrt(std::abs(double(m.Determinant()))), static_cast<int>(up));
}

/// Returns the text between the brackets of a JSON list; empty if the list is missing or empty.
std::string_view listIn(std::string_view text, std::string_view name) {
    size_t at = text.find(fmt::format("\"{}\"", name));
    if (at == std::string_view::npos) return {};
    at = text.find_first_not_of(" \t\r\n:", at + name.size() + 2);
    if (at == std::string_view::npos || text[at] != '[') return {};
    const std::string_view list = text.substr(at + 1, text.find(']', at) - at - 1);
    return list.find_first_not_of(" \t\r\n") == std::string_view::npos ? std::string_view() : list;
}

} // namespace

ModelUnits unitsOf(const aiScene& scene, const std::string& ending) {
    if (ending == ".fbx") return fbxUnits(scene);
    if (ending == ".dae") return colladaUnits(scene);
    return textOf(1, 1); // Khronos, glTF 2.0, 3.4
}

void checkExtensions(const std::filesystem::path& path, const MeshSource& source) {
    if (const std::string ending = endingOf(path); ending != ".gltf" && ending != ".glb") return;
    const std::string json = gltfJson(path);
    const std::string_view required = listIn(json, "extensionsRequired");
    for (const char* extension : {"EXT_meshopt_compression", "KHR_meshopt_compression"})
        if (required.find(extension) != std::string_view::npos)
            throw source.error(fmt::format(
                "it needs the glTF extension {}, which is not supported; export it without that extension", extension));
}

void checkLists(const std::filesystem::path& path, const MeshSource& source) {
    if (endingOf(path) != ".dae") return;
    const std::string text = contentOf(path);
    for (const std::string_view tag : {"<p>", "<vcount>"})
        for (size_t at = text.find(tag); at != std::string::npos; at = text.find(tag, at + 1)) {
            const std::string_view rest = std::string_view(text).substr(at + tag.size());
            if (rest.substr(0, rest.find('<')).find_first_not_of("0123456789 \t\r\n") != std::string_view::npos)
                throw source.error(
                    fmt::format("its list {} has an entry that is not a whole number; it is damaged", tag));
        }
}

bool mayBeAnimated(const std::filesystem::path& path) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error)) return false; // the reader reports what is wrong
    const std::string ending = endingOf(path);
    if (ending == ".gltf" || ending == ".glb") return !listIn(gltfJson(path), "animations").empty();
    std::ifstream in(path, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    return text.find(ending == ".fbx" ? "AnimationCurve" : "<animation") != std::string::npos;
}

} // namespace curlew
