// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/language/Program.h"
#include "curlew/app/registry/Json.h"
#include "curlew/app/run/Console.h"
#include "curlew/app/run/Value.h"
#include "curlew/base/LocalFile.h"
#include "curlew/base/Parallel.h"

#include <chrono>
#include <optional>
#include <unordered_map>

namespace curlew::app {

/// The result of evaluating a node.
struct NodeResult {
    Digest key = {}; ///< Digest of everything that the result depends on.
    std::vector<Value> outputs = {};
    /// The sections that the node added to the report, by name.
    std::vector<std::pair<std::string, Json>> figures = {};
};
using ResultPointer = std::shared_ptr<NodeResult>;

/// Caches level sets as distances, by grid, since several actions need the same ones.
class SdfCache;
class Evaluator;

class Context;

/// Runs graphs and keeps their results. Not thread-safe: use it from one thread at a time.
class Session {
  public:
    /// If `keeps`, results are kept for a host to read, and for the next run of an edited graph. The command does not
    /// need this.
    explicit Session(Console& output, bool keeps = true);
    ~Session();
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    /// Evaluates a graph. Reuses values of the previous run whose node, options and inputs are the same. Throws what
    /// the actions throw, with the node's action in the message; results made before the error are kept.
    void run(Graph graph);
    /// Discards the objects and the report of earlier runs, but not the values that the next run may reuse.
    void clear();

    /// An object on a stack, or a node's result.
    struct Held {
        Object object;
        Value value;
        std::string name = {}; ///< The name that the user gave, or the node's.
        Digest key = {};
    };
    /// Returns the objects on the stacks, oldest first, after a run. In onFrame, these are the objects of the frame.
    const std::vector<Held>& objects() const { return mObjects; }
    /// Returns the result of a node, or one of its outputs ("smoke.density"). Throws ValueError if nothing has this
    /// name, suggesting the nearest one, or if it has not been evaluated.
    Held result(const std::string& name) const;
    /// Returns the nodes that the last run evaluated, in order, without those whose values were reused.
    const std::vector<std::string>& evaluated() const { return mEvaluated; }

    /// Returns what a program can learn about files and provided geometry while it is read.
    World world() const;
    /// Returns the objects on the stacks, for a program that continues with them.
    std::vector<Given> given() const;

    /// Provides geometry that -read uses instead of a file with this name.
    void provide(const std::string& name, Value value, const Digest& content);
    /// Removes provided geometry. Returns whether there was any with this name.
    bool withdraw(const std::string& name) { return mProvided.erase(name) > 0; }

    /// Returns a copy of a stream (LocalFile.h), whose name ends with `ending`. The stream is read to its end at the
    /// first call; the copy exists as long as the session.
    const std::filesystem::path& streamed(const std::string& stream, const std::string& ending) const;

    Console& console;
    Json report = Json::object();                ///< The measurements of the actions, by name.
    SourceLocation location = {};                ///< The node that is running, or ran last.
    std::function<void(int frame)> onFrame = {}; ///< Called at the end of each frame. May read objects().

    /// The number of the GPU that device=gpu and device=auto use; by default the preferred one.
    std::optional<size_t> gpu = {};

    void setThreads(int threads) { mThreads = std::make_unique<ThreadLimit>(threads); }
    /// Removes the limit that setThreads() has set.
    void resetThreads() { mThreads.reset(); }
    /// Returns the seconds since the session was created.
    double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - mBegan).count(); }

  private:
    friend class Context;
    friend class Evaluator;
    struct Provided {
        Value value;
        Digest content;
    };

    /// An object that Context::kept() keeps.
    struct Kept {
        std::shared_ptr<const void> object = {};
        bool used = false; ///< Whether this run has used it.
    };

    bool mKeeps;
    Graph mGraph;             ///< The graph of the last run.
    std::vector<Held> mGiven; ///< The objects of the previous graph that the last graph could use.
    std::vector<Held> mObjects;
    std::vector<ResultPointer> mResults; ///< The results of the last run, by node.
    std::map<std::string, Provided> mProvided;
    mutable std::map<std::string, LocalFile> mStreams; ///< Copies of streams, by name.
    std::unordered_map<Digest, ResultPointer> mKnown;  ///< The values of the last run, by key.
    std::unordered_map<Digest, Kept> mKept;
    std::unique_ptr<SdfCache> mSdfs;
    std::unique_ptr<Evaluator> mEvaluator;
    std::vector<std::string> mEvaluated;
    std::chrono::steady_clock::time_point mBegan = std::chrono::steady_clock::now();
    std::unique_ptr<ThreadLimit> mThreads;
};

} // namespace curlew::app
