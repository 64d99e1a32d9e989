// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/registry/Json.h"
#include "curlew/app/registry/Registry.h"

#include <array>

namespace curlew::app {

namespace {

constexpr std::array kTypes{"flag",     "integer", "real",   "length", "vector", "coordinates",
                            "interval", "box",     "choice", "text",   "ages"};
constexpr std::array kKinds{"field", "noise",  "shape",  "flow",  "grid",   "levelSet", "velocity",
                            "mesh",  "points", "curves", "image", "report", "file"};
constexpr std::array kUses{"taken", "stays", "changed"};
constexpr std::array kInFrames{"as inputs", "once", "each"};
constexpr std::array kEvaluations{"value", "any time", "file", "effect"};

Json boundOf(double bound) { return std::isfinite(bound) ? Json(bound) : Json(nullptr); }

Json namesOf(const std::vector<Kind>& kinds) {
    Json names = Json::array();
    for (const Kind kind : kinds) names.push_back(nameOf(kind));
    return names;
}

Json json(const Input& input) {
    return {{"name", input.name},
            {"kinds", namesOf(input.kinds)},
            {"minimum", input.amount.min},
            {"maximum", input.amount.max},
            {"use", kUses.at(static_cast<size_t>(input.use))},
            {"accumulates", input.accumulates},
            {"age", input.age},
            {"help", input.help}};
}

Json json(const Output& output) {
    return {{"name", output.name},
            {"kinds", namesOf(output.kinds)},
            {"minimum", output.amount.min},
            {"maximum", output.amount.max},
            {"flag", output.flag}};
}

Json json(const Option& option) {
    return {{"name", option.name},
            {"type", kTypes.at(static_cast<size_t>(option.type))},
            {"default", option.fallback},
            {"help", option.help},
            {"unit", option.unit},
            {"choices", option.choices},
            {"lower", boundOf(option.lower)},
            {"upper", boundOf(option.upper)},
            {"exclusive", option.exclusive},
            {"implied", option.implied},
            {"only_with", option.onlyWith},
            {"formerly", option.formerly},
            {"selects", option.selects || option.type == OptionType::ages}};
}

Json json(const Action& action);

template <class T>
Json list(const std::vector<T>& items) {
    Json all = Json::array();
    for (const T& item : items) all.push_back(json(item));
    return all;
}

Json json(const Action& action) {
    return {{"name", action.name},
            {"group", action.group},
            {"summary", action.summary},
            {"details", action.details},
            {"short_name", action.shortName},
            {"inputs", list(action.takes)},
            {"outputs", list(action.makes)},
            {"options", list(action.options)},
            {"positional",
             {{"what", action.positional.what},
              {"minimum", action.positional.minimum},
              {"maximum", action.positional.maximum}}},
            {"evaluation", kEvaluations.at(static_cast<size_t>(action.evaluation))},
            {"in_frames", kInFrames.at(static_cast<size_t>(action.inFrames))},
            {"setting", action.setting},
            {"varies", action.varies},
            {"examples", action.examples}};
}

} // namespace

const char* nameOf(Kind kind) { return kKinds.at(static_cast<size_t>(kind)); }

std::string registryJson(const Registry& registry) { return Json{{"actions", list(registry)}}.dump(1) + "\n"; }

} // namespace curlew::app
