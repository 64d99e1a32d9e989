// SPDX-License-Identifier: Apache-2.0
#include "JsonValues.h"

#include "curlew/app/registry/Text.h"
#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <algorithm>

namespace curlew::app {

std::string textOf(const Json& value) {
    if (value.is_string()) return value.get<std::string>();
    if (value.is_boolean()) return value.get<bool>() ? "1" : "0";
    if (value.is_number_integer()) return value.dump();
    if (value.is_number()) return fmt::format("{}", value.get<double>());
    if (value.is_array()) {
        std::vector<std::string> parts;
        for (const Json& part : value) parts.push_back(textOf(part));
        return join(parts, ",");
    }
    throw ValueError(
        fmt::format("{} is not a value: it must be text, a number, true, false or a list of numbers", value.dump()));
}

void requireKeys(const Json& object, const std::vector<std::string>& known, const char* what) {
    if (!object.is_object()) throw ValueError(fmt::format("{} must be an object, not {}", what, object.dump()));
    for (const auto& [key, value] : object.items())
        if (std::find(known.begin(), known.end(), key) == known.end())
            throw ValueError(fmt::format("{} has no member '{}'{}; its members are {}", what, key,
                                         didYouMean(key, known), join(known, ", ")));
}

Json memberOf(const Json& object, const char* name, const Json& otherwise) {
    const auto found = object.find(name);
    return found == object.end() ? otherwise : *found;
}

bool flagOf(const Json& object, const char* name, bool otherwise) {
    const Json value = memberOf(object, name, otherwise);
    if (!value.is_boolean()) throw ValueError(fmt::format("'{}' must be true or false, not {}", name, value.dump()));
    return value.get<bool>();
}

std::vector<std::string> textsOf(const Json& object, const char* name) {
    const Json value = memberOf(object, name, Json::array());
    std::vector<std::string> texts;
    if (value.is_string())
        texts.push_back(value.get<std::string>());
    else if (value.is_array())
        for (const Json& one : value) texts.push_back(textOf(one));
    else
        throw ValueError(fmt::format("'{}' must be text or a list of texts, not {}", name, value.dump()));
    return texts;
}

} // namespace curlew::app
