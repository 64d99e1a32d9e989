// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/language/Frames.h"
#include "curlew/app/run/Session.h"
#include "curlew/flow/FlowInTime.h"

#include <list>

namespace curlew::app {

class Evaluator;

/// The state that a node keeps from frame to frame, in addition to its inputs.
struct Memory {
    double sum = 0;                    ///< Saved in checkpoints.
    std::shared_ptr<void> object = {}; ///< Rebuilt after -resume.
    Json figures = Json::object();     ///< What the node reported in the frame before.
    bool warnedOfWall = false;         ///< The action has warned of a wall that moves too far.
    bool warnedOfAir = false;          ///< The action has warned of air that a wall pushes too fast.
};

/// One evaluation of a node, as its action sees it.
class Context {
  public:
    Context(Evaluator& evaluator, Console& console, size_t node, const Moment& moment, NodeResult& result);

    // --- inputs, by their declared names. Throw ValueError if the input is missing or of another type.

    bool has(std::string_view input) const { return count(input) > 0; }
    size_t count(std::string_view input) const;
    Kind kind(std::string_view input) const;
    const Value& value(std::string_view input, size_t index = 0) const;
    const FieldValue& field(std::string_view input, size_t index = 0) const;
    const AnyFlow& anyFlow(std::string_view input, size_t index = 0) const;
    /// Returns a flow in 3D. Throws ValueError if it has more than 3 dimensions.
    Flow flow(std::string_view input, size_t index = 0) const;
    /// Returns a flow as a function of time, in seconds since the first frame (or since T = 0 without -frames): at(t)
    /// evaluates the node at that time. If a level set changes from frame to frame, the surface between two frames
    /// follows its mesh if the faces of the mesh correspond; otherwise, the distance is the mean of the two frames'
    /// distances, weighted by the time. The result is valid while the program runs.
    FlowInTime flowInTime(std::string_view input) const;
    const GridValue& grid(std::string_view input, size_t index = 0) const;
    MeshPointer mesh(std::string_view input) const;
    CurvesPointer curves(std::string_view input, size_t index = 0) const;
    const ImageValue& image(std::string_view input, size_t index = 0) const;
    /// Returns points in 3D. Throws ValueError if they have more than 3 dimensions.
    const PointSet& points(std::string_view input, size_t index = 0) const;
    /// Returns points of any dimension.
    const PointSet& anyPoints(std::string_view input, size_t index = 0) const;
    /// Returns the points, in 3D, for modification. They are moved out of the input if nothing else needs them,
    /// otherwise copied.
    PointSet takePoints(std::string_view input);
    /// Returns a shape or level set as a signed distance that is valid up to `distance` world units from the surface.
    /// If necessary, a copy of a level set gets a wider narrow band; the grid itself does not change.
    Sdf sdf(std::string_view input, double distance) const;
    /// Does the same for another time of this frame.
    Sdf sdfAt(std::string_view input, double time, double distance) const;
    /// Returns the box of a shape or level set at the beginning of the frame; nullopt if it is unbounded.
    std::optional<Box> boxBefore(std::string_view input) const;
    /// Returns the level set with a narrow band of at least that distance.
    LevelSet levelSet(std::string_view input, double distance) const;
    /// Returns the diagonal of the bounding box of the first input that has one, in world units. Lengths in percent are
    /// relative to it. Throws ValueError if no input has a finite box.
    double diagonal() const;
    /// Returns the program text that made a field; "" for other objects.
    std::string programOf(std::string_view input, size_t index = 0) const;
    /// Returns the flow whose track the points carry; null if it is from another frame.
    const AnyFlow* trackedFlow(const PointSet& points) const;
    /// Returns the identity of an input's flow, for the points that follow it.
    TrackedFlow tracked(std::string_view input) const;
    /// Returns a digest that identifies the object of an input: equal digests mean equal objects.
    Digest keyOf(std::string_view input, size_t index = 0) const;
    /// Returns whether the object of an input is the same at every moment.
    bool steady(std::string_view input) const;
    /// Returns the level sets from which an object was made, directly or through other fields and flows: one list for
    /// each input of a node that takes level sets only, such as the walls of -bound. Lists whose values the program no
    /// longer holds are left out, and so are objects of an earlier program.
    std::vector<std::vector<GridValue>> levelSetsBehind(std::string_view input) const;
    /// Returns whether an object was made from a level set in this way.
    bool madeFromLevelSet(std::string_view input) const;
    /// Returns the object for a key, calling `make` (which returns a shared pointer to T) if there is none yet. The
    /// object is kept for later moments, and for the session's next run as long as each run uses it. The key must cover
    /// everything that the object depends on, and its type.
    template <class T, class Make>
    std::shared_ptr<const T> kept(const Digest& key, const Make& make) const {
        std::shared_ptr<const void>& known = keptObject(key);
        if (!known) known = std::shared_ptr<const T>(make());
        return std::static_pointer_cast<const T>(known);
    }
    /// Returns the geometry provided in place of a file of this name; monostate if there is none.
    Value provided(const std::string& name) const;

    // --- results

    /// Returns whether an output of this node has a use: in another node or, if the session keeps its objects, later.
    bool used(std::string_view output) const;
    void give(Value value) { mResult.outputs.push_back(std::move(value)); }
    /// Returns a section of the report, named after an action or by the user. Existing values remain until they are
    /// overwritten.
    Json& report(const std::string& name);
    /// Returns the whole report of the session.
    Json& wholeReport() const;

    // --- the moment

    /// Returns the frame; nullopt before -frames and without it.
    const std::optional<FrameClock>& clock() const;
    const Moment& moment() const { return mMoment; }
    Memory& memory() const;

    // --- the user

    const Console& console() const { return mConsole; }
    void info(const std::string& line) const { mConsole.info(line); }
    void warn(const std::string& line) const { mConsole.warn(line); }
    Monitor follow(const std::string& title) const { return mConsole.follow(title); }
    Session& session() const;
    const Graph& graph() const;

  private:
    const std::vector<Link>& links(std::string_view input) const;
    const Link& link(std::string_view input, size_t index) const;
    std::vector<std::vector<Link>> levelSetLinks(std::string_view input) const;
    std::shared_ptr<const void>& keptObject(const Digest& key) const;

    Evaluator& mEvaluator;
    Console& mConsole;
    size_t mNode;
    Moment mMoment;
    NodeResult& mResult;
    mutable std::list<std::pair<Link, Value>> mHeld; ///< Inputs that were read, held while the action runs.
};

} // namespace curlew::app
