// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/AnimatedMesh.h"

#include "ModelPose.h"
#include "Polygons.h"
#include "curlew/base/Digest.h"
#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <unordered_map>

namespace curlew {

namespace {

using openvdb::Mat4d;
using openvdb::Vec3s;

constexpr double kSamePose = 1e-3; // relative to the mesh's size

DigestBuilder& add(DigestBuilder& builder, const Mat4d& matrix) {
    return builder.addBytes(matrix.asPointer(), 16 * sizeof(double));
}

/// Finds points that coincide in every pose: points of one group that have the same position in the space of their
/// mover.
class Joints {
  public:
    explicit Joints(const ModelData& data) : mData(data), mMover(data.nodes.size()), mWithin(data.nodes.size()) {
        std::vector<bool> moves(data.nodes.size());
        for (const ModelData::Clip& clip : data.clips)
            for (const ModelData::NodeChannel& channel : clip.nodes) moves[channel.node] = true;
        for (size_t k = 0; k < data.nodes.size(); ++k) {
            const auto parent = data.nodes[k].parent;
            mMover[k] = moves[k] ? static_cast<int64_t>(k) : parent ? mMover[*parent] : -1;
            mWithin[k] = moves[k] ? Mat4d::identity()
                         : parent ? data.nodes[k].local * mWithin[*parent]
                                  : data.nodes[k].local;
        }
    }

    /// Returns the points of all parts in the spaces of their movers, with all faces.
    Polygons polygons() const {
        const std::vector<Mat4d> nodes = nodesAt(mData, nullptr, 0);
        Polygons all;
        for (const ModelData::Part& part : mData.parts) {
            const auto first = static_cast<uint32_t>(all.points.size());
            const bool rigid = part.bones.empty();
            for (const Vec3s& point : part.points)
                all.points.push_back(rigid ? Vec3s(mWithin[part.node].transform(openvdb::Vec3d(point))) : point);
            const bool mirrored = rigid && nodes[part.node].det() < 0;
            for (size_t face = 0, corner = 0; face < part.sizes.size(); corner += part.sizes[face++])
                for (uint32_t k = 0; k < part.sizes[face]; ++k)
                    all.corners.push_back(first + part.corners[corner + (mirrored ? part.sizes[face] - 1 - k : k)]);
            all.sizes.insert(all.sizes.end(), part.sizes.begin(), part.sizes.end());
        }
        return all;
    }

    std::vector<uint32_t> groups() const {
        std::vector<uint32_t> groups;
        std::unordered_map<Digest, uint32_t> numbers;
        for (const ModelData::Part& part : mData.parts)
            for (size_t n = 0; n < part.points.size(); ++n)
                groups.push_back(numbers.emplace(motionOf(part, n), numbers.size()).first->second);
        return groups;
    }

  private:
    Digest motionOf(const ModelData::Part& part, size_t n) const {
        DigestBuilder motion;
        if (!part.bones.empty())
            for (size_t k = part.firstInfluence[n]; k < part.firstInfluence[n + 1]; ++k) {
                const ModelData::Bone& bone = part.bones[part.influences[k].bone];
                add(motion.add(bone.node).add(part.influences[k].weight), bone.offset);
            }
        motion.add(mMover[part.node]);
        if (!part.targets.empty()) motion.add(part.node);
        for (const auto& target : part.targets) motion.addBytes(target.offsets[n].asPointer(), sizeof(Vec3s));
        return motion.digest();
    }

    const ModelData& mData;
    std::vector<int64_t> mMover; ///< For each node, itself or its nearest ancestor that a clip moves; -1: none.
    std::vector<Mat4d> mWithin;  ///< From each node to its mover, or to the world.
};

double largestMove(const std::vector<Vec3s>& from, const std::vector<Vec3s>& to) {
    double largest = 0;
    for (size_t n = 0; n < from.size(); ++n) largest = std::max(largest, openvdb::Vec3d(to[n] - from[n]).length());
    return largest;
}

double sizeOf(const std::vector<Vec3s>& points) {
    openvdb::BBoxd box;
    for (const Vec3s& point : points) box.expand(openvdb::Vec3d(point));
    return box.extents().length();
}

} // namespace

AnimatedMesh AnimatedMesh::read(const std::filesystem::path& path, const std::function<bool()>& cancelled) {
    return AnimatedMesh(importModel(path, cancelled));
}

bool AnimatedMesh::mayMove(const std::filesystem::path& path) { return mayBeAnimated(path); }

AnimatedMesh::AnimatedMesh(ModelData data) : mData(std::make_shared<const ModelData>(std::move(data))) {
    const Joints joints(*mData);
    JoinedMesh joined = joinedMeshOf(joints.polygons(), joints.groups());
    mMesh = std::move(joined.mesh);
    mSources = std::move(joined.sources);
    for (const ModelData::Clip& clip : mData->clips)
        mClips.push_back({.name = clip.name, .seconds = clip.end - clip.begin, .cyclic = false});
    for (size_t k = 0; k < mClips.size(); ++k) {
        const auto first = pointsAt({.clip = k, .end = ClipEnd::hold});
        const auto last = pointsAt({.clip = k, .seconds = mClips[k].seconds, .end = ClipEnd::hold});
        mClips[k].cyclic = largestMove(first, last) <= kSamePose * sizeOf(first);
    }
}

const std::string& AnimatedMesh::units() const { return mData->units; }

size_t AnimatedMesh::clip(const std::string& nameOrNumber) const {
    std::string names;
    for (size_t k = 0; k < mClips.size(); ++k) {
        if (mClips[k].name == nameOrNumber) return k;
        names += fmt::format("{}{} '{}'", k ? ", " : "", k, mClips[k].name);
    }
    size_t number = 0;
    const char* end = nameOrNumber.data() + nameOrNumber.size();
    const auto [rest, error] = std::from_chars(nameOrNumber.data(), end, number);
    if (error == std::errc() && rest == end && number < mClips.size()) return number;
    throw ValueError(
        fmt::format("there is no clip '{}'; the file has {}", nameOrNumber, mClips.empty() ? "none" : names));
}

double AnimatedMesh::timeIn(const MeshPose& pose) const {
    if (!pose.clip || mClips.empty()) return 0;
    const Clip& clip = mClips.at(*pose.clip);
    const double seconds = std::max(pose.seconds, 0.0);
    const bool loops = pose.end == ClipEnd::loop || (pose.end == ClipEnd::automatic && clip.cyclic);
    if (loops && seconds > clip.seconds && clip.seconds > 0) return std::fmod(seconds, clip.seconds);
    return std::min(seconds, clip.seconds);
}

std::vector<Vec3s> AnimatedMesh::pointsAt(const MeshPose& pose) const {
    const bool still = !pose.clip || mClips.empty();
    const ModelData::Clip* clip = still ? nullptr : &mData->clips.at(*pose.clip);
    const auto all = curlew::pointsAt(*mData, clip, clip ? clip->begin + timeIn(pose) : 0);
    std::vector<Vec3s> points;
    points.reserve(mSources.size());
    for (const uint32_t source : mSources) {
        if (!all[source].isFinite())
            throw ValueError(
                fmt::format("the clip '{}' puts a point at infinity; repair it, or choose another with clip=",
                            clip ? clip->name : "none"));
        points.push_back(all[source] + Vec3s(0.0f)); // -0 becomes 0
    }
    return points;
}

Mesh AnimatedMesh::at(const MeshPose& pose) const {
    if (pose.clip && !mClips.empty() && *pose.clip >= mClips.size())
        throw ValueError(fmt::format("there is no clip {}; the file has {}", *pose.clip, mClips.size()));
    Mesh mesh = mMesh;
    mesh.points = pointsAt(pose);
    return mesh;
}

} // namespace curlew
