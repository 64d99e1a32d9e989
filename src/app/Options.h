#pragma once

#include "curlew/app/Action.h"

#include <array>

// Short forms in which the actions declare their options.
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
inline Option real(std::string name, std::string fallback, std::string unit, std::string help) {
    return {.name = std::move(name),
            .type = OptionType::real,
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
/// The choices in the order of the enumeration that they stand for.
inline Option choice(std::string name, std::vector<std::string> choices, std::string help, std::string fallback = "") {
    if (fallback.empty()) fallback = choices.front();
    return {.name = std::move(name),
            .type = OptionType::choice,
            .fallback = std::move(fallback),
            .help = std::move(help),
            .choices = std::move(choices)};
}
/// The names of an enumeration's values as choices.
template <size_t N>
std::vector<std::string> namesOf(const std::array<std::string_view, N>& names) {
    return {names.begin(), names.end()};
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
/// It may be missing; `help` says when.
inline Input maybe(Input input, std::string help) {
    input.least = 0;
    input.help = std::move(help);
    return input;
}
/// `least` to `most` of them; `help` says how many.
inline Input several(Input input, size_t least, size_t most, std::string help) {
    input.least = least;
    input.most = most;
    input.help = std::move(help);
    return input;
}
inline Output made(std::string name, std::vector<Kind> kinds, std::string flag = "") {
    return {.name = std::move(name),
            .kinds = std::move(kinds),
            .least = flag.empty() ? size_t{1} : 0,
            .flag = std::move(flag)};
}
inline Output several(Output output, size_t least, size_t most) {
    output.least = least;
    output.most = most;
    return output;
}

inline Option keep() { return flag("keep", "0", "leave what is taken on its stack"); }

constexpr double kAny = std::numeric_limits<double>::infinity();

} // namespace curlew::app::options
