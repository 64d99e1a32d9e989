// SPDX-License-Identifier: Apache-2.0
#include "FileNames.h"

#include "curlew/app/registry/InContext.h"
#include "curlew/base/Error.h"
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

/// Returns the files that a node reads and writes at a moment.
FileUse filesOf(const Node& node, const Moment& moment) {
    if (node.action().files) return node.action().files(node.arguments.at(moment));
    FileUse use;
    if (reads(node) || writes(node))
        for (const auto& word : node.arguments.writtenWords())
            (reads(node) ? use.read : use.written).push_back(expanded(word, moment));
    return use;
}

/// Inserts the frame or the part into a file name: o.vdb becomes o.####.vdb.
std::string withNumber(const std::string& name, const std::string& number) {
    const fs::path path = name;
    std::string stem = path.stem().string();
    while (stem.size() > 1 && stem.ends_with('.')) stem.pop_back();
    return (path.parent_path() / (stem + "." + number + path.extension().string())).string();
}

constexpr int kBeforeFrames = -1;

/// When a node writes a file.
struct Turn {
    int part = 1, frame = kBeforeFrames;
};

/// Tracks a program's files in the order in which it reads and writes them.
class FileNames {
  public:
    FileNames(const Graph& graph, const std::vector<bool>& needed,
              const std::function<bool(const std::string& name)>& provided)
        : mGraph(graph), mNeeded(needed), mProvided(provided), mTurnOf(graph.nodes.size()) {}

    /// Sets the file that every frame overwrites, and that no action may read or write.
    void setCheckpoint(const std::string& name) { mCheckpoint = identityOf(name); }

    /// `now`: this process reads the node's files at that moment, so they must be there unless it writes them before.
    void follow(size_t index, const Moment& moment, const Turn& turn, bool now) {
        const Node& node = mGraph.nodes[index];
        if (!mNeeded[index]) return;
        inContextOf(contextOf(node.location), [&] {
            const FileUse use = filesOf(node, moment);
            for (const auto& name : use.read) {
                read(name);
                if (now && node.action().files) requireThere(name);
            }
            for (const auto& name : use.written) {
                write(name);
                if (writes(node)) requireNew(index, name, turn);
            }
        });
    }

  private:
    /// Throws FileError if there is no such file, and the program does not write it before.
    void requireThere(const std::string& name) {
        if (!mProvided(name) && !isStreamKnown(name) && !mWritten.contains(identityOf(name)) && !fs::exists(name))
            throw FileError(fmt::format("'{}': there is no such file", name));
    }

    /// Throws ValueError if the file is also read by the program.
    void write(const std::string& name) {
        if (isStreamKnown(name)) return;
        const std::string& file = identityOf(name);
        requireNoCheckpoint(name, file);
        if (mInputs.contains(file))
            throw ValueError(fmt::format(
                "'{}' is also read by this program, so writing it would overwrite an input; choose another name",
                name));
        mWritten.insert(file);
    }

    void read(const std::string& name) {
        if (mProvided(name) || isStreamKnown(name)) return;
        const std::string& file = identityOf(name);
        requireNoCheckpoint(name, file);
        if (!mWritten.contains(file)) mInputs.insert(file);
        mWriters.erase(file); // what was written has been used
    }

    void requireNoCheckpoint(const std::string& name, const std::string& file) const {
        if (file == mCheckpoint)
            throw ValueError(
                fmt::format("'{}' is also the checkpoint of -frames, which is overwritten in every frame; choose "
                            "another name",
                            name));
    }

    void requireNew(size_t index, const std::string& name, const Turn& turn) {
        const Node& node = mGraph.nodes[index];
        // A report grows, so overwriting it loses nothing.
        if (isStreamKnown(name) || node.action().holds(node.arguments, name).empty() ||
            node.arguments.flag("overwrite"))
            return;
        const auto [writer, isFirst] = mWriters.emplace(identityOf(name), index);
        if (!isFirst && writer->second != index)
            throw ValueError(
                fmt::format("'{}' is also written by {}, so one would overwrite the other; choose another name, or "
                            "give overwrite=1",
                            name, contextOf(mGraph.nodes[writer->second].location)));
        const auto [found, isNew] = mTurnOf[index].emplace(name, turn);
        const Turn before = found->second;
        if (isNew) return;
        if (before.part != turn.part)
            throw ValueError(
                fmt::format("'{}' is written for part {} of the points and again for part {}, so one would overwrite "
                            "the other; put the part into the name, as in '{}' (in single quotes, since a shell "
                            "replaces $P3), or give overwrite=1",
                            name, before.part, turn.part, withNumber(name, "$P3")));
        const bool holdsAllFrames = endingOf(name) == ".usda";
        if (before.frame == turn.frame || holdsAllFrames) return;
        throw ValueError(fmt::format(
            "'{}' is written in frame {} and again in frame {}, so one would overwrite the other; put the frame into "
            "the name, as in {} or '{}' (in single quotes, since a shell replaces $F4), or give overwrite=1",
            name, before.frame, turn.frame, withNumber(name, "####"), withNumber(name, "$F4")));
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
    std::string mCheckpoint;                           ///< Its identity; "" if there is none.
    std::unordered_map<std::string, size_t>
        mWriters; ///< The node that has written a file which nothing has read since, by identity.
    std::unordered_map<std::string, std::string> mIdentities;
    std::unordered_map<std::string, bool> mStreams;
    std::vector<std::unordered_map<std::string, Turn>> mTurnOf; ///< By node and name.
};

} // namespace

void requireFileNames(const Graph& graph, const std::optional<FramePlan>& plan, const Moment& before,
                      const std::vector<bool>& needed, const std::vector<bool>& inParts,
                      const std::function<bool(const std::string& name)>& provided) {
    FileNames names(graph, needed, provided);
    if (plan && !plan->checkpoint.empty()) names.setCheckpoint(plan->checkpoint);
    const auto followAll = [&](size_t begin, size_t end, Moment moment, Turn turn, bool now) {
        // Two parts and the same frames show whether the names differ.
        for (turn.part = 1; turn.part <= 2; ++turn.part)
            for (size_t k = begin; k < end; ++k) {
                if (turn.part > 1 && !inParts[k]) continue;
                moment.part = before.part + turn.part - 1;
                names.follow(k, moment, turn, now);
            }
    };
    followAll(0, graph.frames, before, {}, true);
    if (!plan) return;
    const std::vector<int> frames = inContextOf("-frames", [&] { return plan->frames(); });
    const std::set<int> mine(frames.begin(), frames.end());
    const size_t count = static_cast<size_t>((plan->last - plan->first) / plan->by) + 1;
    for (size_t n = 0; n < std::min(count, kMostFrames); ++n) {
        const int frame = plan->first + static_cast<int>(n) * plan->by;
        followAll(graph.frames, graph.nodes.size(), plan->clock(frame).moment(), {.frame = frame},
                  mine.contains(frame) && !graph.resume);
    }
}

} // namespace curlew::app
