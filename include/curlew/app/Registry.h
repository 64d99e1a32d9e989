#pragma once

#include "curlew/app/Action.h"

namespace curlew::app {

/// All actions, in the order in which help lists them.
const std::vector<Action>& registry();

/// The action of that name; throws ValueError, with the nearest name, where there is none.
const Action& findAction(std::string_view name);

/// The actions of each room; registry() puts them together.
std::vector<Action> fileActions();
std::vector<Action> shapeActions();
std::vector<Action> noiseActions();
std::vector<Action> fieldActions();
std::vector<Action> flowActions();
std::vector<Action> gridActions();
std::vector<Action> pointActions();
std::vector<Action> emitActions();
std::vector<Action> jitterActions();
std::vector<Action> curveActions();
std::vector<Action> levelSetActions();
std::vector<Action> imageActions();
std::vector<Action> surfaceActions();
std::vector<Action> pictureActions();
std::vector<Action> frameActions();
std::vector<Action> programActions();

/// All of them as a table in Markdown, and in plain text; one action in full.
std::string helpTable();
std::string helpOverview();
std::string helpFor(const Action& action);

/// All of them as JSON, for programs that build interfaces: {"actions": [{"name", "group", "summary", "inputs",
/// "outputs", "options", "positional", "examples"}]}. An option without a bound has null there; its type is a word of
/// OptionType.
std::string registryJson();

/// "curlew 0.1.0 (OpenVDB 10.0.1, AVX2)" and a line break.
std::string versionText();

} // namespace curlew::app
