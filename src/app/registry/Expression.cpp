// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/registry/Expression.h"

#include "curlew/app/registry/Text.h"
#include "curlew/base/Error.h"
#include "curlew/field/ParsedFormula.h"

#include <fmt/format.h>
#include <muParser.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace curlew::app {

namespace {

/// Returns the remainder of a / b, with the sign of b.
double modulo(double a, double b) { return a - b * std::floor(a / b); }
double clamped(double value, double lower, double upper) { return std::max(lower, std::min(value, upper)); }
double floorOf(double value) { return std::floor(value); }
double ceilOf(double value) { return std::ceil(value); }

/// Returns whether a text contains a = that is not part of ==, <=, >= or !=.
bool assigns(std::string_view expression) {
    for (size_t k = 0; k < expression.size(); ++k) {
        if (expression[k] != '=') continue;
        if (k + 1 < expression.size() && expression[k + 1] == '=')
            ++k;
        else if (k == 0 || std::string_view("<>!").find(expression[k - 1]) == std::string_view::npos)
            return true;
    }
    return false;
}

/// Returns the value, which may not be finite.
double evaluated(const std::string& expression, Moment moment, Variables& variables) {
    double frame = moment.wholeFrame();
    if (assigns(expression))
        throw ValueError(fmt::format("{{{}}}: assignments are not possible; == compares", expression));
    try {
        mu::Parser parser;
        parser.DefineConst("pi", std::numbers::pi);
        parser.DefineFun("floor", floorOf);
        parser.DefineFun("ceil", ceilOf);
        parser.DefineFun("mod", modulo);
        parser.DefineFun("clamp", clamped);
        parser.DefineVar("F", &frame);
        parser.DefineVar("FF", &moment.frame);
        parser.DefineVar("T", &moment.time);
        parser.DefineVar("P", &moment.part);
        parser.DefineVar("fps", &moment.fps);
        parser.SetExpr(expression);
        int values = 0;
        const double value = *parser.Eval(values);
        if (values != 1) throw ValueError(fmt::format("{{{}}} has {} values; it must have one", expression, values));
        for (const auto& [name, address] : parser.GetUsedVar()) {
            variables.any = true;
            bool& kind = name == "P" ? variables.part : name == "fps" ? variables.rate : variables.time;
            kind = true;
        }
        return value;
    } catch (const mu::ParserError& error) {
        std::string message = error.GetMsg();
        while (message.ends_with('.')) message.pop_back();
        throw ValueError(
            fmt::format("{{{}}}: {}; the variables are F, T, FF, P and fps, the constant is pi", expression, message));
    }
}

/// A pattern for the frame, as other programs use it.
struct Pattern {
    size_t size = 0;  ///< Length in characters; 0: no pattern.
    size_t width = 0; ///< Number of digits, padded with zeros.
};

/// ## and longer: one digit per #; %d, %4d, %04d: as in printf, padded with zeros.
Pattern patternAt(std::string_view text, size_t at) {
    const std::string_view rest = text.substr(at);
    if (rest.starts_with("##")) {
        const size_t size = std::min(rest.find_first_not_of('#'), rest.size());
        return {.size = size, .width = size};
    }
    if (!rest.starts_with('%')) return {};
    const size_t digits = rest.starts_with("%0") ? 2 : 1;
    const bool width = digits < rest.size() && rest[digits] >= '1' && rest[digits] <= '9';
    const size_t end = digits + (width ? 1 : 0);
    if (end >= rest.size() || rest[end] != 'd') return {};
    return {.size = end + 1, .width = width ? static_cast<size_t>(rest[digits] - '0') : 0};
}

constexpr std::string_view kPlain = "$#%"; ///< Characters that $ escapes.

class Expander {
  public:
    Expander(std::string_view text, const Moment& moment) : mText(text), mMoment(moment) {}

    const Variables& variables() const { return mVariables; }
    /// Returns the last expression whose value was not finite, with its value; "" if there is none.
    const std::string& notFinite() const { return mNotFinite; }

    std::string result() {
        std::string result;
        while (mAt < mText.size()) {
            if (mText[mAt] == '{')
                result += expression();
            else if (mText[mAt] == '$')
                result += frameOrPart();
            else if (const Pattern pattern = patternAt(mText, mAt); pattern.size > 0)
                result += frame(pattern);
            else
                result += mText[mAt++];
        }
        return result;
    }

  private:
    std::string expression() {
        if (mText.substr(mAt).starts_with("{{")) {
            mAt += 2;
            return "{";
        }
        const size_t end = mText.find('}', mAt);
        if (end == std::string_view::npos)
            throw ValueError(fmt::format("'{}' has a {{ without a }}; for a plain {{ write {{{{", mText.substr(mAt)));
        const std::string inner(mText.substr(mAt + 1, end - mAt - 1));
        mAt = end + 1;
        const double value = evaluated(inner, mMoment, mVariables);
        if (!std::isfinite(value)) mNotFinite = fmt::format("{{{}}} is {}", inner, value);
        return fmt::format("{}", value);
    }

    std::string frameOrPart() {
        ++mAt;
        if (mAt < mText.size() && kPlain.find(mText[mAt]) != std::string_view::npos)
            return std::string(1, mText[mAt++]);
        const char what = mAt < mText.size() ? mText[mAt] : ' ';
        const bool fraction = mText.substr(mAt).starts_with("FF"); // Houdini's frame with a fraction
        if (fraction || (what != 'F' && what != 'P'))
            throw ValueError(fmt::format(
                "'{}' has a $ that stands for nothing; $F is the frame, $F4 the frame with four digits, $P the part, "
                "$$ a plain $, $# a plain #, $% a plain %",
                mText));
        ++mAt;
        size_t width = 0;
        if (mAt < mText.size() && mText[mAt] >= '1' && mText[mAt] <= '9')
            width = static_cast<size_t>(mText[mAt++] - '0');
        if (what == 'F') return frame({.size = 0, .width = width});
        mVariables.any = mVariables.part = true;
        return padded(mMoment.part, width);
    }

    std::string frame(const Pattern& pattern) {
        mAt += pattern.size;
        mVariables.any = mVariables.time = true;
        return padded(mMoment.wholeFrame(), pattern.width);
    }

    static std::string padded(double number, size_t width) {
        return fmt::format("{:0{}}", static_cast<long>(number), width);
    }

    std::string_view mText;
    Moment mMoment;
    Variables mVariables;
    std::string mNotFinite;
    size_t mAt = 0;
};

bool beginsName(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_'; }
bool continuesName(char c) { return beginsName(c) || std::isdigit(static_cast<unsigned char>(c)) != 0; }

/// Returns the end of the word at `at`: a name, a number with its exponent, or one other character.
size_t endOfWord(std::string_view text, size_t at) {
    const auto whole = [&](size_t end) {
        return std::find_if_not(text.begin() + static_cast<std::ptrdiff_t>(end), text.end(), continuesName) -
               text.begin();
    };
    if (continuesName(text[at])) return static_cast<size_t>(whole(at));
    // Keeps .5e3 and the .e3 of 1.e3 together, so that e3 is not taken for a name.
    return text[at] == '.' ? static_cast<size_t>(whole(at + 1)) : at + 1;
}

/// Replaces names in {expressions}; in a formula, also outside them.
std::string replaced(std::string_view text, const Constants& constants, bool formula) {
    constexpr std::array<std::string_view, 4> kVariables{"F", "FF", "T", "fps"};
    std::string result;
    bool inside = false;
    for (size_t at = 0; at < text.size();) {
        if (!inside && text.substr(at).starts_with("{{")) {
            result += "{{";
            at += 2;
            continue;
        }
        if (text[at] == '{') inside = true;
        if (text[at] == '}') inside = false;
        const size_t end = inside || formula ? endOfWord(text, at) : at + 1;
        const std::string word(text.substr(at, end - at));
        const auto found = inside || formula ? constants.find(word) : constants.end();
        if (found != constants.end() && !inside && namesInFormula(word).empty())
            throw ValueError(
                fmt::format("'{}' has a meaning in formulas, and -set defines it as {}; rename that constant", word,
                            found->second));
        if (found != constants.end())
            result += fmt::format("({})", found->second);
        else if (formula && !inside && std::find(kVariables.begin(), kVariables.end(), word) != kVariables.end())
            result += fmt::format("({{{}}})", word);
        else
            result += word;
        at = end;
    }
    return result;
}

} // namespace

double Moment::wholeFrame() const {
    const double nearest = std::round(frame);
    return std::abs(frame - nearest) < 1e-6 ? nearest : std::ceil(frame); // allows for rounding of times
}

std::string expanded(std::string_view text, const Moment& moment) {
    if (text.find_first_of("{$#%") == std::string_view::npos) return std::string(text);
    Expander expander(text, moment);
    std::string result = expander.result();
    if (!expander.notFinite().empty())
        throw ValueError(fmt::format("{} at F={}, T={}; it must be a finite number", expander.notFinite(), moment.frame,
                                     moment.time));
    return result;
}

std::string escaped(std::string_view text) {
    std::string result;
    for (const char c : text) {
        if (c == '{') result += '{';
        if (kPlain.find(c) != std::string_view::npos) result += '$';
        result += c;
    }
    return result;
}

Variables variablesOf(std::string_view text) {
    Expander expander(text, {});
    expander.result();
    if (!expander.variables().any) expanded(text, {});
    return expander.variables();
}

std::string withConstants(std::string_view text, const Constants& constants) {
    return replaced(text, constants, false);
}

std::string formulaWithConstants(std::string_view formula, const Constants& constants) {
    return replaced(formula, constants, true);
}

std::pair<std::string, double> constantOf(const std::string& definition) {
    const size_t equals = definition.find('=');
    const std::string name = definition.substr(0, equals);
    if (equals == std::string::npos || name.empty() || !beginsName(name.front()) ||
        !std::all_of(name.begin(), name.end(), continuesName))
        throw ValueError(fmt::format("'{}' is not a definition; write NAME=VALUE", definition));
    Variables variables;
    const auto hasValue = [&](const char* arguments) {
        try {
            evaluated(name + arguments, {}, variables);
            return true;
        } catch (const ValueError&) {
            return false;
        }
    };
    constexpr std::array<const char*, 4> kUses{"", "(1)", "(1, 1)", "(1, 1, 1)"}; // as a variable, and as a function
    if (std::any_of(kUses.begin(), kUses.end(), hasValue))
        throw ValueError(fmt::format("'{}' already has a meaning in expressions; choose another name", name));
    const std::string text = definition.substr(equals + 1);
    double value = 0;
    if (variablesOf(text).any || !parseReal(expanded(text, {}), value))
        throw ValueError(fmt::format("{}: the value must be a number or an expression of numbers", definition));
    return {name, value};
}

} // namespace curlew::app
