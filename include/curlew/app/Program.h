#pragma once

#include "curlew/app/Session.h"

#include <string>
#include <vector>

namespace curlew::app {

/// A list of actions with their arguments, checked and ready to run: what a command line and a scene file both become.
struct Program {
    std::vector<Arguments> actions;
};

/// The program of a command line (without the command's name): -action [word …] [option=value …] …
/// `-config file` stands for the actions of that file. Throws ValueError, or FileError for a scene that cannot be read,
/// with the action's name in the message.
Program parseCommandLine(const std::vector<std::string>& tokens);

/// The program of a scene file: one action a line, its dash optional; # starts a comment, \ at the end continues a
/// line. Where it throws, and there is a `place`, that is what the error is about.
Program parseScene(const std::string& text, const std::string& name, Place* place = nullptr);

/// Runs the actions in order. Errors carry the action's name; what was written before stays.
void run(const Program& program, Session& session);

/// The program as a scene file, which does the same.
std::string sceneOf(const Program& program);

} // namespace curlew::app
