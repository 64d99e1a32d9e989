// SPDX-License-Identifier: Apache-2.0
#include "ModelPose.h"

#include <algorithm>
#include <cmath>

namespace curlew {

namespace {

using openvdb::Mat4d;
using openvdb::math::Quatd;

openvdb::Vec3d blend(const openvdb::Vec3d& a, const openvdb::Vec3d& b, double part) { return a + (b - a) * part; }

/// Takes the shorter arc: q and -q are the same rotation.
Quatd blend(const Quatd& a, const Quatd& b, double part) {
    return openvdb::math::slerp(a, a.dot(b) < 0 ? b * -1.0 : b, part);
}

std::vector<double> blend(const std::vector<double>& a, const std::vector<double>& b, double part) {
    std::vector<double> result(a.size());
    for (size_t k = 0; k < a.size(); ++k) result[k] = a[k] + (b[k] - a[k]) * part;
    return result;
}

/// Interpolates keys. Before the first and after the last key, the value is constant.
template <class T>
T valueAt(const ModelData::Keys<T>& keys, double time) {
    const auto next = std::upper_bound(keys.times.begin(), keys.times.end(), time);
    const auto n = static_cast<size_t>(next - keys.times.begin());
    if (n == 0) return keys.values.front();
    if (n == keys.times.size()) return keys.values.back();
    return blend(keys.values[n - 1], keys.values[n], (time - keys.times[n - 1]) / (keys.times[n] - keys.times[n - 1]));
}

Mat4d matrixAt(const ModelData::NodeChannel& channel, double time) {
    const openvdb::Vec3d scale = valueAt(channel.scale, time), translation = valueAt(channel.translation, time);
    const auto rotation = openvdb::math::rotation<openvdb::Mat3d>(valueAt(channel.rotation, time));
    Mat4d matrix = Mat4d::identity();
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column) matrix(row, column) = scale[row] * rotation(row, column);
    matrix.setTranslation(translation);
    return matrix;
}

/// Returns the points of a part deformed by its morph targets.
std::vector<openvdb::Vec3d> morphed(const ModelData::Part& part, const std::vector<double>& weights) {
    std::vector<openvdb::Vec3d> points(part.points.begin(), part.points.end());
    for (size_t k = 0; k < part.targets.size(); ++k)
        if (weights[k] != 0)
            for (size_t n = 0; n < points.size(); ++n)
                points[n] += weights[k] * openvdb::Vec3d(part.targets[k].offsets[n]);
    return points;
}

std::vector<double> weightsAt(const ModelData& data, uint32_t part, const ModelData::Clip* clip, double time) {
    if (clip)
        for (const ModelData::MorphChannel& channel : clip->morphs)
            if (channel.part == part) return valueAt(channel.weights, time);
    std::vector<double> weights;
    for (const auto& target : data.parts[part].targets) weights.push_back(target.weight);
    return weights;
}

/// Returns a point in world space: transformed by the node of its part, or by its bones (linear blend skinning;
/// Magnenat-Thalmann, Laperrière & Thalmann, Joint-dependent local deformations for hand animation and object grasping,
/// 1988).
openvdb::Vec3d placed(const ModelData::Part& part, size_t n, const openvdb::Vec3d& point, const Mat4d& node,
                      const std::vector<Mat4d>& bones) {
    openvdb::Vec3d sum(0.0);
    double total = 0;
    for (size_t k = bones.empty() ? 0 : part.firstInfluence[n]; !bones.empty() && k < part.firstInfluence[n + 1]; ++k) {
        const auto& [bone, weight] = part.influences[k];
        sum += weight * bones[bone].transform(point);
        total += weight;
    }
    return total > 0 ? sum / total : node.transform(point);
}

} // namespace

std::vector<Mat4d> nodesAt(const ModelData& data, const ModelData::Clip* clip, double time) {
    std::vector<Mat4d> nodes;
    for (const ModelData::Node& node : data.nodes) nodes.push_back(node.local);
    if (clip)
        for (const ModelData::NodeChannel& channel : clip->nodes) nodes[channel.node] = matrixAt(channel, time);
    for (size_t k = 0; k < nodes.size(); ++k)
        if (const auto parent = data.nodes[k].parent) nodes[k] = nodes[k] * nodes[*parent];
    return nodes;
}

std::vector<openvdb::Vec3s> pointsAt(const ModelData& data, const ModelData::Clip* clip, double time) {
    const std::vector<Mat4d> nodes = nodesAt(data, clip, time);
    std::vector<openvdb::Vec3s> points;
    for (uint32_t p = 0; p < data.parts.size(); ++p) {
        const ModelData::Part& part = data.parts[p];
        std::vector<Mat4d> bones;
        for (const ModelData::Bone& bone : part.bones) bones.push_back(bone.offset * nodes[bone.node]);
        const std::vector<openvdb::Vec3d> shaped = morphed(part, weightsAt(data, p, clip, time));
        for (size_t n = 0; n < shaped.size(); ++n)
            points.emplace_back(placed(part, n, shaped[n], nodes[part.node], bones));
    }
    return points;
}

} // namespace curlew
