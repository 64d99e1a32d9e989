// SPDX-License-Identifier: Apache-2.0
#include "Figures.h"

#include "curlew/app/registry/Text.h"
#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <vector>

namespace curlew::app {

namespace {

const Json& numberIn(const Json& report, const std::string& path) {
    const Json* found = &report;
    for (const auto& name : split(path, '/')) {
        if (!found->is_object() || !found->contains(name)) {
            std::vector<std::string> names;
            if (found->is_object())
                for (const auto& [known, value] : found->items()) names.push_back(known);
            throw ValueError(fmt::format("the report has no '{}'{}; that section has {}", path, didYouMean(name, names),
                                         names.empty() ? "nothing" : join(names, ", ")));
        }
        found = &found->at(name);
    }
    if (!found->is_number()) throw ValueError(fmt::format("'{}' is not a number in the report", path));
    return *found;
}

std::string shown(const Json& number) {
    return number.is_number_float() ? fmt::format("{:#.3g}", number.get<double>()) : number.dump();
}

} // namespace

double figureOf(const Json& report, const std::string& path) { return numberIn(report, path).get<double>(); }

std::string withFigures(const Json& report, std::string_view text) {
    std::string result;
    for (size_t at = 0; at < text.size();) {
        if (text[at] != '[') {
            result += text[at++];
        } else if (text.substr(at).starts_with("[[")) {
            result += '[';
            at += 2;
        } else {
            const size_t end = text.find(']', at);
            if (end == std::string_view::npos)
                throw ValueError(fmt::format("'{}' has a [ without a ]; for a plain [ write [[", text.substr(at)));
            result += shown(numberIn(report, std::string(text.substr(at + 1, end - at - 1))));
            at = end + 1;
        }
    }
    return result;
}

} // namespace curlew::app
