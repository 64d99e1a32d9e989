// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "Statement.h"

namespace curlew::app {

/// Runs the stacks of a program symbolically: resolves "the newest", ages, keep= and names to links, so that what is
/// wrong with them is known before anything is computed.
class Builder : private Scope {
  public:
    explicit Builder(const Reading& reading);

    /// Adds an action. Throws ValueError, with the action's name in the message.
    void add(const Statement& statement);
    /// Adds a whole graph, on whose results the actions that follow can work.
    void add(Graph graph);
    Graph finish();

    /// The inputs that a node with these arguments takes if nothing is said of them. Throws ValueError if there is
    /// none.
    std::vector<std::vector<Link>> defaultInputs(const Arguments& arguments) const;
    /// Adds a node with the given inputs, and applies to the stacks what it does. Its outputs are found out if it has
    /// none yet.
    void place(Node node, bool keep);
    /// The name under which a text finds an object: that of the oldest node whose result it is or has become.
    std::string nameFor(const Link& link) const;
    /// From here on actions run in each frame.
    /// `carry`: with the points on the stack as their states.
    void beginFrames(const Arguments& range, SourceLocation location, bool carry = true);
    /// Points that are carried from frame to frame.
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
    std::vector<Link> chosen(const Input& input, const Statement& statement, std::vector<const Entry*>& used) const;
    std::vector<Link> atAges(const std::string& option, const std::vector<size_t>& ages,
                             const std::vector<Kind>& kinds) const;
    std::vector<Link> newestOf(const Input& input, const Amount& amount, std::vector<const Entry*>& used) const;
    std::vector<Link> written(const Statement& statement, const std::string& file) const;
    Link resolved(const std::string& name) const;
    World world() const;
    void limitDepth(size_t node);

    const Reading& mReading;
    Graph mGraph;
    std::vector<Entry> mEntries;                         ///< All stacks, in the order in which their objects were made.
    std::vector<Entry> mOutside;                         ///< At -frames.
    Moment mMoment;                                      ///< The first at which what is added is evaluated.
    std::map<std::string, std::vector<Object>> mWritten; ///< What files hold that the program writes.
    std::map<std::string, Link> mNames;                  ///< Where a name leads: an object that is changed keeps it.
    uint64_t mClock = 1;
    std::vector<size_t> mDepths; ///< By node: how many fields and flows are evaluated one within another.
};

} // namespace curlew::app
