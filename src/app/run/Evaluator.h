// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/run/Context.h"
#include "curlew/vdb/MeshMotion.h"

#include <list>

namespace curlew::app {

/// The state that the next frame needs from the frames before it.
struct Checkpoint {
    int frame = 0;
    struct State {
        PointSet set;
        Digest key;
    };
    std::vector<State> states = {};
    std::vector<double> sums = {}; ///< The sums in the memories, by node.
    int since = 0;                 ///< The first frame whose files are in `inputs`.
    Digest inputs = {};            ///< Digest of the content of all files that were read up to this frame.
};

/// Evaluates one graph: first the nodes before -frames, once; then the others, for each frame. If an action makes its
/// points in parts, all this is done for each part, with the nodes that depend on the part.
class Evaluator {
  public:
    Evaluator(Session& session, const Graph& graph);
    void run();

  private:
    friend class Context;

    struct StateValue {
        PointsPointer points;
        Digest key;
    };
    struct Timing {
        std::optional<size_t> entry = {}; ///< Index of the node's entry in the report.
        double seconds = 0;
    };
    /// A result at another time than the current one.
    struct Remembered {
        size_t node;
        double time;
        ResultPointer result;
    };

    void analyse();
    void findParts();
    void prepare();
    void prepareFrames() const;
    void requireNoState() const;
    const SourceLocation& enter(size_t node) const;
    std::string contextOf(size_t node) const;

    void evaluate(size_t index, const std::string& place);
    ResultPointer computed(size_t index, const Moment& moment, Console& console, const Digest& key);
    void apply(size_t index);
    void record(size_t index, double seconds);
    void release(size_t index);
    void findTrackedFlow(TrackedFlow& tracked) const;
    void runParts();
    void beginPart(int64_t part);
    Moment beforeFrames(int64_t part) const;
    Moment momentOf(const FrameClock& clock) const;
    void runFrames();
    void beginFrame(const FrameClock& clock);
    void endFrame();
    void keepForNextFrame();
    void collect(const std::vector<Entry>& entries);
    std::vector<Entry> leftOnFailure() const;
    void sayShares() const;

    // --- values, for Context
    /// How a level set of a rigid body is wanted at a moment other than that of the current frame.
    enum class As {
        body,    ///< That of the first frame, with the pose at the moment: cheap, for actions that apply the pose.
        samples, ///< Sampled, as it is between two frames.
        inFrame, ///< Sampled. The moment is that of a frame, as for all that is only evaluated in frames.
    };
    /// Returns the value of a link at a moment.
    Value value(const Link& link, const Moment& moment, As as = As::body);
    ResultPointer resultAt(size_t node, const Moment& moment);
    ResultPointer resultInFrame(size_t node, const FrameClock& clock);
    FrameClock clockOf(const Link& link, const Moment& moment);
    Value betweenFrames(const Link& link, const Moment& moment, As as);
    // Meshes whose faces correspond from frame to frame (EvaluatorMeshes.cpp).
    FrameClock frameBefore(const FrameClock& clock) const { return mPlan->clock(clock.frame - mPlan->by); }
    std::optional<Link> meshOf(const Link& levelSet) const;
    Value valueIn(const Link& link, const FrameClock& clock);
    MeshPointer meshIn(const Link& mesh, const FrameClock& clock);
    std::optional<MeshKeys> meshKeys(const Link& mesh, const FrameClock& clock);
    void followMesh(const Link& levelSet, const FrameClock& clock, const GridValue& from, const GridValue& to);
    const RigidFit* fitIn(const Link& moved, const FrameClock& clock);
    std::optional<RigidBody> bodyAt(const Link& levelSet, const FrameClock& clock, double part);
    Value asBody(const Link& link, Value value, const std::optional<FrameClock>& clock);
    GridValue withWayAhead(const Link& link, const Link& mesh, const GridValue& grid);
    GridValue withWay(const Link& link, const GridValue& grid, const Moment& moment);
    bool isNow(const Moment& moment) const { return moment.time == mNow.time && moment.frame == mNow.frame; }
    bool steady(const Link& link) const;
    Moment momentAt(double seconds) const;
    PointSet take(const Link& link, size_t node);

    Digest keyOf(size_t index) const;
    Digest keyOf(const Link& link) const;
    Digest programDigest() const;
    Digest inputsBefore() const;
    Digest inputsOf(const Digest& before, const Moment& moment) const;
    void addInputs(DigestBuilder& key, const Node& node, const Moment& moment) const;
    Digest inputsUpTo(const Checkpoint& checkpoint, Digest inputs) const;
    void restore(const Checkpoint& checkpoint);

    Session& mSession;
    const Graph& mGraph;
    std::optional<FramePlan> mPlan;
    std::optional<FrameClock> mClock;
    Moment mNow;
    int64_t mFirstPart = 1, mParts = 1; ///< The part of the points that is made first, and how many are.
    std::vector<ResultPointer>& mResults;
    std::vector<StateValue> mStates;
    std::vector<Memory> mMemories;
    std::vector<bool> mVaries;   ///< Whether a node changes with time, within its section of the program.
    std::vector<bool> mAdvances; ///< Whether a node depends on the state of the previous frame.
    std::vector<bool> mInParts;  ///< Whether a node changes from part to part. All false if there is only one part.
    std::vector<bool> mNeeded;
    std::map<Link, size_t> mLastUse; ///< The last node that uses an object; kWantedLater if it is needed afterwards.
    std::list<Remembered> mRemembered;
    std::map<Link, std::shared_ptr<const GridValue>> mFirstForms; ///< Level sets of rigid bodies in the first frame.
    /// Rigid fits of meshes and of moved level sets from the first frame, by frame.
    std::map<std::pair<Link, int>, RigidFit> mFits;
    std::vector<Timing> mTimings;
};

/// Writes a checkpoint, which keeps the exact bits of all numbers. Throws FileError as writeAtomically().
void writeCheckpoint(const std::filesystem::path& path, const Digest& program, const Checkpoint& checkpoint,
                     const std::function<bool()>& cancelled);
/// Reads a checkpoint; returns nullopt if the file does not exist. Throws FileError if the file is damaged, not a
/// checkpoint, or from another program, and ResourceError if it does not fit into memory.
std::optional<Checkpoint> readCheckpoint(const std::filesystem::path& path, const Digest& program);

/// Returns whether a result knows the velocity of a surface (Sdf::surfaceVelocity). It then depends on meshes of other
/// frames than its own.
bool dependsOnOtherFrames(const NodeResult& result);

} // namespace curlew::app
