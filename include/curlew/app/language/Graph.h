// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Action.h"

#include <compare>

namespace curlew::app {

/// Where an error is: a line of a scene and the action on it, or a node of a graph.
struct SourceLocation {
    int line = 0;            ///< From 1; where scenes include others, of the outermost. 0: of no scene.
    std::string file = {};   ///< "scene.txt:3"; "" on a command line.
    std::string action = {}; ///< "" before the first one.
    std::string node = {};   ///< The node's name; "" where there is none.
};

/// "-bound", "-bound 'hull'" or "scene.txt:3: -bound": what messages about a node begin with.
std::string contextOf(const SourceLocation& location);

/// A reference to an object: what an input is linked to.
struct Link {
    enum class From {
        node,  ///< An output of a node.
        state, ///< Points as the frame begins: what the last frame left of them.
        given, ///< An object of an earlier program of the session.
    };
    From from = From::node;
    size_t index = 0;  ///< Of the node, the state or the given object.
    size_t output = 0; ///< Of the node.

    // clang-tidy 14 takes the 0 in the comparison that the compiler makes of it for a null pointer.
    auto operator<=>(const Link&) const = default; // NOLINT(modernize-use-nullptr)
};

/// An object on a stack, and when it was pushed.
struct Entry {
    Link link;
    Object object;
    uint64_t made = 0;
    std::optional<size_t> state = {}; ///< Of points that the next frame sees: the state that they become.
};

/// An action with its options, its inputs and what it makes.
struct Node {
    Arguments arguments;
    std::vector<std::vector<Link>> inputs = {}; ///< By declared input.
    std::vector<Object> outputs = {};
    std::string name = {}; ///< Unique in the graph.
    bool named = false;    ///< By the user (as=), and not after its action.
    SourceLocation location = {};
    std::vector<Entry> took = {}; ///< What it takes from the stacks, or changes there.

    const Action& action() const { return arguments.action(); }
    /// The output that a link by the node's name alone means: the one that is always made. Throws ValueError if the
    /// node makes nothing.
    size_t primaryOutput() const;
};

/// Points that are carried from frame to frame.
struct State {
    std::optional<Link> initial = {}; ///< What the first frame begins with; nullopt: no points.
    Link next = {};                   ///< What the next frame begins with.
    std::string name = {};
};

/// An object that is there before the program runs, with its name if it has one.
struct Given {
    Object object;
    std::string name = {};
};

/// A program: nodes in an order in which each one follows what it needs. All text (stacks, ages, names) has been
/// resolved to links.
struct Graph {
    std::vector<Node> nodes = {};
    size_t frames = 0;                        ///< The first node that is evaluated in each frame; nodes.size(): none.
    std::optional<Arguments> frameRange = {}; ///< -frames with its options.
    SourceLocation frameLocation = {};
    std::vector<State> states = {};
    std::vector<Given> given = {};
    bool resume = false;
    /// If not empty, only these nodes, the effects and what they need are evaluated.
    std::vector<std::string> wanted = {};
    bool effects = true; ///< false: effects are left out.

    /// What is on the stacks at the end of the program, and at the end of each frame.
    std::vector<Entry> left = {}, leftInFrame = {};

    const Object& objectOf(const Link& link) const;
    bool inFrames(size_t node) const { return node >= frames; }
    /// The node of that name; nullopt if there is none.
    std::optional<size_t> find(std::string_view name) const;
};

/// The link that a name stands for: "smoke" (the primary output of that node), "smoke.density", "file.2", a state or a
/// given object. Throws ValueError with the nearest name if there is none.
Link linkOf(const Graph& graph, const std::string& name);
/// The name that stands for a link.
std::string nameOf(const Graph& graph, const Link& link);

/// Whether a name can be given to a node: letters, digits, _ and -, not beginning with a digit.
bool isNodeName(std::string_view name);
/// `wanted`, or that with a number if another node has it already.
std::string unusedName(const Graph& graph, const std::string& wanted);

/// "a shape or a level set".
std::string phraseOf(const std::vector<Kind>& kinds);

/// What a node makes, with the arguments of the first moment that it is evaluated at.
std::vector<Object> outputsOf(const Arguments& arguments, const std::vector<std::vector<Object>>& inputs,
                              const World& world);

/// Throws ValueError if the objects that a node is linked to do not fit its inputs, or if some are missing or have no
/// effect with its options.
void validate(const Graph& graph, size_t index);

} // namespace curlew::app
