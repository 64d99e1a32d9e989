#include "curlew/app/Registry.h"

#include "curlew/app/Text.h"
#include "curlew/base/Error.h"
#include "curlew/base/Simd.h"

#include <fmt/format.h>
#include <openvdb/openvdb.h>

#include <algorithm>

namespace curlew::app {

const std::vector<Action>& registry() {
    static const std::vector<Action> all = [] {
        std::vector<Action> actions;
        for (auto* room : {&fileActions, &shapeActions, &noiseActions, &fieldActions, &flowActions, &gridActions,
                           &pointActions, &emitActions, &jitterActions, &curveActions, &levelSetActions, &imageActions,
                           &pictureActions, &surfaceActions, &frameActions, &programActions})
            for (auto& action : room()) actions.push_back(std::move(action));
        return actions;
    }();
    return all;
}

const Action& findAction(std::string_view name) {
    std::vector<std::string> names;
    for (const auto& action : registry()) {
        if (action.name == name) return action;
        names.push_back(action.name);
    }
    throw ValueError(fmt::format("there is no action '-{}'{}; see curlew -list", name, didYouMean(name, names)));
}

namespace {

std::string typeName(const Option& o) {
    switch (o.type) {
        case OptionType::flag:
            return "0|1";
        case OptionType::integer:
            return "whole number";
        case OptionType::real:
            return "number";
        case OptionType::vector:
            return "x,y,z";
        case OptionType::coordinates:
            return "x,y,…";
        case OptionType::interval:
            return "lower,upper";
        case OptionType::box:
            return "xmin,ymin,zmin,xmax,ymax,zmax";
        case OptionType::choice:
            return join(o.choices, "|");
        case OptionType::text:
            return "text";
        case OptionType::ages:
            return "ages";
    }
    return "";
}

std::string describe(const Option& o) {
    std::string text = o.help;
    if (!o.unit.empty()) text += fmt::format(" [{}]", o.unit);
    if (!o.fallback.empty()) text += fmt::format(" (default {})", o.fallback);
    return text;
}

std::string optionsOf(const Action& action) {
    std::vector<std::string> names;
    if (!action.positional.what.empty()) names.push_back(action.positional.what);
    for (const auto& o : action.options) names.push_back(o.name + "=");
    return join(names, " ");
}

} // namespace

std::string helpTable() {
    std::string table = "| action | does | takes | makes | options |\n|---|---|---|---|---|\n";
    for (const auto& a : registry())
        table += fmt::format("| `-{}` | {} | {} | {} | {} |\n", a.name, a.summary, a.inputs, a.outputs,
                             optionsOf(a).empty() ? "" : "`" + optionsOf(a) + "`");
    return table;
}

std::string helpOverview() {
    std::string text =
        "curlew -action [option=value …] -action …\n\n"
        "Actions run from left to right on stacks of fields, flows, grids, geometry and images.\n"
        "grid=0 is the newest grid; a unique beginning of an option's name is enough.\n"
        "{2*pi*T} in a value is an expression: F is the frame, T its time in seconds, 0 in the first frame; without\n"
        "-frames, F is 1 and T is 0. In file names, $F4 is the frame with four digits.\n";
    std::string group;
    for (const auto& a : registry()) {
        if (a.group != group) text += fmt::format("\n{}\n", group = a.group);
        text += fmt::format("  -{:<12} {}\n", a.name, a.summary);
    }
    return text + "\ncurlew -help ACTION tells its options and shows examples.\n";
}

std::string helpFor(const Action& action) {
    std::string text = fmt::format("-{}", action.name);
    if (!action.positional.what.empty()) text += " " + action.positional.what;
    if (!action.options.empty()) text += " [option=value …]";
    text += fmt::format("\n  {}\n", action.summary);
    if (!action.inputs.empty()) text += fmt::format("  takes: {}\n", action.inputs);
    if (!action.outputs.empty()) text += fmt::format("  makes: {}\n", action.outputs);
    if (!action.options.empty()) text += "\n";
    for (const auto& o : action.options)
        text += fmt::format("  {}={}\n{}\n", o.name, typeName(o), wrapped(describe(o), 6, 100));
    if (!action.examples.empty()) text += "\nfor example\n";
    for (const auto& example : action.examples) text += fmt::format("  {}\n", example);
    return text;
}

std::string versionText() {
    return fmt::format("curlew {} (OpenVDB {}, {})\n", CURLEW_VERSION, openvdb::getLibraryVersionString(),
                       nameOf(activeSimd()));
}

} // namespace curlew::app
