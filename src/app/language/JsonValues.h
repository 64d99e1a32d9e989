// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace curlew::app {

using Json = nlohmann::ordered_json;

// Values of a JSON document. All throw ValueError, naming the value, if it is of another type.

/// Text, a number, true or false, or a list of those as an option has it: "1,2,3".
std::string textOf(const Json& value);
/// Throws ValueError, with the nearest name, unless the value is an object with no other members than these.
void requireKeys(const Json& object, const std::vector<std::string>& known, const char* what);
/// A copy of a member; `otherwise` if there is none.
Json memberOf(const Json& object, const char* name, const Json& otherwise);
bool flagOf(const Json& object, const char* name, bool otherwise);
/// One text or a list of texts; empty if there is no such member.
std::vector<std::string> textsOf(const Json& object, const char* name);

} // namespace curlew::app
