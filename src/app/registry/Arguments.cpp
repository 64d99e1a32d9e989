// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/registry/Arguments.h"

#include "curlew/app/registry/Action.h"
#include "curlew/app/registry/Text.h"
#include "curlew/base/Error.h"
#include "curlew/base/LocalFile.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace curlew::app {

namespace {

std::vector<double> parseNumbers(const std::string& text) {
    std::vector<double> numbers;
    for (const auto& part : split(text, ',')) {
        double number = 0;
        if (!parseReal(part, number)) return {};
        numbers.push_back(number);
    }
    return numbers;
}

/// Returns whether a value is relative to an object's size: 5%.
bool isRelative(const Option& o, const std::string& text) {
    return o.type == OptionType::length && !text.empty() && text.back() == '%';
}

/// Returns the number of a length, without its % sign.
double numberOf(const std::string& text) {
    return parseNumbers(text.back() == '%' ? text.substr(0, text.size() - 1) : text).at(0);
}

std::string rangeOf(const Option& o) {
    std::string range;
    if (std::isfinite(o.lower)) range += fmt::format(" {} {}", o.exclusive ? "above" : "at least", o.lower);
    if (std::isfinite(o.upper)) range += fmt::format("{} at most {}", range.empty() ? "" : " and", o.upper);
    return range;
}

bool inRange(const Option& o, double number) {
    return (o.exclusive ? number > o.lower : number >= o.lower) && number <= o.upper;
}

/// Returns why a value is invalid; "" if it is valid.
std::string complaint(const Option& o, const std::string& text) {
    const std::vector<double> numbers = parseNumbers(isRelative(o, text) ? text.substr(0, text.size() - 1) : text);
    const auto count = [&](size_t n) { return numbers.size() == n; };
    switch (o.type) {
        case OptionType::text:
            return "";
        case OptionType::flag:
            return text == "0" || text == "1" ? "" : "must be 0 or 1";
        case OptionType::integer:
            if (!count(1) || numbers[0] != std::floor(numbers[0]) || std::abs(numbers[0]) >= 0x1p53)
                return "must be a whole number" + rangeOf(o);
            return inRange(o, numbers[0]) ? "" : "must be" + rangeOf(o);
        case OptionType::real:
        case OptionType::length:
            if (!count(1))
                return "must be a number" + rangeOf(o) +
                       (o.type == OptionType::length ? ", or a percentage of the object's size, as in 5%" : "");
            return inRange(o, numbers[0]) ? "" : "must be" + rangeOf(o);
        case OptionType::vector:
            if (!count(1) && !count(3)) return "must be x,y,z or one number for all three";
            return std::all_of(numbers.begin(), numbers.end(), [&](double n) { return inRange(o, n); })
                       ? ""
                       : "must be" + rangeOf(o);
        case OptionType::coordinates:
            if (numbers.empty() || numbers.size() > 7) return "must be a number for each axis, or one for all";
            return std::all_of(numbers.begin(), numbers.end(), [&](double n) { return inRange(o, n); })
                       ? ""
                       : "must be" + rangeOf(o);
        case OptionType::interval:
            if (!count(2)) return "must be two numbers, lower,upper";
            return numbers[0] < numbers[1] ? "" : "is empty: the first number must be below the second";
        case OptionType::box:
            if (!count(6)) return "must be xmin,ymin,zmin,xmax,ymax,zmax";
            return numbers[0] < numbers[3] && numbers[1] < numbers[4] && numbers[2] < numbers[5]
                       ? ""
                       : "is empty: each lower bound must be below its upper one";
        case OptionType::choice:
            if (std::find(o.choices.begin(), o.choices.end(), text) != o.choices.end()) return "";
            return fmt::format("must be one of {}{}", join(o.choices, ", "), didYouMean(text, o.choices));
        case OptionType::ages:
            if (!numbers.empty() && std::all_of(numbers.begin(), numbers.end(),
                                                [](double n) { return n >= 0 && n == std::floor(n) && n < 1e6; }))
                return "";
            return "must be positions on the stack, 0 the newest, as in 0 or 0,2";
    }
    return "";
}

void requireValid(const Option& o, const std::string& written, const std::string& value) {
    const std::string wrong = complaint(o, value);
    if (wrong.empty()) return;
    throw ValueError(value == written ? fmt::format("{}={} {}", o.name, value, wrong)
                                      : fmt::format("{}={}, which is {}, {}", o.name, written, value, wrong));
}

/// Returns work(). A ValueError gets the option and its text as a prefix.
template <class Work>
auto inOption(const Option& o, const std::string& text, const Work& work) {
    try {
        return work();
    } catch (const ValueError& e) {
        throw ValueError(fmt::format("{}={}: {}", o.name, text, e.what()));
    }
}

} // namespace

const Option& Arguments::option(std::string_view name, OptionType type) const {
    for (const auto& o : mAction->options)
        if (o.name == name && o.type == type) return o;
    throw std::logic_error(fmt::format("action {} declares no option {} of this type", mAction->name, name));
}

std::string Arguments::value(const Option& o) const {
    const auto found = mValues.find(o.name);
    return found == mValues.end() ? o.fallback : found->second;
}

bool Arguments::flag(std::string_view name) const { return value(option(name, OptionType::flag)) == "1"; }
int64_t Arguments::integer(std::string_view name) const {
    return static_cast<int64_t>(parseNumbers(value(option(name, OptionType::integer))).at(0));
}
double Arguments::real(std::string_view name) const {
    const Option* length = mAction->option(name);
    if (!length || length->type != OptionType::length) return parseNumbers(value(option(name, OptionType::real))).at(0);
    const std::string text = value(*length);
    if (isRelative(*length, text))
        throw ValueError(fmt::format(
            "{}={}: the object to whose size the percentage refers is not known yet; give world units", name, text));
    return numberOf(text);
}

bool Arguments::hasRelativeLengths() const {
    return std::any_of(mAction->options.begin(), mAction->options.end(),
                       [&](const Option& o) { return isRelative(o, value(o)); });
}

Arguments Arguments::relativeTo(double diagonal) const {
    Arguments absolute = *this;
    for (const auto& o : mAction->options)
        if (const std::string text = value(o); isRelative(o, text))
            absolute.mValues[o.name] = fmt::format("{}", numberOf(text) / 100 * diagonal);
    return absolute;
}
std::string Arguments::text(std::string_view name) const {
    const bool isChoice = std::any_of(mAction->options.begin(), mAction->options.end(),
                                      [&](const Option& o) { return o.name == name && o.type == OptionType::choice; });
    return value(option(name, isChoice ? OptionType::choice : OptionType::text));
}

Vec3d Arguments::vector(std::string_view name) const {
    const auto n = parseNumbers(value(option(name, OptionType::vector)));
    return n.size() == 1 ? Vec3d{{n[0], n[0], n[0]}} : Vec3d{{n.at(0), n.at(1), n.at(2)}};
}

std::vector<double> Arguments::coordinateList(std::string_view name, size_t axes) const {
    const std::string text = value(option(name, OptionType::coordinates));
    std::vector<double> numbers = parseNumbers(text);
    if (numbers.size() == 1) numbers.resize(axes, numbers.front());
    if (numbers.size() != axes)
        throw ValueError(fmt::format("{}={} has {} numbers for {} axes", name, text, numbers.size(), axes));
    return numbers;
}

int Arguments::count(std::string_view name) const {
    return static_cast<int>(parseNumbers(value(option(name, OptionType::coordinates))).size());
}

Interval Arguments::interval(std::string_view name) const {
    const auto n = parseNumbers(value(option(name, OptionType::interval)));
    return {n.at(0), n.at(1)};
}

Box Arguments::box(std::string_view name) const {
    const auto n = parseNumbers(value(option(name, OptionType::box)));
    return {{{n.at(0), n.at(1), n.at(2)}}, {{n.at(3), n.at(4), n.at(5)}}};
}

std::vector<size_t> Arguments::ages(std::string_view name) const {
    const std::string text = value(option(name, OptionType::ages));
    std::vector<size_t> ages;
    if (text.empty()) return ages;
    for (const double n : parseNumbers(text)) ages.push_back(static_cast<size_t>(n));
    return ages;
}

size_t Arguments::choice(std::string_view name) const {
    const Option& o = option(name, OptionType::choice);
    return static_cast<size_t>(std::find(o.choices.begin(), o.choices.end(), value(o)) - o.choices.begin());
}

void Arguments::addWord(const std::string& word) {
    if (mWords.size() >= mAction->positional.maximum)
        throw ValueError(mAction->positional.maximum == 0
                             ? fmt::format("takes options only, not '{}'; write name=value", word)
                             : fmt::format("unexpected argument '{}'", word));
    mWords.push_back(variablesOf(word).any ? word : expanded(word, {}));
    mWrittenWords.push_back(word);
}

void Arguments::add(const std::string& token) {
    const size_t equals = token.find('=');
    const std::string name = token.substr(0, equals);
    const bool isOption =
        equals != std::string::npos && equals > 0 &&
        std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
    if (isOption)
        set(name, token.substr(equals + 1));
    else
        addWord(token);
}

void Arguments::set(const std::string& name, const std::string& text) {
    std::vector<std::string> names, matches;
    for (const auto& o : mAction->options) {
        names.push_back(o.name);
        if (o.name.starts_with(name)) matches.push_back(o.name);
    }
    for (const auto& o : mAction->options)
        if (std::find(o.formerly.begin(), o.formerly.end(), name) != o.formerly.end()) matches = {o.name};
    if (std::find(names.begin(), names.end(), name) != names.end()) matches = {name};
    if (matches.empty()) {
        for (const auto& input : mAction->takes) names.push_back(input.name);
        throw ValueError(fmt::format("has no option '{}'{}; {}{}", name, didYouMean(name, names),
                                     names.empty() ? "it has none" : "its options are " + join(names, ", "),
                                     mAction->positional.maximum == 0
                                         ? ""
                                         : fmt::format("; for a file of that name, write ./{}={}", name, text)));
    }
    if (matches.size() > 1) throw ValueError(fmt::format("option '{}' is ambiguous: {}", name, join(matches, " or ")));
    const Option& match = *mAction->option(matches.front());
    const bool later = inOption(match, text, [&] { return variablesOf(text).any; });
    const std::string value = later ? text : inOption(match, text, [&] { return expanded(text, {}); });
    if (!later) requireValid(match, text, value);
    if (mAction->takes.empty() && isRelative(match, text))
        throw ValueError(
            fmt::format("{}={}: -{} takes no object to whose size a percentage could refer; give world units",
                        match.name, text, mAction->name));
    if (!mWritten.emplace(match.name, text).second)
        throw ValueError(fmt::format("option '{}' is given twice", match.name));
    mValues[match.name] = value;
}

Arguments Arguments::at(const Moment& moment) const {
    Arguments now = *this;
    for (size_t k = 0; k < mWrittenWords.size(); ++k) now.mWords[k] = expanded(mWrittenWords[k], moment);
    for (const auto& option : mAction->options) {
        const auto written = mWritten.find(option.name);
        if (written == mWritten.end()) continue;
        std::string& value = now.mValues[option.name];
        value = inOption(option, written->second, [&] { return expanded(written->second, moment); });
        requireValid(option, written->second, value);
    }
    return now;
}

bool Arguments::uses(bool Variables::*variable) const {
    const auto used = [&](const std::string& text) { return variablesOf(text).*variable; };
    return std::any_of(mWrittenWords.begin(), mWrittenWords.end(), used) ||
           std::any_of(mWritten.begin(), mWritten.end(), [&](const auto& option) { return used(option.second); });
}

bool Arguments::changes() const { return uses(&Variables::time); }

bool Arguments::usesPart() const { return uses(&Variables::part); }

bool Arguments::usesRate() const { return uses(&Variables::rate); }

void Arguments::finish() {
    if (mWords.size() < mAction->positional.minimum)
        throw ValueError(fmt::format("needs {}", mAction->positional.what));
    for (const auto& o : mAction->options)
        for (const auto& other : o.instead)
            if (given(o.name) && given(other))
                throw ValueError(
                    fmt::format("{}= has no effect if {}= is given; give only one of them", other, o.name));
    for (const auto& o : mAction->options)
        for (const auto& [other, value] : o.implied)
            if (given(o.name) && !given(other)) set(other, value);
}

std::vector<std::string> Arguments::withoutEffect() const {
    const auto isFile = [&](const std::string& ending) {
        if (const Option* format = mAction->option("format"); format && value(*format) != "auto")
            return "." + value(*format) == ending;
        return std::any_of(mWords.begin(), mWords.end(), [&](const auto& file) { return endingOf(file) == ending; });
    };
    const auto holds = [&](const std::string& condition) {
        if (condition.front() == '.') return isFile(condition);
        const size_t equals = condition.find('=');
        const std::string name = condition.substr(0, equals), wanted = condition.substr(equals + 1);
        return wanted.empty() ? given(name) : value(*mAction->option(name)) == wanted;
    };
    std::vector<std::string> all;
    for (const Option& o : mAction->options)
        if (given(o.name) && !o.onlyWith.empty() && std::none_of(o.onlyWith.begin(), o.onlyWith.end(), holds))
            all.push_back(fmt::format("{}= has no effect without {}", o.name,
                                      o.onlyWith.front().front() == '.' ? "a " + join(o.onlyWith, " or ") + " file"
                                                                        : join(o.onlyWith, " or ")));
    return all;
}

std::string quoted(const std::string& word) {
    if (!word.empty() && word.find_first_of(" \t\r#'\"\\") == std::string::npos) return word;
    std::string text = "\"";
    for (const char c : word) text += c == '"' ? R"("'"'")" : std::string(1, c);
    return text + '"';
}

std::string Arguments::program(bool withDash) const {
    std::string text = (withDash ? "-" : "") + mAction->name;
    for (const auto& word : mWrittenWords) text.append(" ").append(quoted(word));
    for (const auto& [name, value] : mWritten) text.append(" ").append(quoted(fmt::format("{}={}", name, value)));
    return text;
}

} // namespace curlew::app
