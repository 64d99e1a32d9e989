// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "Statement.h"

namespace curlew::app {

/// Executes the stack operations of a program symbolically: resolves "the newest", ages, keep= and names to links, so
/// that errors are found before anything is computed.
class Builder : private Scope {
  public:
    explicit Builder(const Reading& reading);

    /// Adds an action. Throws ValueError, naming the action, if it is invalid.
    void add(const Statement& statement);
    /// Adds a whole graph, whose results the following actions can use.
    void add(Graph graph);
    Graph finish();

    /// Returns the inputs that a node with these arguments takes by default. Throws ValueError if one is missing.
    std::vector<std::vector<Link>> defaultInputs(const Arguments& arguments) const;
    /// Adds a node with the given inputs and applies its effect to the stacks. Determines its outputs if they are not
    /// set.
    void place(Node node, bool keep);
    /// Returns the name by which a text refers to an object: that of the oldest node whose result is, or has become,
    /// this object.
    std::string nameFor(const Link& link) const;
    /// Begins the actions that run in each frame. If `carry`, the points on the stack become states.
    void beginFrames(const Arguments& range, SourceLocation location, bool carry = true);
    /// Adds points that are carried from frame to frame.
    Link addState(std::optional<Link> initial, const std::string& name);

    const Graph& graph() const { return mGraph; }

  private:
    size_t count(const std::vector<Kind>& kinds) const override;
    std::optional<Object> newest(const std::vector<Kind>& kinds) const override;
    std::optional<Object> second(const std::vector<Kind>& kinds) const override;
    bool linked() const override { return false; }

    std::optional<Object> ofAge(const std::vector<Kind>& kinds, size_t age) const;
    bool framed() const { return mGraph.frameRange.has_value(); }
    void addNode(const Statement& statement);
    void addWriter(const Statement& statement);
    std::vector<std::vector<Link>> inputsOf(const Statement& statement) const;
    bool enoughBesideWalls(const Statement& statement) const;
    std::vector<Link> chosen(const Input& input, const Statement& statement, bool walls,
                             std::vector<const Entry*>& used) const;
    std::vector<Link> atAges(const std::string& option, const std::vector<size_t>& ages,
                             const std::vector<Kind>& kinds) const;
    std::vector<Link> newestOf(const Input& input, const Amount& amount, bool walls,
                               std::vector<const Entry*>& used) const;
    std::vector<Link> written(const Statement& statement, const std::string& file) const;
    Link resolved(const std::string& name) const;
    World world() const;
    void limitDepth(size_t node);

    const Reading& mReading;
    Graph mGraph;
    std::vector<Entry> mEntries;                         ///< All stacks, in the order in which their objects were made.
    std::vector<Entry> mOutside;                         ///< The stacks at -frames.
    Moment mMoment;                                      ///< The first moment at which added nodes are evaluated.
    std::map<std::string, std::vector<Object>> mWritten; ///< The objects in files that the program writes.
    std::map<std::string, Link> mNames; ///< The object that each name refers to. A changed object keeps its name.
    uint64_t mClock = 1;
    std::vector<size_t> mDepths; ///< By node: the nesting depth of fields and flows.
};

} // namespace curlew::app
