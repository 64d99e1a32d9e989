// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

/// JSON objects that keep the order of their keys, instantiated in src/app/registry/Json.cpp.
extern template class nlohmann::basic_json<nlohmann::ordered_map>;

namespace curlew::app {

using Json = nlohmann::ordered_json;

} // namespace curlew::app
