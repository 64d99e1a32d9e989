// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/language/Graph.h"

#include <map>

namespace curlew::app {

/// What a program is read with.
struct Reading {
    const Registry& registry;
    World world = {};
    /// Objects that are there already, oldest first, on the stacks as an earlier program left them.
    std::vector<Given> given = {};
    /// Where it throws: what the error is about.
    SourceLocation* location = nullptr;
};

/// The graph of a command line (without the command's name): -action [word …] [option=value …] …
/// `-config file` stands for the actions of that file, or for the graph of a .json file. Throws ValueError, or
/// FileError for a scene that cannot be read, with the action's name in the message.
Graph graphOfCommandLine(const std::vector<std::string>& tokens, const Reading& reading);

/// The graph of a scene: one action a line, its dash optional; # starts a comment, \ at the end continues a line.
/// `name` stands for the text in messages.
Graph graphOfScene(const std::string& text, const std::string& name, const Reading& reading);

/// The graph of a JSON document (docs/graph.md). Nodes may come in any order; a node without "when" is evaluated in
/// each frame if it changes with time.
Graph graphOfJson(const std::string& text, const Reading& reading);

/// The graph of either: a JSON document begins with {.
Graph graphOfText(const std::string& text, const std::string& name, const Reading& reading);

/// The graph as a JSON document, from which graphOfJson() makes the same graph.
std::string jsonOf(const Graph& graph);

/// The graph as a scene, from which graphOfScene() makes the same graph. Objects have names where the newest one would
/// not do.
std::string sceneOf(const Graph& graph);

} // namespace curlew::app
