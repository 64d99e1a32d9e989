// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Action.h"

namespace curlew::app {

/// The action of that name; throws ValueError, with the nearest name, if there is none.
const Action& findAction(const Registry& registry, std::string_view name);

/// What an action takes and makes, as one phrase each, made from its declaration: "2 fields", "flow (which stays)".
std::string inputsOf(const Action& action);
std::string outputsOf(const Action& action);

/// All actions as a table in Markdown, and in plain text; one action in full.
std::string helpTable(const Registry& registry);
std::string helpOverview(const Registry& registry);
std::string helpFor(const Action& action);

/// All actions as JSON, for programs that build interfaces: {"actions": [{"name", "group", "summary", "inputs",
/// "outputs", "options", "positional", "examples", "evaluation", "in_frames", "setting"}]}. An option without a bound
/// has null there; its type is a word of OptionType.
std::string registryJson(const Registry& registry);

} // namespace curlew::app
