// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Action.h"

#include <array>

// Helpers that declare the options, inputs and outputs of actions.
namespace curlew::app::options {

inline Option flag(std::string name, std::string fallback, std::string help) {
    return {
        .name = std::move(name), .type = OptionType::flag, .fallback = std::move(fallback), .help = std::move(help)};
}
inline Option integer(std::string name, std::string fallback, double lower, double upper, std::string help) {
    return {.name = std::move(name),
            .type = OptionType::integer,
            .fallback = std::move(fallback),
            .help = std::move(help),
            .lower = lower,
            .upper = upper};
}
/// A number with this unit is a length.
constexpr std::string_view kWorldUnits = "world units";

/// A number; a length if the unit is world units.
inline Option real(std::string name, std::string fallback, std::string unit, std::string help) {
    return {.name = std::move(name),
            .type = unit == kWorldUnits ? OptionType::length : OptionType::real,
            .fallback = std::move(fallback),
            .help = std::move(help),
            .unit = std::move(unit)};
}
inline Option positive(std::string name, std::string fallback, std::string unit, std::string help) {
    Option option = real(std::move(name), std::move(fallback), std::move(unit), std::move(help));
    option.lower = 0;
    option.exclusive = true;
    return option;
}
inline Option notNegative(std::string name, std::string fallback, std::string unit, std::string help) {
    Option option = real(std::move(name), std::move(fallback), std::move(unit), std::move(help));
    option.lower = 0;
    return option;
}
inline Option vector(std::string name, std::string fallback, std::string unit, std::string help) {
    return {.name = std::move(name),
            .type = OptionType::vector,
            .fallback = std::move(fallback),
            .help = std::move(help),
            .unit = std::move(unit)};
}
inline Option coordinates(std::string name, std::string fallback, std::string unit, std::string help) {
    return {.name = std::move(name),
            .type = OptionType::coordinates,
            .fallback = std::move(fallback),
            .help = std::move(help),
            .unit = std::move(unit)};
}
inline Option interval(std::string name, std::string unit, std::string help) {
    return {.name = std::move(name), .type = OptionType::interval, .help = std::move(help), .unit = std::move(unit)};
}
inline Option box(std::string name, std::string help) {
    return {.name = std::move(name), .type = OptionType::box, .help = std::move(help), .unit = "world units"};
}
/// The choices must have the order of the enumeration that they represent.
inline Option choice(std::string name, std::vector<std::string> choices, std::string help, std::string fallback = "") {
    if (fallback.empty()) fallback = choices.front();
    return {.name = std::move(name),
            .type = OptionType::choice,
            .fallback = std::move(fallback),
            .help = std::move(help),
            .choices = std::move(choices)};
}
/// Returns the names of an enumeration's values as choices.
template <size_t N>
std::vector<std::string> namesOf(const std::array<std::string_view, N>& names) {
    return {names.begin(), names.end()};
}
/// Uses the first `count` names of an enumeration as choices.
template <size_t N>
Option choice(std::string name, const std::array<std::string_view, N>& names, std::string help, size_t count = N) {
    return choice(std::move(name), std::vector<std::string>(names.begin(), names.begin() + static_cast<long>(count)),
                  std::move(help));
}
inline Option text(std::string name, std::string fallback, std::string help) {
    return {
        .name = std::move(name), .type = OptionType::text, .fallback = std::move(fallback), .help = std::move(help)};
}
inline Option ages(std::string name, std::string fallback, std::string help) {
    return {
        .name = std::move(name), .type = OptionType::ages, .fallback = std::move(fallback), .help = std::move(help)};
}
inline Input taken(std::string name, std::vector<Kind> kinds, std::string age = "") {
    return {.name = std::move(name), .kinds = std::move(kinds), .use = Use::taken, .age = std::move(age)};
}
inline Input stays(std::string name, std::vector<Kind> kinds, std::string age = "") {
    return {.name = std::move(name), .kinds = std::move(kinds), .use = Use::stays, .age = std::move(age)};
}
inline Input changed(std::string name, std::vector<Kind> kinds) {
    return {.name = std::move(name), .kinds = std::move(kinds), .use = Use::changed};
}
/// Makes the input optional; `help` says when it may be missing.
inline Input maybe(Input input, std::string help) {
    input.amount.min = 0;
    input.help = std::move(help);
    return input;
}
/// The input is only used if `counts` returns true for the options; `help` says when.
inline Input onlyIf(Input input, std::string help, std::function<bool(const Arguments&)> counts) {
    const Amount amount = input.amount;
    input.help = std::move(help);
    input.amount.min = 0;
    input.amountWith = [counts = std::move(counts), amount](const Arguments& a, const Scope&) {
        return counts(a) ? amount : Amount{0, 0};
    };
    return input;
}
/// The input is taken from the stacks only if `asked` returns true for the options, as `help` says. A linked object is
/// always used.
inline Input onRequest(Input input, std::string help, std::function<bool(const Arguments&)> asked) {
    const Amount amount = input.amount;
    input.help = std::move(help);
    input.amount.min = 0;
    input.amountWith = [asked = std::move(asked), amount](const Arguments& a, const Scope& scope) {
        return scope.linked() ? Amount{0, amount.max} : asked(a) ? amount : Amount{0, 0};
    };
    return input;
}
/// The input takes `least` to `most` objects; `help` says how many.
inline Input several(Input input, size_t least, size_t most, std::string help) {
    input.amount = {least, most};
    input.help = std::move(help);
    return input;
}
inline Output made(std::string name, std::vector<Kind> kinds, std::string flag = "") {
    return {.name = std::move(name),
            .kinds = std::move(kinds),
            .amount = {.min = flag.empty() ? size_t{1} : 0},
            .flag = std::move(flag)};
}
inline Output several(Output output, size_t least, size_t most) {
    output.amount = {least, most};
    return output;
}

/// An option that only selects what is taken from the stacks.
inline Option selector(Option option) {
    option.selects = true;
    return option;
}
inline Option keep() {
    return selector(flag("keep", "0", "1: keep the inputs on the stack instead of consuming or replacing them"));
}
/// Names that the option had in the last release (Option::formerly).
inline Option formerly(std::vector<std::string> names, Option option) {
    option.formerly = std::move(names);
    return option;
}
/// The option has no effect unless one of the conditions holds (Option::onlyWith).
inline Option onlyWith(std::vector<std::string> conditions, Option option) {
    option.onlyWith = std::move(conditions);
    return option;
}
/// The `others` have no effect if this option is given.
inline Option instead(Option option, std::vector<std::string> others) {
    option.instead = std::move(others);
    return option;
}
/// An option that makes the action a function of the moment. `implied` holds values for other options that are not
/// given.
inline Option timeless(Option option, std::map<std::string, std::string> implied) {
    option.timeless = true;
    option.implied = std::move(implied);
    return option;
}

} // namespace curlew::app::options
