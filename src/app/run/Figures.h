// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include <string>
#include <string_view>

namespace curlew::app {

/// A figure that the actions have put into the report, by its path, as "check/outside". Throws ValueError, with what
/// there is, where that is no number.
double figureOf(const nlohmann::ordered_json& report, const std::string& path);

/// The text with the figure, to three digits if it is not whole, for each [path], and [ for [[. Throws ValueError as
/// figureOf() does, and for a [ that does not end.
std::string withFigures(const nlohmann::ordered_json& report, std::string_view text);

} // namespace curlew::app
