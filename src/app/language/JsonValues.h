// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Json.h"

#include <string>
#include <vector>

namespace curlew::app {

// Read values of a JSON document. All throw ValueError, naming the value, if it has the wrong type.

/// Returns a text, a number, true or false, or a list of those, in the form of an option's value: "1,2,3".
std::string textOf(const Json& value);
/// Throws ValueError unless the value is an object with known members only; suggests the nearest name.
void requireKeys(const Json& object, const std::vector<std::string>& known, const char* what);
/// Returns a copy of a member; `otherwise` if it is missing.
Json memberOf(const Json& object, const char* name, const Json& otherwise);
bool flagOf(const Json& object, const char* name, bool otherwise);
/// Returns a member that is one text or a list of texts; empty if it is missing.
std::vector<std::string> textsOf(const Json& object, const char* name);

} // namespace curlew::app
