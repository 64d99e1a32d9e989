// SPDX-License-Identifier: Apache-2.0
#include "FileNames.h"

#include "curlew/app/registry/InContext.h"
#include "curlew/base/LocalFile.h"

#include <filesystem>
#include <set>
#include <unordered_map>
#include <unordered_set>

namespace curlew::app {

namespace fs = std::filesystem;

namespace {

constexpr size_t kMostFrames = 1000;

bool reads(const Node& node) { return node.action().evaluation == Evaluation::file; }
bool writes(const Node& node) { return static_cast<bool>(node.action().holds); }

/// Inserts the frame into a file name: o.vdb becomes o.####.vdb.
std::string withFrame(const std::string& name, const std::string& frame) {
    const fs::path path = name;
    std::string stem = path.stem().string();
    while (stem.size() > 1 && stem.ends_with('.')) stem.pop_back();
    return (path.parent_path() / (stem + "." + frame + path.extension().string())).string();
}

/// Tracks a program's files in the order in which it reads and writes them.
class FileNames {
  public:
    FileNames(const Graph& graph, const std::vector<bool>& needed,
              const std::function<bool(const std::string& name)>& provided)
        : mGraph(graph), mNeeded(needed), mProvided(provided), mFrameOf(graph.nodes.size()) {}

    void follow(size_t index, const Moment& moment, bool inFrames) {
        const Node& node = mGraph.nodes[index];
        if (!mNeeded[index] || !(reads(node) || writes(node))) return;
        inContextOf(contextOf(node.location), [&] {
            for (const auto& word : node.arguments.writtenWords()) {
                const std::string name = expanded(word, moment);
                if (reads(node))
                    read(name);
                else
                    write(index, name, inFrames ? static_cast<int>(moment.frame) : -1);
            }
        });
    }

  private:
    void read(const std::string& name) {
        if (mProvided(name) || isStreamKnown(name)) return;
        const std::string& file = identityOf(name);
        if (!mWritten.contains(file)) mInputs.insert(file);
    }

    void write(size_t index, const std::string& name, int frame) {
        if (isStreamKnown(name)) return;
        const std::string& file = identityOf(name);
        if (mInputs.contains(file))
            throw ValueError(fmt::format(
                "'{}' is also read by this program, so writing it would overwrite an input; choose another name",
                name));
        mWritten.insert(file);
        if (frame >= 0) requireNew(index, name, frame);
    }

    void requireNew(size_t index, const std::string& name, int frame) {
        const Node& node = mGraph.nodes[index];
        // A report grows from frame to frame and a .usda holds all frames, so overwriting them loses nothing.
        const bool grows = node.action().holds(node.arguments, name).empty() || endingOf(name) == ".usda";
        if (grows || node.arguments.flag("overwrite")) return;
        const auto [before, isNew] = mFrameOf[index].emplace(name, frame);
        if (isNew || before->second == frame) return;
        throw ValueError(fmt::format(
            "'{}' is written in frame {} and again in frame {}, so one would overwrite the other; put the frame into "
            "the name, as in {} or '{}' (in single quotes, since a shell replaces $F4), or give overwrite=1",
            name, before->second, frame, withFrame(name, "####"), withFrame(name, "$F4")));
    }

    bool isStreamKnown(const std::string& name) {
        const auto found = mStreams.find(name);
        return found != mStreams.end() ? found->second : mStreams.emplace(name, isStream(name)).first->second;
    }

    /// Returns a name that is the same for all names of one file.
    const std::string& identityOf(const std::string& name) {
        const auto found = mIdentities.find(name);
        if (found != mIdentities.end()) return found->second;
        std::error_code error;
        const fs::path path = fs::weakly_canonical(fs::absolute(name, error), error);
        return mIdentities.emplace(name, error ? name : path.string()).first->second;
    }

    const Graph& mGraph;
    const std::vector<bool>& mNeeded;
    const std::function<bool(const std::string& name)>& mProvided;
    std::unordered_set<std::string> mInputs, mWritten; ///< By identity.
    std::unordered_map<std::string, std::string> mIdentities;
    std::unordered_map<std::string, bool> mStreams;
    std::vector<std::unordered_map<std::string, int>> mFrameOf; ///< By node and name.
};

} // namespace

void requireFileNames(const Graph& graph, const std::optional<FramePlan>& plan, const std::vector<bool>& needed,
                      const std::function<bool(const std::string& name)>& provided) {
    FileNames names(graph, needed, provided);
    for (size_t k = 0; k < graph.frames; ++k) names.follow(k, {}, false);
    if (!plan) return;
    const size_t count = static_cast<size_t>((plan->last - plan->first) / plan->by) + 1;
    for (size_t n = 0; n < std::min(count, kMostFrames); ++n)
        for (size_t k = graph.frames; k < graph.nodes.size(); ++k)
            names.follow(k, plan->clock(plan->first + static_cast<int>(n) * plan->by).moment(), true);
}

} // namespace curlew::app
