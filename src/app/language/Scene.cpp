// SPDX-License-Identifier: Apache-2.0
#include "Builder.h"
#include "curlew/app/registry/Text.h"
#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace curlew::app {

namespace {

/// Writes a graph line by line, while a builder simulates the stacks as a parser of the text would. An input is written
/// by name only if the stacks would give another object.
class SceneWriter {
  public:
    SceneWriter(const Graph& graph, std::set<std::string> named)
        : mGraph(graph), mNamed(std::move(named)), mReading{.registry = mNoActions, .given = graph.given} {}

    std::string text() {
        for (size_t k = 0; k < mGraph.frames; ++k) line(k);
        if (mGraph.frameRange) frames();
        for (size_t k = mGraph.frames; k < mGraph.nodes.size(); ++k) line(k);
        if (mGraph.resume) mText += "resume\n";
        return mText;
    }
    /// Returns the names that the text uses. Those that were not in `named` still have to be assigned to nodes.
    const std::set<std::string>& used() const { return mUsed; }

  private:
    /// Returns the name if it is valid in a text, otherwise a valid one made from it.
    std::string textName(const std::string& name) const {
        if (isNodeName(name)) return name;
        std::string plain = "n_";
        for (const char c : name) plain += isNodeName(std::string("n") + c) ? c : '_';
        return plain;
    }

    Link mapped(const Link& link) const {
        const auto found = mLinks.find(link);
        return found == mLinks.end() ? link : found->second;
    }

    /// Returns whether a later node uses the old version of an object that this node changes.
    bool keepsOld(size_t index) const {
        const Node& node = mGraph.nodes[index];
        for (size_t i = 0; i < node.inputs.size(); ++i)
            for (const Link& link : node.inputs[i])
                for (size_t k = index + 1; k < mGraph.nodes.size(); ++k)
                    for (const auto& links : mGraph.nodes[k].inputs)
                        if (node.action().takes[i].use == Use::changed &&
                            std::find(links.begin(), links.end(), link) != links.end())
                            return true;
        return false;
    }

    void frames() {
        mBuilder.beginFrames(*mGraph.frameRange, mGraph.frameLocation);
        mText += mGraph.frameRange->program(false) + "\n";
        const Graph& shadow = mBuilder.graph();
        for (size_t k = 0; k < mGraph.states.size(); ++k)
            for (size_t j = 0; j < shadow.states.size() && mGraph.states[k].initial; ++j)
                if (shadow.states[j].initial == mapped(*mGraph.states[k].initial))
                    mLinks[{.from = Link::From::state, .index = k}] = {.from = Link::From::state, .index = j};
        // Points that no state carries do not change. In the parsed text they are a state that no node advances.
        for (size_t j = 0; j < shadow.states.size(); ++j)
            for (size_t k = mGraph.frames; k < mGraph.nodes.size(); ++k)
                for (const auto& links : mGraph.nodes[k].inputs)
                    for (const Link& link : links)
                        if (mapped(link) == shadow.states[j].initial)
                            mLinks[link] = {.from = Link::From::state, .index = j};
    }

    void line(size_t index) {
        const Node& node = mGraph.nodes[index];
        const Action& action = node.action();
        const bool keep = keepsOld(index);
        Arguments plain(action);
        for (const auto& word : node.arguments.writtenWords()) plain.addWord(word);
        for (const auto& [name, value] : node.arguments.written()) {
            const Option& option = *action.option(name);
            if (!option.selects && option.type != OptionType::ages) plain.set(name, value);
        }
        if (keep) plain.set("keep", "1");
        std::vector<std::vector<Link>> byDefault(action.takes.size()), wanted(action.takes.size());
        try {
            byDefault = mBuilder.defaultInputs(plain);
        } catch (const ValueError&) { // no input can be taken without names
        }
        Node shadow{.arguments = plain, .name = textName(node.name), .named = true, .location = node.location};
        std::string text = plain.program(false);
        for (size_t i = 0; i < node.inputs.size(); ++i) {
            std::vector<std::string> names;
            bool implicit = false;
            for (const Link& link : node.inputs[i]) {
                wanted[i].push_back(mapped(link));
                implicit = action.takes[i].accumulates && isEmptyState(link);
                if (!implicit) names.push_back(mBuilder.nameFor(mapped(link)));
            }
            if (implicit) wanted[i].clear();
            if (wanted[i] == byDefault[i]) continue;
            for (const auto& name : names) mUsed.insert(name.substr(0, name.find('.')));
            text += fmt::format(" {}={}", action.takes[i].name, names.empty() ? "none" : join(names, ","));
        }
        if (mNamed.contains(shadow.name) || (node.named && isNodeName(node.name) && !action.makes.empty()))
            text += " as=" + shadow.name;
        mText += text + "\n";
        shadow.inputs = wanted;
        shadow.outputs = node.outputs;
        const size_t made = mBuilder.graph().nodes.size(), states = mBuilder.graph().states.size();
        mBuilder.place(std::move(shadow), keep);
        for (size_t o = 0; o < node.outputs.size(); ++o)
            mLinks[{.index = index, .output = o}] = {.index = made, .output = o};
        if (mBuilder.graph().states.size() > states)
            for (const auto& links : node.inputs)
                for (const Link& link : links)
                    if (isEmptyState(link)) mLinks[link] = {.from = Link::From::state, .index = states};
    }

    bool isEmptyState(const Link& link) const {
        return link.from == Link::From::state && !mGraph.states[link.index].initial;
    }

    const Graph& mGraph;
    std::set<std::string> mNamed, mUsed;
    Registry mNoActions;
    Reading mReading;
    Builder mBuilder{mReading};
    std::map<Link, Link> mLinks;
    std::string mText;
};

} // namespace

namespace {

/// Separates points that the frames use more than once (by several states, or by a state and unchanged). A text has a
/// single name for an object and for what it becomes, so every use but one gets a copy of the node that makes the
/// points.
class SharedPoints {
  public:
    explicit SharedPoints(Graph graph) : mGraph(std::move(graph)) {}

    Graph separated() {
        std::set<Link> used, moved;
        for (size_t k = 0; k < mGraph.states.size(); ++k) {
            if (const auto initial = mGraph.states[k].initial; initial && !used.insert(*initial).second)
                mGraph.states[k].initial = copyOf(*initial);
            const State& state = mGraph.states[k];
            if (state.initial && state.next != Link{.from = Link::From::state, .index = k})
                moved.insert(*state.initial);
        }
        for (const Link& link : moved)
            if (readInFrames(link)) {
                const Link copy = copyOf(link);
                for (size_t k = mGraph.frames; k < mGraph.nodes.size(); ++k)
                    for (auto& links : mGraph.nodes[k].inputs) std::replace(links.begin(), links.end(), link, copy);
            }
        return std::move(mGraph);
    }

  private:
    bool readInFrames(const Link& link) const {
        for (size_t k = mGraph.frames; k < mGraph.nodes.size(); ++k)
            for (const auto& links : mGraph.nodes[k].inputs)
                if (std::find(links.begin(), links.end(), link) != links.end()) return true;
        return false;
    }

    /// Adds a copy of the node as the last one before the frames.
    Link copyOf(const Link& link) {
        const size_t at = mGraph.frames;
        Node copy = mGraph.nodes.at(link.index);
        for (size_t i = 0; i < copy.inputs.size(); ++i)
            if (copy.action().takes[i].use == Use::changed && !copy.inputs[i].empty())
                throw ValueError(
                    fmt::format("the points of '{}' are used twice in the frames, but a scene has only one name for "
                                "them; write the graph as .json, or give each use its own points",
                                nameOf(mGraph, link)));
        copy.name = unusedName(mGraph, copy.name + "_copy");
        const auto shift = [&](Link& one) {
            if (one.from == Link::From::node && one.index >= at) ++one.index;
        };
        for (Node& node : mGraph.nodes)
            for (auto& links : node.inputs)
                for (Link& one : links) shift(one);
        for (State& state : mGraph.states) shift(state.next);
        mGraph.nodes.insert(mGraph.nodes.begin() + static_cast<std::ptrdiff_t>(at), std::move(copy));
        ++mGraph.frames;
        return {.index = at, .output = link.output};
    }

    Graph mGraph;
};

} // namespace

std::string sceneOf(const Graph& graph) {
    const Graph separated = SharedPoints(graph).separated();
    std::set<std::string> named;
    for (;;) {
        SceneWriter writer(separated, named);
        std::string text = writer.text();
        const size_t before = named.size();
        named.insert(writer.used().begin(), writer.used().end());
        if (named.size() == before) return text;
    }
}

} // namespace curlew::app
