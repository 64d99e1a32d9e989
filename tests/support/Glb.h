// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "Files.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cstring>
#include <vector>

namespace curlew::test {

/// A binary glTF 2.0 in the making.
class Glb {
  public:
    nlohmann::json root = {{"asset", {{"version", "2.0"}}}, {"scene", 0}, {"scenes", {{{"nodes", {0}}}}}};

    /// Adds numbers and returns their accessor. `type`: SCALAR, VEC3, VEC4 or MAT4.
    int add(const std::vector<float>& numbers, const std::string& type) {
        const size_t parts = type == "SCALAR" ? 1 : type == "VEC3" ? 3 : type == "VEC4" ? 4 : 16;
        nlohmann::json accessor{{"componentType", 5126}, {"type", type}, {"count", numbers.size() / parts}};
        if (type == "SCALAR" || type == "VEC3") {
            std::vector<float> lower(parts, 1e30f), upper(parts, -1e30f);
            for (size_t k = 0; k < numbers.size(); ++k) {
                lower[k % parts] = std::min(lower[k % parts], numbers[k]);
                upper[k % parts] = std::max(upper[k % parts], numbers[k]);
            }
            accessor["min"] = lower;
            accessor["max"] = upper;
        }
        return store(numbers, std::move(accessor));
    }
    int add(const std::vector<uint16_t>& numbers, const std::string& type) {
        return store(numbers,
                     {{"componentType", 5123}, {"type", type}, {"count", numbers.size() / (type == "VEC4" ? 4 : 1)}});
    }

    /// Adds integers, of which the largest stands for 1 if normalized.
    template <class T>
    int addIntegers(const std::vector<T>& numbers, const std::string& type, bool normalized) {
        const int component = 5120 + 2 * (sizeof(T) == 2) + std::is_unsigned_v<T>;
        const size_t parts = type == "VEC3" ? 3 : 4;
        return store(numbers, {{"componentType", component},
                               {"normalized", normalized},
                               {"type", type},
                               {"count", numbers.size() / parts}});
    }

    /// The bytes of all accessors.
    const std::string& binary() const { return mBinary; }

    /// The whole file.
    std::string bytes() const {
        nlohmann::json all = root;
        all["buffers"] = {{{"byteLength", mBinary.size()}}};
        std::string json = all.dump();
        json.resize((json.size() + 3) / 4 * 4, ' ');
        std::string out = "glTF";
        append(out, uint32_t{2});
        append(out, static_cast<uint32_t>(28 + json.size() + mBinary.size()));
        append(out, static_cast<uint32_t>(json.size()));
        out += "JSON" + json;
        append(out, static_cast<uint32_t>(mBinary.size()));
        out += std::string("BIN\0", 4) + mBinary;
        return out;
    }

  private:
    template <class T>
    int store(const std::vector<T>& numbers, nlohmann::json accessor) {
        accessor["bufferView"] = root["bufferViews"].size();
        root["bufferViews"].push_back(
            {{"buffer", 0}, {"byteOffset", mBinary.size()}, {"byteLength", numbers.size() * sizeof(T)}});
        mBinary.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(T));
        mBinary.resize((mBinary.size() + 3) / 4 * 4, '\0');
        root["accessors"].push_back(std::move(accessor));
        return static_cast<int>(root["accessors"].size()) - 1;
    }
    static void append(std::string& out, uint32_t number) {
        std::array<char, 4> raw{};
        std::memcpy(raw.data(), &number, raw.size());
        out.append(raw.data(), raw.size());
    }

    std::string mBinary;
};

/// A bar of 0.4 x 2 x 0.4 that stands on y = 0, in rings at every half; two triangles for each side and end.
struct Bar {
    static constexpr int kRings = 5;
    std::vector<float> points = {};
    std::vector<uint16_t> corners = {};

    Bar() {
        for (int ring = 0; ring < kRings; ++ring)
            for (const auto& [x, z] : {std::pair{-0.2f, -0.2f}, {-0.2f, 0.2f}, {0.2f, 0.2f}, {0.2f, -0.2f}})
                points.insert(points.end(), {x, 0.5f * static_cast<float>(ring), z});
        const auto quad = [&](int a, int b, int c, int d) {
            for (const int corner : {a, b, c, a, c, d}) corners.push_back(static_cast<uint16_t>(corner));
        };
        for (int ring = 0; ring + 1 < kRings; ++ring)
            for (int k = 0; k < 4; ++k)
                quad(4 * ring + k, 4 * ring + (k + 1) % 4, 4 * ring + 4 + (k + 1) % 4, 4 * ring + 4 + k);
        quad(3, 2, 1, 0);
        quad(16, 17, 18, 19);
    }
};

/// The bar with two bones, at y = 0 and y = 1. Below 1 it follows the first, above the second, at 1 half of each. Its
/// clip "bend" turns the second bone about z by a right angle within a second; "sway" turns it there and back within
/// two.
inline Glb bendingBar() {
    const Bar bar;
    Glb glb;
    std::vector<uint16_t> joints;
    std::vector<float> weights;
    for (size_t n = 0; n < bar.points.size() / 3; ++n) {
        const float y = bar.points[3 * n + 1];
        joints.insert(joints.end(), {0, 1, 0, 0});
        weights.insert(weights.end(), {y < 1 ? 1.0f : y > 1 ? 0.0f : 0.5f, y > 1 ? 1.0f : y < 1 ? 0.0f : 0.5f, 0, 0});
    }
    std::vector<float> inverse(32, 0.0f); // the second bone is bound at y = 1
    for (const size_t k : {0, 5, 10, 15, 16, 21, 26, 31}) inverse[k] = 1;
    inverse[16 + 13] = -1;
    const nlohmann::json attributes{{"POSITION", glb.add(bar.points, "VEC3")},
                                    {"JOINTS_0", glb.add(joints, "VEC4")},
                                    {"WEIGHTS_0", glb.add(weights, "VEC4")}};
    glb.root["meshes"] = {
        {{"primitives", {{{"attributes", attributes}, {"indices", glb.add(bar.corners, "SCALAR")}}}}}};
    glb.root["skins"] = {{{"joints", {1, 2}}, {"inverseBindMatrices", glb.add(inverse, "MAT4")}}};
    glb.root["nodes"] = {{{"name", "bar"}, {"mesh", 0}, {"skin", 0}},
                         {{"name", "lower"}, {"children", {2}}},
                         {{"name", "upper"}, {"translation", {0, 1, 0}}}};
    glb.root["scenes"] = {{{"nodes", {0, 1}}}};
    const float root = std::sqrt(0.5f);
    const auto clip = [&](const char* name, const std::vector<float>& times, const std::vector<float>& turns) {
        const nlohmann::json sampler{{"input", glb.add(times, "SCALAR")}, {"output", glb.add(turns, "VEC4")}};
        const nlohmann::json channel{{"sampler", 0}, {"target", {{"node", 2}, {"path", "rotation"}}}};
        glb.root["animations"].push_back({{"name", name}, {"samplers", {sampler}}, {"channels", {channel}}});
    };
    clip("bend", {0, 1}, {0, 0, 0, 1, 0, 0, root, root});
    clip("sway", {0, 1, 2}, {0, 0, 0, 1, 0, 0, root, root, 0, 0, 0, 1});
    return glb;
}

} // namespace curlew::test
