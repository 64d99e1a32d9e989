// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Action.h"

namespace curlew::app {

/// Returns the action with this name or short name. Throws ValueError, suggesting the nearest name, if there is none.
const Action& findAction(const Registry& registry, std::string_view name);

/// Describe the inputs and the outputs of an action in one phrase each: "2 fields", "flow (which stays)".
std::string inputsOf(const Action& action);
std::string outputsOf(const Action& action);

/// Return all actions as a Markdown table, all actions as plain text, and one action in full.
std::string helpTable(const Registry& registry);
std::string helpOverview(const Registry& registry);
std::string helpFor(const Action& action);
/// Returns the actions and options that mention a word in their names, former names, choices or texts. Throws
/// ValueError, suggesting the nearest name, if there are none.
std::string helpSearch(const Registry& registry, const std::string& word);

/// Returns all actions as JSON, for programs that build user interfaces: {"actions": [{"name", "group", "summary",
/// "details", "short_name", "inputs", "outputs", "options", "positional", "evaluation", "in_frames", "setting",
/// "examples"}]}. A bound that an option does not have is null; the option's type is a word of OptionType.
std::string registryJson(const Registry& registry);

} // namespace curlew::app
