// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/ModelData.h"

#include <algorithm>
#include <cmath>

namespace curlew {

namespace {

bool finite(double value) { return std::isfinite(value); }

bool finite(const openvdb::Mat4d& matrix) {
    return std::all_of(matrix.asPointer(), matrix.asPointer() + 16, [](double value) { return std::isfinite(value); });
}

bool finite(const std::vector<openvdb::Vec3s>& vectors) {
    return std::all_of(vectors.begin(), vectors.end(), [](const auto& v) { return v.isFinite(); });
}

template <class T>
bool consistent(const ModelData::Keys<T>& keys) {
    return !keys.times.empty() && keys.times.size() == keys.values.size() &&
           std::is_sorted(keys.times.begin(), keys.times.end()) &&
           std::all_of(keys.times.begin(), keys.times.end(), [](double time) { return finite(time); });
}

bool facesConsistent(const ModelData::Part& part) {
    size_t corners = 0;
    for (const uint32_t size : part.sizes) {
        if (size < 3 || size > part.corners.size() - corners) return false;
        corners += size;
    }
    return !part.sizes.empty() && corners == part.corners.size() &&
           std::all_of(part.corners.begin(), part.corners.end(),
                       [&](uint32_t corner) { return corner < part.points.size(); });
}

bool skinConsistent(const ModelData::Part& part, size_t nodes) {
    if (part.bones.empty()) return part.influences.empty() && part.firstInfluence.empty();
    const auto& first = part.firstInfluence;
    return first.size() == part.points.size() + 1 && first.front() == 0 && std::is_sorted(first.begin(), first.end()) &&
           first.back() == part.influences.size() &&
           std::all_of(part.bones.begin(), part.bones.end(),
                       [&](const auto& bone) { return bone.node < nodes && finite(bone.offset); }) &&
           std::all_of(part.influences.begin(), part.influences.end(), [&](const auto& influence) {
               return influence.bone < part.bones.size() && finite(influence.weight) && influence.weight > 0;
           });
}

bool consistent(const ModelData::Part& part, size_t nodes) {
    return part.node < nodes && finite(part.points) && facesConsistent(part) && skinConsistent(part, nodes) &&
           std::all_of(part.targets.begin(), part.targets.end(), [&](const auto& target) {
               return finite(target.weight) && target.offsets.size() == part.points.size();
           });
}

bool consistent(const ModelData::Clip& clip, const ModelData& data) {
    const auto nodeChannel = [&](const ModelData::NodeChannel& channel) {
        return channel.node < data.nodes.size() && consistent(channel.translation) && consistent(channel.rotation) &&
               consistent(channel.scale);
    };
    const auto morphChannel = [&](const ModelData::MorphChannel& channel) {
        if (channel.part >= data.parts.size() || !consistent(channel.weights)) return false;
        const size_t targets = data.parts[channel.part].targets.size();
        return std::all_of(channel.weights.values.begin(), channel.weights.values.end(),
                           [&](const auto& weights) { return weights.size() == targets; });
    };
    return finite(clip.begin) && finite(clip.end) && clip.begin <= clip.end &&
           std::all_of(clip.nodes.begin(), clip.nodes.end(), nodeChannel) &&
           std::all_of(clip.morphs.begin(), clip.morphs.end(), morphChannel);
}

} // namespace

bool isConsistent(const ModelData& data) {
    if (data.nodes.empty() || data.parts.empty()) return false;
    for (size_t k = 0; k < data.nodes.size(); ++k) {
        const ModelData::Node& node = data.nodes[k];
        if (!finite(node.local) || (node.parent && *node.parent >= k)) return false;
    }
    return std::all_of(data.parts.begin(), data.parts.end(),
                       [&](const auto& part) { return consistent(part, data.nodes.size()); }) &&
           std::all_of(data.clips.begin(), data.clips.end(), [&](const auto& clip) { return consistent(clip, data); });
}

} // namespace curlew
