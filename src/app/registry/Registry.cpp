// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/registry/Registry.h"

#include "curlew/app/registry/Text.h"
#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace curlew::app {

const Action& findAction(const Registry& registry, std::string_view name) {
    std::vector<std::string> names;
    for (const auto& action : registry) {
        if (action.name == name || (!name.empty() && action.shortName == name)) return action;
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
            return "integer";
        case OptionType::real:
            return "number";
        case OptionType::length:
            return "number or 5%";
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
    if (!o.onlyWith.empty()) text += fmt::format("; only with {}", join(o.onlyWith, " or "));
    if (!o.unit.empty()) text += fmt::format(" [{}]", o.unit);
    if (!o.fallback.empty()) text += fmt::format(" (default: {})", o.fallback);
    return text;
}

/// Returns whether a text contains a word, in any case.
bool mentions(std::string_view text, std::string_view word) {
    const auto same = [](unsigned char a, unsigned char b) { return std::tolower(a) == std::tolower(b); };
    return std::search(text.begin(), text.end(), word.begin(), word.end(), same) != text.end();
}

std::string optionsOf(const Action& action) {
    std::vector<std::string> names;
    if (!action.positional.what.empty()) names.push_back(action.positional.what);
    for (const auto& o : action.options) names.push_back(o.name + "=");
    return join(names, " ");
}

std::string kindsPhrase(const std::vector<Kind>& kinds) {
    std::vector<std::string> names;
    names.reserve(kinds.size());
    for (const Kind kind : kinds)
        names.emplace_back(kind == Kind::levelSet ? "level set" : kind == Kind::noise ? "field" : nameOf(kind));
    return join(names, " or ");
}

/// "2 fields", "1 or 2 fields", "flow".
std::string countedPhrase(const std::vector<Kind>& kinds, const Amount& amount) {
    if (amount.max <= 1) return kindsPhrase(kinds);
    return amount.max >= 100          ? fmt::format("{}, any number", kindsPhrase(kinds))
           : amount.min == amount.max ? fmt::format("{} × {}", amount.max, kindsPhrase(kinds))
                                      : fmt::format("{} to {} × {}", amount.min, amount.max, kindsPhrase(kinds));
}

/// Shows options in two columns, names and meanings. A name that does not fit has a line of its own.
std::string optionLines(const std::vector<Option>& options) {
    constexpr size_t kColumn = 24, kWidth = 100;
    std::string lines;
    for (const auto& o : options) {
        const std::string name = fmt::format("  {}={}", o.name, typeName(o));
        const std::string padded = fmt::format("{:<{}}", name, kColumn); // of characters; size() counts bytes
        const std::string meaning = wrapped(describe(o), kColumn, kWidth);
        lines += padded.ends_with("  ") ? padded + meaning.substr(kColumn) : name + "\n" + meaning;
        lines += '\n';
    }
    return lines;
}

} // namespace

std::string inputsOf(const Action& action) {
    std::vector<std::string> parts;
    for (const Input& input : action.takes) {
        std::string part = fmt::format("{}: {}", input.name, countedPhrase(input.kinds, input.amount));
        std::vector<std::string> notes;
        if (input.amount.min == 0) notes.push_back(input.help.empty() ? "optional" : input.help);
        if (input.use == Use::stays) notes.emplace_back("kept");
        if (input.use == Use::changed) notes.emplace_back("modified");
        if (!notes.empty()) part += fmt::format(" ({})", join(notes, "; "));
        parts.push_back(std::move(part));
    }
    return join(parts, ", ");
}

std::string outputsOf(const Action& action) {
    std::vector<std::string> parts;
    for (const Output& output : action.makes) {
        std::string part = countedPhrase(output.kinds, output.amount);
        if (output.name != nameOf(output.kinds.front())) part = fmt::format("{}: {}", output.name, part);
        if (!output.flag.empty()) part += fmt::format(" (with {}=1)", output.flag);
        parts.push_back(std::move(part));
    }
    return join(parts, ", ");
}

std::string helpTable(const Registry& registry) {
    std::string table = "| action | does | takes | makes | options |\n|---|---|---|---|---|\n";
    for (const auto& a : registry)
        table += fmt::format("| `-{}` | {} | {} | {} | {} |\n", a.name, a.summary, inputsOf(a), outputsOf(a),
                             optionsOf(a).empty() ? "" : "`" + optionsOf(a) + "`");
    return table;
}

std::string helpOverview(const Registry& registry) {
    std::string text =
        "curlew -action [option=value …] -action …\n\n"
        "Actions run from left to right on stacks of fields, flows, grids, geometry and images.\n"
        "grid=0 is the newest grid. Names of options may be shortened to a unique prefix.\n"
        "A length of 5% is relative to the diagonal of the bounding box of the action's input.\n"
        "{2*pi*T} in a value is an expression: F is the frame, T its time in seconds, 0 in the first frame; without\n"
        "-frames, F is 1 and T is 0. In file names, $F4, #### and %04d are the frame number with four digits;\n"
        "put such a name in single quotes, since a shell replaces $F4. P and $P are the part of -scatter "
        "part=each/8.\n";
    std::string group;
    for (const auto& a : registry) {
        if (a.group != group) text += fmt::format("\n{}\n", group = a.group);
        text += fmt::format("  -{:<12} {}\n", a.name, a.summary);
    }
    return text +
           "\ncurlew -help ACTION shows the options of an action, and examples. curlew -help search=WORD finds "
           "actions and options.\n";
}

std::string helpSearch(const Registry& registry, const std::string& word) {
    std::string text;
    std::vector<std::string> names;
    for (const auto& action : registry) {
        names.push_back(action.name);
        std::vector<Option> found;
        for (const auto& o : action.options) {
            names.push_back(o.name);
            if (mentions(o.name, word) || mentions(o.help, word) || mentions(join(o.formerly, " "), word) ||
                mentions(join(o.choices, " "), word))
                found.push_back(o);
        }
        std::string lines = optionLines(found);
        for (const auto& example : action.examples)
            if (mentions(example, word)) lines += fmt::format("  {}\n", example);
        if (!lines.empty() || mentions(action.name, word) || mentions(action.summary, word) ||
            mentions(action.details, word))
            text += fmt::format("-{:<12} {}\n{}", action.name, action.summary, lines);
    }
    if (text.empty())
        throw ValueError(fmt::format("no action, option or example mentions '{}'{}", word, didYouMean(word, names)));
    return text;
}

std::string helpFor(const Action& action) {
    std::string text = fmt::format("-{}", action.name);
    if (!action.positional.what.empty()) text += " " + action.positional.what;
    if (!action.options.empty()) text += " [option=value …]";
    text += fmt::format("\n  {}\n", action.summary);
    if (!action.shortName.empty()) text += fmt::format("  short: -{}\n", action.shortName);
    if (!action.details.empty()) text += wrapped(action.details, 2, 100) + "\n";
    if (!action.takes.empty()) text += wrapped("takes: " + inputsOf(action), 2, 100) + "\n";
    if (!action.makes.empty()) text += wrapped("makes: " + outputsOf(action), 2, 100) + "\n";
    if (!action.options.empty()) text += "\n" + optionLines(action.options);
    if (!action.examples.empty()) text += "\nexamples\n";
    for (const auto& example : action.examples) text += fmt::format("  {}\n", example);
    return text;
}

} // namespace curlew::app
