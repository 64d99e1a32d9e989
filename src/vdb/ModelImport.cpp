// SPDX-License-Identifier: Apache-2.0
#include "GltfFloats.h"
#include "MeshParser.h"
#include "ModelUnits.h"
#include "curlew/base/InputFile.h"
#include "curlew/base/LocalFile.h"
#include "curlew/base/Memory.h"
#include "curlew/vdb/ModelData.h"

#include <assimp/BaseImporter.h>
#include <assimp/Importer.hpp>
#include <assimp/ProgressHandler.hpp>
#include <assimp/config.h>
#include <assimp/scene.h>
#include <assimp/version.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <span>
#include <unordered_map>

namespace curlew {

namespace {

using openvdb::Mat4d;
using openvdb::Vec3s;
using openvdb::math::Quatd;

constexpr double kBytesPerByte = 20;   // bytes of memory per byte of a file: Assimp's scene and ours
constexpr double kTicksPerSecond = 25; // default if a file does not say, as in Assimp's viewer

/// Returns a span of one of Assimp's arrays.
template <class T>
std::span<T> spanOf(T* first, unsigned count) {
    return first ? std::span<T>(first, count) : std::span<T>();
}

/// Converts a matrix. In Assimp positions are columns, p' = M p.
Mat4d matrixOf(const aiMatrix4x4& m) {
    Mat4d matrix = Mat4d::identity();
    for (unsigned row = 0; row < 3; ++row)
        for (unsigned column = 0; column < 4; ++column)
            matrix(static_cast<int>(column), static_cast<int>(row)) = double(m[row][column]);
    return matrix;
}
Vec3s singleOf(const aiVector3D& v) { return Vec3s(float(v.x), float(v.y), float(v.z)); }
openvdb::Vec3d valueOf(const aiVectorKey& key) {
    return openvdb::Vec3d(double(key.mValue.x), double(key.mValue.y), double(key.mValue.z));
}
Quatd valueOf(const aiQuatKey& key) {
    return Quatd(double(key.mValue.x), double(key.mValue.y), double(key.mValue.z), double(key.mValue.w));
}

/// Cancels Assimp's import when it reports progress. Assimp's importers turn any exception into an error.
class Cancel : public Assimp::ProgressHandler {
  public:
    explicit Cancel(const std::function<bool()>& cancelled) : mCancelled(cancelled) {}
    bool Update(float /*percentage*/) override {
        if (mCancelled && mCancelled()) throw Interrupted();
        return true;
    }

  private:
    const std::function<bool()>& mCancelled;
};

/// Removes all importers but those for this extension. Otherwise Assimp tries all formats if the content of a file is
/// of another format.
void keepImporters(Assimp::Importer& importer, const std::string& ending) {
    for (size_t k = importer.GetImporterCount(); k-- > 0;) {
        Assimp::BaseImporter* one = importer.GetImporter(k);
        std::set<std::string> endings;
        one->GetExtensionList(endings);
        if (endings.contains(ending.substr(1))) continue;
        importer.UnregisterLoader(one);
        delete one; // the importer no longer owns it
    }
}

class Converter {
  public:
    Converter(const aiScene& scene, const MeshSource& source) : mScene(scene), mSource(source) {}

    ModelData convert(const std::string& ending) {
        addNodes();
        mOffsetsLackMesh = ending == ".fbx" && std::pair(aiGetVersionMajor(), aiGetVersionMinor()) >= std::pair(5u, 4u);
        const ModelUnits units = unitsOf(mScene, ending);
        mData.units = units.text;
        if (units.root) mData.nodes.front().local = *units.root;
        for (uint32_t k = 0; k < mNodes.size(); ++k)
            for (const unsigned mesh : spanOf(mNodes[k]->mMeshes, mNodes[k]->mNumMeshes))
                if (mesh < mScene.mNumMeshes) addPart(k, *mScene.mMeshes[mesh]);
        checkParts();
        for (const aiAnimation* animation : spanOf(mScene.mAnimations, mScene.mNumAnimations)) addClip(*animation);
        return std::move(mData);
    }

  private:
    /// Adds parents before their children.
    void addNodes() {
        if (!mScene.mRootNode) throw mSource.noFaces();
        std::vector<std::pair<const aiNode*, std::optional<uint32_t>>> open{{mScene.mRootNode, std::nullopt}};
        while (!open.empty()) {
            const auto [node, parent] = open.back();
            open.pop_back();
            const auto number = static_cast<uint32_t>(mNodes.size());
            mNodes.push_back(node);
            mNumbers.emplace(node->mName.C_Str(), number);
            mData.nodes.push_back({node->mName.C_Str(), parent, matrixOf(node->mTransformation)});
            for (const aiNode* child : spanOf(node->mChildren, node->mNumChildren)) open.emplace_back(child, number);
        }
    }

    std::optional<uint32_t> nodeNamed(const aiString& name) const {
        const auto found = mNumbers.find(name.C_Str());
        if (found == mNumbers.end()) return {};
        return found->second;
    }

    /// Adds the faces of a mesh; skips points and lines.
    void addPart(uint32_t node, const aiMesh& mesh) {
        ModelData::Part part{.node = node,
                             .points = {},
                             .corners = {},
                             .sizes = {},
                             .bones = {},
                             .influences = {},
                             .firstInfluence = {},
                             .targets = {}};
        for (const aiFace& face : spanOf(mesh.mFaces, mesh.mNumFaces)) {
            if (face.mNumIndices < 3) continue;
            part.sizes.push_back(face.mNumIndices);
            for (const unsigned corner : spanOf(face.mIndices, face.mNumIndices)) {
                if (corner >= mesh.mNumVertices)
                    throw mSource.error(
                        fmt::format("it has a face with vertex {}, but only points 0 to {}; it is damaged", corner,
                                    mesh.mNumVertices - 1));
                part.corners.push_back(corner);
            }
        }
        if (part.sizes.empty()) return;
        for (const aiVector3D& point : spanOf(mesh.mVertices, mesh.mNumVertices))
            part.points.push_back(singleOf(point));
        if (part.points.size() != mesh.mNumVertices) throw mSource.cutShort();
        addBones(part, mesh);
        for (const aiAnimMesh* target : spanOf(mesh.mAnimMeshes, mesh.mNumAnimMeshes)) addTarget(part, *target);
        mMeshNames.emplace_back(mesh.mName.C_Str());
        mData.parts.push_back(std::move(part));
    }

    /// Returns what the offsets of a part's bones lack. Since version 5.4, Assimp multiplies the inverse of an .fbx
    /// bone's transform by the local transform of the parent of the mesh's node, instead of by the transform of that
    /// node in the bind pose. The latter is in the file (Transform of the cluster), but not in the scene: this takes
    /// the node's transform outside of clips.
    Mat4d missingOffset(uint32_t node) const {
        Mat4d transform = Mat4d::identity();
        if (!mOffsetsLackMesh) return transform;
        const auto parentOf = [&](uint32_t k) { return mData.nodes[k].parent.value_or(0); };
        for (uint32_t k = node; k != 0; k = parentOf(k)) transform = transform * mData.nodes[k].local;
        uint32_t parent = parentOf(node); // of the first of the nodes that Assimp makes of one with pivots
        while (mData.nodes[parent].name.starts_with(mData.nodes[node].name + "_$AssimpFbx$")) parent = parentOf(parent);
        const Mat4d& local = mData.nodes[parent].local;
        return parent == 0 || local.det() == 0 ? transform : transform * local.inverse();
    }

    void addBones(ModelData::Part& part, const aiMesh& mesh) {
        const Mat4d missing = missingOffset(part.node);
        std::vector<std::vector<ModelData::Influence>> influences(part.points.size());
        for (const aiBone* bone : spanOf(mesh.mBones, mesh.mNumBones)) {
            const auto node = nodeNamed(bone->mName);
            if (!node) continue;
            const auto number = static_cast<uint32_t>(part.bones.size());
            part.bones.push_back({*node, missing * matrixOf(bone->mOffsetMatrix)});
            for (const aiVertexWeight& weight : spanOf(bone->mWeights, bone->mNumWeights)) {
                if (weight.mVertexId >= influences.size() || !(weight.mWeight >= 0))
                    throw mSource.error("it has a bone with an invalid point or weight; it is damaged");
                if (weight.mWeight > 0) influences[weight.mVertexId].push_back({number, double(weight.mWeight)});
            }
        }
        if (part.bones.empty()) return;
        for (const auto& some : influences) {
            part.firstInfluence.push_back(part.influences.size());
            part.influences.insert(part.influences.end(), some.begin(), some.end());
        }
        part.firstInfluence.push_back(part.influences.size());
    }

    void addTarget(ModelData::Part& part, const aiAnimMesh& target) const {
        std::vector<Vec3s> offsets(part.points.size(), Vec3s(0.0f));
        const auto shaped = spanOf(target.mVertices, target.mNumVertices);
        if (!shaped.empty() && shaped.size() != offsets.size())
            throw mSource.error("it has a morph target with a different number of points; it is damaged");
        for (size_t n = 0; n < shaped.size(); ++n) offsets[n] = singleOf(shaped[n]) - part.points[n];
        part.targets.push_back({double(target.mWeight), std::move(offsets)});
    }

    void checkParts() const {
        size_t points = 0, bad = 0;
        if (mData.parts.empty()) throw mSource.noFaces();
        for (const ModelData::Part& part : mData.parts) {
            points += part.points.size();
            for (const Vec3s& point : part.points) bad += !point.isFinite();
        }
        mSource.checkPoints(bad, points);
    }

    // --- clips

    void addClip(const aiAnimation& animation) {
        mSecondsPerTick = 1 / (animation.mTicksPerSecond > 0 ? animation.mTicksPerSecond : kTicksPerSecond);
        mBegin = mSingleBegin = HUGE_VAL, mEnd = mSingleEnd = -HUGE_VAL;
        ModelData::Clip clip{.name = animation.mName.C_Str(), .begin = 0, .end = 0, .nodes = {}, .morphs = {}};
        for (const aiNodeAnim* channel : spanOf(animation.mChannels, animation.mNumChannels))
            if (const auto node = nodeNamed(channel->mNodeName)) clip.nodes.push_back(channelOf(*node, *channel));
        for (const aiMeshMorphAnim* morph : spanOf(animation.mMorphMeshChannels, animation.mNumMorphMeshChannels))
            addMorph(clip, *morph);
        const bool moves = mBegin <= mEnd;
        if (!moves && !(mSingleBegin <= mSingleEnd)) return; // the clip has no keys
        clip.begin = moves ? mBegin : mSingleBegin;
        clip.end = moves ? mEnd : mSingleEnd;
        mData.clips.push_back(std::move(clip));
    }

    double secondsOf(double ticks) const {
        const double seconds = ticks * mSecondsPerTick;
        if (!std::isfinite(seconds)) throw mSource.error("it has a keyframe whose time is not finite; it is damaged");
        return seconds;
    }

    /// Extends the time range of the clip by the key times of one property. Properties with a single key are kept
    /// apart: they do not tell when a clip begins, since Assimp adds a key at 0 to properties without keys.
    void countTimes(const std::vector<double>& times) {
        if (!std::is_sorted(times.begin(), times.end()))
            throw mSource.error("it has keyframes that are not in order of time; it is damaged");
        double& begin = times.size() > 1 ? mBegin : mSingleBegin;
        double& end = times.size() > 1 ? mEnd : mSingleEnd;
        begin = std::min(begin, times.front());
        end = std::max(end, times.back());
    }

    template <class Key, class T>
    ModelData::Keys<T> keysOf(const Key* first, unsigned count, const T& otherwise) {
        ModelData::Keys<T> keys;
        for (const Key& key : spanOf(first, count)) {
            keys.times.push_back(secondsOf(key.mTime));
            keys.values.push_back(valueOf(key));
        }
        if (keys.times.empty())
            keys = {{0}, {otherwise}};
        else
            countTimes(keys.times);
        return keys;
    }

    ModelData::NodeChannel channelOf(uint32_t node, const aiNodeAnim& channel) {
        aiVector3D scale, translation;
        aiQuaternion rotation;
        mNodes[node]->mTransformation.Decompose(scale, rotation, translation);
        return {.node = node,
                .translation =
                    keysOf(channel.mPositionKeys, channel.mNumPositionKeys, valueOf(aiVectorKey(0, translation))),
                .rotation = keysOf(channel.mRotationKeys, channel.mNumRotationKeys, valueOf(aiQuatKey(0, rotation))),
                .scale = keysOf(channel.mScalingKeys, channel.mNumScalingKeys, valueOf(aiVectorKey(0, scale)))};
    }

    /// Adds a morph channel. Assimp identifies it by the name of the node (glTF) or of the mesh (FBX, with * and a
    /// number appended).
    void addMorph(ModelData::Clip& clip, const aiMeshMorphAnim& morph) {
        const std::string name = morph.mName.C_Str(), mesh = name.substr(0, name.rfind('*'));
        for (uint32_t p = 0; p < mData.parts.size(); ++p) {
            const ModelData::Part& part = mData.parts[p];
            const std::string& node = mData.nodes[part.node].name;
            if (part.targets.empty() ||
                (node != name && node != mesh && mMeshNames[p] != name && mMeshNames[p] != mesh))
                continue;
            ModelData::MorphChannel channel{.part = p, .weights = {}};
            for (const aiMeshMorphKey& key : spanOf(morph.mKeys, morph.mNumKeys)) {
                channel.weights.times.push_back(secondsOf(key.mTime));
                auto& weights = channel.weights.values.emplace_back(part.targets.size(), 0.0);
                for (unsigned k = 0; k < key.mNumValuesAndWeights; ++k)
                    if (key.mValues[k] < weights.size()) weights[key.mValues[k]] = key.mWeights[k];
            }
            if (channel.weights.times.empty()) continue;
            countTimes(channel.weights.times);
            clip.morphs.push_back(std::move(channel));
        }
    }

    const aiScene& mScene;
    const MeshSource& mSource;
    bool mOffsetsLackMesh = false; ///< See missingOffset().
    ModelData mData;
    std::vector<const aiNode*> mNodes;                  ///< In the order of mData.nodes.
    std::unordered_map<std::string, uint32_t> mNumbers; ///< Node indices by name; the first of several with the same
                                                        ///< name.
    std::vector<std::string> mMeshNames;                ///< Mesh name of each part.
    double mSecondsPerTick = 1;                         ///< For the current clip.
    double mBegin = 0, mEnd = 0;                        ///< Time range of properties with several keys.
    double mSingleBegin = 0, mSingleEnd = 0;            ///< Time range of the other properties.
};

} // namespace

ModelData importModel(const std::filesystem::path& path, const std::function<bool()>& cancelled) {
    const MeshSource source{path};
    const std::string ending = endingOf(path);
    openToRead(path); // throws if the file itself cannot be opened
    requireMemory(kBytesPerByte * static_cast<double>(std::filesystem::file_size(path)),
                  fmt::format("'{}'", path.string()), "use a simpler model");
    checkExtensions(path, source);
    checkLists(path, source);
    Assimp::Importer importer;
    if (ending == ".gltf" || ending == ".glb") readIntegersAsFloats(importer, path, source);
    Cancel handler(cancelled);
    importer.SetProgressHandler(&handler); // taken away below, since the importer would delete it
    keepImporters(importer, ending);
    importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
    for (const char* unread : {AI_CONFIG_IMPORT_FBX_READ_MATERIALS, AI_CONFIG_IMPORT_FBX_READ_TEXTURES,
                               AI_CONFIG_IMPORT_FBX_READ_LIGHTS, AI_CONFIG_IMPORT_FBX_READ_CAMERAS})
        importer.SetPropertyBool(unread, false);
    const aiScene* scene = importer.ReadFile(path.string(), 0);
    importer.SetProgressHandler(nullptr);
    if (cancelled && cancelled()) throw Interrupted();
    if (!scene) {
        const std::string why = importer.GetErrorString();
        throw source.error(
            fmt::format("{}; it is damaged or in another format", why.empty() ? "the importer rejects it" : why));
    }
    return Converter(*scene, source).convert(ending);
}

} // namespace curlew
