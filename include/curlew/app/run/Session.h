// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/language/Program.h"
#include "curlew/app/run/Console.h"
#include "curlew/app/run/Value.h"
#include "curlew/base/LocalFile.h"
#include "curlew/base/Parallel.h"

#include <nlohmann/json.hpp>

#include <chrono>
#include <unordered_map>

namespace curlew::app {

using Report = nlohmann::ordered_json;

/// What evaluating a node has given.
struct NodeResult {
    Digest key = {}; ///< Of all that it depends on.
    std::vector<Value> outputs = {};
    /// What the node has put into the report, by name.
    std::vector<std::pair<std::string, Report>> figures = {};
};
using ResultPointer = std::shared_ptr<NodeResult>;

/// Level sets as distances, by grid: what bounds a field, fills points in and so on asks for the same ones again.
class SdfCache;
class Evaluator;

class Context;

/// Runs graphs, and keeps what they have made. One thread at a time.
class Session {
  public:
    /// `keeps`: results stay for a host to read, and for the next run of an edited graph; a command needs none.
    explicit Session(Console& console, bool keeps = true);
    ~Session();
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    /// Evaluates a graph; values of an earlier run whose node, options and inputs are the same are taken from there.
    /// Throws what the actions throw, with the node's action in the message; what was made until then stays.
    void run(Graph graph);
    /// Forgets the objects and the report of earlier runs, but not the values that the next run may need.
    void clear();

    /// An object that is on a stack, or a node's result.
    struct Held {
        Object object;
        Value value;
        std::string name = {}; ///< Given by the user, or of the node.
        Digest key = {};
    };
    /// The objects on the stacks, oldest first: after a run; and in onFrame those of the frame.
    const std::vector<Held>& objects() const { return mObjects; }
    /// The object that a name stands for: a node, or one of its outputs ("smoke.density"). Throws ValueError with the
    /// nearest name if there is none, or if it has not been evaluated.
    Held result(const std::string& name) const;
    /// The nodes that were evaluated in the last run, in order, without those whose values were known.
    const std::vector<std::string>& evaluated() const { return mEvaluated; }

    /// What a program can find out about files and provided geometry, for reading one.
    World world() const;
    /// The objects on the stacks, for a program that goes on from there.
    std::vector<Given> given() const;

    /// Geometry that -read takes in the place of a file of this name.
    void provide(const std::string& name, Value value, const Digest& content);
    /// Returns whether there was something of that name.
    bool withdraw(const std::string& name) { return mProvided.erase(name) > 0; }

    /// The copy of a stream (LocalFile.h), whose name ends with `ending`: read to its end when it is first asked for,
    /// and kept as long as the session.
    const std::filesystem::path& streamed(const std::string& stream, const std::string& ending) const;

    Console& console;
    Report report = Report::object();            ///< What the actions have measured, by name.
    SourceLocation location = {};                ///< The node that runs, or has run last.
    std::function<void(int frame)> onFrame = {}; ///< Called at the end of each frame; may read objects().

    void setThreads(int threads) { mThreads = std::make_unique<ThreadLimit>(threads); }
    /// As many as there are again.
    void resetThreads() { mThreads.reset(); }
    /// Since the session began.
    double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - mBegan).count(); }

  private:
    friend class Context;
    friend class Evaluator;
    struct Provided {
        Value value;
        Digest content;
    };

    /// What actions keep beyond the moment.
    struct Kept {
        std::shared_ptr<const void> object = {};
        bool used = false; ///< In this run.
    };

    bool mKeeps;
    Graph mGraph;             ///< Of the last run.
    std::vector<Held> mGiven; ///< What the last graph could take from the one before.
    std::vector<Held> mObjects;
    std::vector<ResultPointer> mResults; ///< Of the last run, by node.
    std::map<std::string, Provided> mProvided;
    mutable std::map<std::string, LocalFile> mStreams; ///< By name.
    std::unordered_map<Digest, ResultPointer> mKnown;  ///< Values of the last run by their keys.
    std::unordered_map<Digest, Kept> mKept;
    std::unique_ptr<SdfCache> mSdfs;
    std::unique_ptr<Evaluator> mEvaluator;
    std::vector<std::string> mEvaluated;
    std::chrono::steady_clock::time_point mBegan = std::chrono::steady_clock::now();
    std::unique_ptr<ThreadLimit> mThreads;
};

} // namespace curlew::app
