// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Action.h"

#include <compare>

namespace curlew::app {

/// Where an error occurred: a line of a scene and its action, or a node of a graph.
struct SourceLocation {
    int line = 0;            ///< Counted from 1, in the outermost scene if scenes include others. 0: not in a scene.
    std::string file = {};   ///< "scene.txt:3"; "" for a command line.
    std::string action = {}; ///< "" before the first action.
    std::string node = {};   ///< The node's name; "" if it has none.
};

/// Returns the beginning of a message about a node: "-bound", "-bound 'hull'" or "scene.txt:3: -bound".
std::string contextOf(const SourceLocation& location);

/// A reference to an object, the source of an input.
struct Link {
    enum class From {
        node,  ///< An output of a node.
        state, ///< Points at the beginning of the frame, as the previous frame left them.
        given, ///< An object that an earlier program of the session made.
    };
    From from = From::node;
    size_t index = 0;  ///< Index of the node, the state or the given object.
    size_t output = 0; ///< Index of the node's output.

    // clang-tidy 14 mistakes the 0 in the generated comparison for a null pointer.
    auto operator<=>(const Link&) const = default; // NOLINT(modernize-use-nullptr)
};

/// An object on a stack.
struct Entry {
    Link link;
    Object object;
    uint64_t made = 0;
    std::optional<size_t> state = {}; ///< For points that are carried to the next frame: the index of their state.
};

/// An action with its options, inputs and outputs.
struct Node {
    Arguments arguments;
    std::vector<std::vector<Link>> inputs = {}; ///< Indexed as the action's declared inputs.
    std::vector<Object> outputs = {};
    std::string name = {}; ///< Unique in the graph.
    bool named = false;    ///< Whether the user named the node (as=). Otherwise its name derives from its action.
    SourceLocation location = {};
    std::vector<Entry> consumed = {}; ///< The stack entries that the node takes or changes.

    const Action& action() const { return arguments.action(); }
    /// Returns the output that the node's name alone refers to: the one that is always made. Throws ValueError if the
    /// node has no output.
    size_t primaryOutput() const;
};

/// Points that are carried from frame to frame.
struct State {
    std::optional<Link> initial = {}; ///< The points at the start of the first frame; nullopt: no points.
    Link next = {};                   ///< The points at the start of the next frame.
    std::string name = {};
};

/// An object that exists before the program runs.
struct Given {
    Object object;
    std::string name = {};
};

/// A program: nodes in topological order. Stack positions, ages and names have been resolved to links.
struct Graph {
    std::vector<Node> nodes = {};
    size_t frames = 0; ///< The first node that is evaluated in each frame; nodes.size() if there is none.
    std::optional<Arguments> frameRange = {}; ///< The options of -frames.
    SourceLocation frameLocation = {};
    std::vector<State> states = {};
    std::vector<Given> given = {};
    Moment moment = {}; ///< The moment of a graph without frames.
    bool resume = false;
    /// If not empty, only these nodes, the effects and their dependencies are evaluated.
    std::vector<std::string> wanted = {};
    bool effects = true; ///< If false, effects are skipped.

    /// The stacks at the end of the program, and at the end of each frame.
    std::vector<Entry> left = {}, leftInFrame = {};

    const Object& objectOf(const Link& link) const;
    bool inFrames(size_t node) const { return node >= frames; }
    /// Returns the node with this name; nullopt if there is none.
    std::optional<size_t> find(std::string_view name) const;
};

/// Resolves a name: "smoke" (the node's primary output), "smoke.density", "file.2", a state or a given object. Throws
/// ValueError, suggesting the nearest name, if nothing has this name.
Link linkOf(const Graph& graph, const std::string& name);
/// Returns the name that refers to a link.
std::string nameOf(const Graph& graph, const Link& link);

/// Returns whether a text is a valid node name: letters, digits, _ and -, not beginning with a digit.
bool isNodeName(std::string_view name);
/// Returns `wanted`, with a number appended if another node already has that name.
std::string unusedName(const Graph& graph, const std::string& wanted);

/// "a shape or a level set".
std::string phraseOf(const std::vector<Kind>& kinds);

/// Returns the objects that a node makes. The arguments are those of the first moment at which it is evaluated.
std::vector<Object> outputsOf(const Arguments& arguments, const std::vector<std::vector<Object>>& inputs,
                              const World& world);

/// Throws ValueError if a node's linked objects do not fit its inputs, if an input is missing, or if the node's options
/// leave an input without effect.
void validate(const Graph& graph, size_t index);

} // namespace curlew::app
