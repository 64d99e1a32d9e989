// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/language/Graph.h"

#include <map>

namespace curlew::app {

/// The context in which the functions below read a program.
struct Reading {
    const Registry& registry;
    World world = {};
    /// Objects that an earlier program left on the stacks, oldest first.
    std::vector<Given> given = {};
    /// If not null, receives the location of an error that is thrown.
    SourceLocation* location = nullptr;
};

/// Reads a command line (without the command's name): -action [word …] [option=value …] …
/// `-config file` inserts the actions of that file, or the graph of a .json file. Throws ValueError if the program is
/// invalid and FileError if a scene cannot be read; the message names the action.
Graph graphOfCommandLine(const std::vector<std::string>& tokens, const Reading& reading);

/// Reads a scene: one action per line, its dash optional; # starts a comment, \ at the end continues a line. Messages
/// call the text `name`.
Graph graphOfScene(const std::string& text, const std::string& name, const Reading& reading);

/// Reads a JSON document (docs/graph.md). Nodes may come in any order; a node without "when" is evaluated in each frame
/// if it changes with time.
Graph graphOfJson(const std::string& text, const Reading& reading);

/// Reads a scene or a JSON document; the latter begins with {.
Graph graphOfText(const std::string& text, const std::string& name, const Reading& reading);

/// Writes the graph as a JSON document, from which graphOfJson() makes the same graph.
std::string jsonOf(const Graph& graph);

/// Writes the graph as a scene, from which graphOfScene() makes the same graph. An object is referred to by name only
/// if the newest object would be a different one.
std::string sceneOf(const Graph& graph);

} // namespace curlew::app
