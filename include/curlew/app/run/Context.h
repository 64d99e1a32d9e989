// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/language/Frames.h"
#include "curlew/app/run/Session.h"
#include "curlew/flow/FlowInTime.h"

#include <list>

namespace curlew::app {

class Evaluator;

/// What a node keeps from frame to frame beside its inputs.
struct Memory {
    double sum = 0;                    ///< Saved in checkpoints.
    std::shared_ptr<void> object = {}; ///< Made again after -resume.
};

/// One evaluation of a node: what its action reads and makes.
class Context {
  public:
    Context(Evaluator& evaluator, Console& console, size_t node, const Moment& moment, NodeResult& result);

    // --- inputs, by their declared names. Throw ValueError if there is nothing, or something else.

    bool has(std::string_view input) const { return count(input) > 0; }
    size_t count(std::string_view input) const;
    Kind kind(std::string_view input) const;
    const Value& value(std::string_view input, size_t index = 0) const;
    const FieldValue& field(std::string_view input, size_t index = 0) const;
    const AnyFlow& anyFlow(std::string_view input, size_t index = 0) const;
    /// A flow in space; ValueError if it is of too high a dimension.
    Flow flow(std::string_view input, size_t index = 0) const;
    /// A flow as it changes with time, seconds since the first frame (or, without -frames, since T = 0): at(t) is the
    /// node at that time. Level sets whose files change from frame to frame move from those of the frame before to
    /// those of this one: the distance between is the mean of both, weighted by the time. Valid as long as the program
    /// runs.
    FlowInTime flowInTime(std::string_view input) const;
    const GridValue& grid(std::string_view input, size_t index = 0) const;
    MeshPointer mesh(std::string_view input) const;
    CurvesPointer curves(std::string_view input, size_t index = 0) const;
    const ImageValue& image(std::string_view input, size_t index = 0) const;
    const PointSet& points(std::string_view input, size_t index = 0) const;
    /// The points, to change: moved out of the input if nothing else wants them.
    PointSet takePoints(std::string_view input);
    /// A shape or level set as a distance that is good up to `distance` world units from the surface: the band of a
    /// level set is widened for that, the grid itself stays as it is.
    Sdf sdf(std::string_view input, double distance) const;
    /// The level set of that distance.
    LevelSet levelSet(std::string_view input, double distance) const;
    /// The diagonal of the box of the first input that has one, world units: what lengths in percent are parts of.
    /// ValueError if none has.
    double diagonal() const;
    /// What made the object, as text.
    std::string programOf(std::string_view input, size_t index = 0) const;
    /// The flow that points carry the track of, if it is one of now.
    const AnyFlow* trackedFlow(const PointSet& points) const;
    /// What identifies the flow of an input, for the points that follow it.
    TrackedFlow tracked(std::string_view input) const;
    /// What identifies the object of an input: equal digests stand for equal objects.
    Digest keyOf(std::string_view input) const;
    /// Whether the object of an input is the same at every moment.
    bool steady(std::string_view input) const;
    /// What `make` returns, a shared pointer to T, made once for a key: kept for later moments, and for the next run of
    /// the session if that asks for it. The key has to tell all that it depends on, and its type.
    template <class T, class Make>
    std::shared_ptr<const T> kept(const Digest& key, const Make& make) const {
        std::shared_ptr<const void>& known = keptObject(key);
        if (!known) known = std::shared_ptr<const T>(make());
        return std::static_pointer_cast<const T>(known);
    }
    /// What is provided under a name in place of a file; monostate if nothing is.
    Value provided(const std::string& name) const;

    // --- results

    void give(Value value) { mResult.outputs.push_back(std::move(value)); }
    /// Figures of the report, by the name of an action or of the user's choice; what there is so far is kept until it
    /// is overwritten.
    Report& report(const std::string& name);
    /// The whole report of the session.
    Report& wholeReport() const;

    // --- the moment

    /// The frame; nullopt before and without -frames.
    const std::optional<FrameClock>& clock() const;
    const Moment& moment() const { return mMoment; }
    Memory& memory() const;

    // --- the user

    const Console& console() const { return mConsole; }
    void say(const std::string& line) const { mConsole.say(line); }
    void warn(const std::string& line) const { mConsole.warn(line); }
    Monitor follow(const std::string& title) const { return mConsole.follow(title); }
    Session& session() const;
    const Graph& graph() const;

  private:
    const std::vector<Link>& links(std::string_view input) const;
    const Link& link(std::string_view input, size_t index) const;
    std::shared_ptr<const void>& keptObject(const Digest& key) const;

    Evaluator& mEvaluator;
    Console& mConsole;
    size_t mNode;
    Moment mMoment;
    NodeResult& mResult;
    mutable std::list<std::pair<Link, Value>> mHeld; ///< Inputs that were read: they stay while the action runs.
};

} // namespace curlew::app
