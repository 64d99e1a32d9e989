// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/ParsedFormula.h"

#include "FormulaValue.h"
#include "curlew/base/Text.h"
#include "curlew/field/Dimensions.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <numbers>

namespace curlew {

using namespace detail;

namespace {

constexpr int kDeepest = 200; ///< Nested parentheses, and operations on fields that depend on one another.

bool beginsName(char c) { return ('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z') || c == '_'; }
bool isDigit(char c) { return '0' <= c && c <= '9'; }

/// Returns the number of the coordinate with this name (1 for x … 7 for x7), or 0.
int coordinateOf(std::string_view name) {
    constexpr std::string_view kLetters = "xyzw";
    if (name.size() == 1 && kLetters.find(name[0]) != std::string_view::npos)
        return static_cast<int>(kLetters.find(name[0])) + 1;
    if (name.size() == 2 && name[0] == 'x' && '1' <= name[1] && name[1] <= '7') return name[1] - '0';
    return 0;
}

struct Token {
    enum class Kind { number, name, sign, end };
    Kind kind = Kind::end;
    std::string text = {}; ///< As written; one character for a sign.
    double number = 0;
    size_t column = 1; ///< Counts from 1.
};

[[noreturn]] void fail(const Token& token, const std::string& message) {
    throw ValueError(fmt::format("column {}: {}", token.column, message));
}

std::vector<Token> tokensOf(std::string_view text) {
    std::vector<Token> tokens;
    for (size_t at = 0; at < text.size();) {
        const char c = text[at];
        Token token{.column = at + 1};
        size_t end = at + 1;
        if (c == ' ' || c == '\t') {
            at = end;
            continue;
        }
        if (isDigit(c) || c == '.') {
            token.kind = Token::Kind::number;
            const auto [last, error] = std::from_chars(text.data() + at, text.data() + text.size(), token.number);
            end = static_cast<size_t>(last - text.data());
            if (error != std::errc() || !std::isfinite(token.number))
                fail(token, fmt::format("'{}' is not a number", printable(text.substr(at, 12))));
        } else if (beginsName(c)) {
            token.kind = Token::Kind::name;
            while (end < text.size() && (beginsName(text[end]) || isDigit(text[end]))) ++end;
        } else {
            token.kind = Token::Kind::sign;
            if (std::string_view("+-*/^(),").find(c) == std::string_view::npos)
                fail(token, fmt::format("'{}' has no meaning in a formula", printable(text.substr(at, 1))));
        }
        token.text = std::string(text.substr(at, end - at));
        tokens.push_back(std::move(token));
        at = end;
    }
    tokens.push_back({.text = "the end", .column = text.size() + 1});
    return tokens;
}

/// A function that formulas know: its name and the number of its arguments.
struct Known {
    std::string_view name;
    size_t least, most;
};

constexpr size_t kMany = 1000;
constexpr std::array kFunctions{
    Known{"sin", 1, 1},    Known{"cos", 1, 1},       Known{"tan", 1, 1},     Known{"asin", 1, 1},
    Known{"acos", 1, 1},   Known{"atan", 1, 1},      Known{"sinh", 1, 1},    Known{"cosh", 1, 1},
    Known{"tanh", 1, 1},   Known{"exp", 1, 1},       Known{"log", 1, 1},     Known{"ln", 1, 1},
    Known{"log2", 1, 1},   Known{"log10", 1, 1},     Known{"sqrt", 1, 1},    Known{"abs", 1, 1},
    Known{"length", 1, 7}, Known{"dot", 2, 14},      Known{"min", 2, kMany}, Known{"max", 2, kMany},
    Known{"clamp", 3, 3},  Known{"sum", 1, kMany},   Known{"avg", 1, kMany}, Known{"smin", 3, 3},
    Known{"smax", 3, 3},   Known{"smoothstep", 3, 3}};

bool isFunction(std::string_view name) {
    return std::any_of(kFunctions.begin(), kFunctions.end(), [&](const Known& f) { return f.name == name; });
}

bool isConstant(std::string_view name) { return name == "pi"; }
bool isVector(std::string_view name) { return name == "p"; }

template <int N>
class Parser {
  public:
    using Scalar = FormulaValue<N>;
    using Values = std::vector<Scalar>; ///< A scalar, or the components of a vector.

    Parser(std::string_view text, const NamedFields<N>& fields)
        : mText(text), mTokens(tokensOf(text)), mFields(fields) {}

    ParsedFormula<N> parsed() {
        if (mTokens.size() == 1) throw ValueError("the formula is empty");
        const Values values = sum();
        if (next().kind != Token::Kind::end) fail(next(), fmt::format("'{}' is not expected here", next().text));
        if (values.size() != 1)
            throw ValueError(fmt::format("the formula is a vector of {}; it must be one number", values.size()));
        return {values.front().asField(), std::move(mKinks)};
    }

  private:
    const Token& next() const { return mTokens[mAt]; }
    bool isNext(std::string_view sign) const { return next().kind == Token::Kind::sign && next().text == sign; }
    bool take(std::string_view sign) {
        const bool there = isNext(sign);
        if (there) ++mAt;
        return there;
    }

    /// Calls `operation` and adds the column of `token` to its errors.
    template <class Operation>
    Scalar at(const Token& token, const Operation& operation) const {
        try {
            Scalar made = operation();
            if (made.depth > kDeepest) throw ValueError(fmt::format("more than {} operations are nested", kDeepest));
            return made;
        } catch (const ValueError& error) {
            fail(token, error.what());
        }
    }

    /// Applies an operation to the components of two vectors, or to one scalar and each component of a vector.
    template <class Operation>
    Values combined(const Token& token, const Values& a, const Values& b, bool scalars, const Operation& operation) {
        const bool alike = a.size() == b.size() && (scalars || a.size() == 1);
        if (!alike && (scalars || (a.size() != 1 && b.size() != 1)))
            fail(token, fmt::format("'{}' between {} and {}", token.text, described(a), described(b)));
        Values result;
        for (size_t k = 0; k < std::max(a.size(), b.size()); ++k)
            result.push_back(at(token, [&] { return operation(a[a.size() == 1 ? 0 : k], b[b.size() == 1 ? 0 : k]); }));
        return result;
    }

    static std::string described(const Values& v) {
        return v.size() == 1 ? "a number" : fmt::format("a vector of {}", v.size());
    }

    Values sum() {
        if (++mDepth > kDeepest) fail(next(), fmt::format("more than {} parentheses are nested", kDeepest));
        Values left = product();
        while (isNext("+") || isNext("-")) {
            const Token token = mTokens[mAt++];
            const double sign = token.text == "+" ? 1 : -1;
            left = combined(token, left, product(), true,
                            [&](const Scalar& a, const Scalar& b) { return a + scaled(b, sign); });
        }
        --mDepth;
        return left;
    }

    Values product() {
        Values left = signedPower();
        while (isNext("*") || isNext("/")) {
            const Token token = mTokens[mAt++];
            const Values right = signedPower();
            if (token.text == "/" && right.size() > 1) fail(token, "a vector cannot be a divisor");
            left = combined(token, left, right, false,
                            [&](const Scalar& a, const Scalar& b) { return token.text == "*" ? a * b : a / b; });
        }
        return left;
    }

    /// -a^b is -(a^b), and a^-b is allowed.
    Values signedPower() {
        double sign = 1;
        while (isNext("+") || isNext("-")) sign = mTokens[mAt++].text == "-" ? -sign : sign;
        Values base = operand();
        if (isNext("^")) {
            const Token token = mTokens[mAt++];
            if (++mDepth > kDeepest) fail(token, fmt::format("more than {} powers are nested", kDeepest));
            const Values exponent = signedPower();
            --mDepth;
            if (base.size() > 1 || exponent.size() > 1) fail(token, "'^' needs numbers, not vectors");
            base = {at(token, [&] { return raised(base.front(), exponent.front()); })};
        }
        if (sign < 0)
            for (Scalar& s : base) s = scaled(s, -1);
        return base;
    }

    Values operand() {
        const Token token = mTokens[mAt];
        if (token.kind != Token::Kind::end) ++mAt;
        switch (token.kind) {
            case Token::Kind::number:
                return {Scalar(token.number)};
            case Token::Kind::name:
                return named(token);
            case Token::Kind::sign:
                if (token.text == "(") return listed(token);
                break;
            case Token::Kind::end:
                break;
        }
        fail(token, fmt::format("a number, a name or a '(' is missing before {}",
                                token.kind == Token::Kind::end ? "the end" : "'" + token.text + "'"));
    }

    /// What is in parentheses: a scalar, or the components of a vector. `token` is the opening parenthesis.
    Values listed(const Token& token) {
        Values all;
        do {
            for (Scalar& part : sum()) all.push_back(std::move(part));
        } while (take(","));
        if (!take(")")) fail(next(), fmt::format("the '(' in column {} is not closed", token.column));
        return all;
    }

    Values named(const Token& token) {
        const std::string& name = token.text;
        if (isNext("(")) {
            if (const auto field = mFields.find(name); field == mFields.end()) return called(token);
            fail(token, fmt::format("'{}' is a field, not a function; write {} * (…)", name, name));
        }
        if (const auto field = mFields.find(name); field != mFields.end()) return {Scalar(field->second)};
        if (isConstant(name)) return {Scalar(std::numbers::pi)};
        if (isVector(name)) {
            Values position;
            for (int axis = 0; axis < N; ++axis) position.push_back(Scalar::coordinate(axis));
            return position;
        }
        if (const int coordinate = coordinateOf(name); coordinate > 0) {
            if (coordinate > N) fail(token, fmt::format("there is no coordinate '{}' in {} dimensions", name, N));
            return {Scalar::coordinate(coordinate - 1)};
        }
        if (isFunction(name)) fail(token, fmt::format("'{}' is a function; its arguments are missing", name));
        fail(token, fmt::format("there is no '{}'{}", name, didYouMean(name, names())));
    }

    Values called(const Token& token) {
        const std::string& name = token.text;
        const auto known =
            std::find_if(kFunctions.begin(), kFunctions.end(), [&](const Known& f) { return f.name == name; });
        if (known == kFunctions.end())
            fail(token, fmt::format("there is no function '{}'{}", name, didYouMean(name, names())));
        const size_t open = next().column;
        ++mAt;
        const Values arguments = listed({.text = "(", .column = open});
        if (arguments.size() < known->least || arguments.size() > known->most)
            fail(token, fmt::format("'{}' takes {} {}, not {}", name,
                                    known->least == known->most ? fmt::format("{}", known->least)
                                                                : fmt::format("at least {}", known->least),
                                    known->most == 1 ? "argument" : "arguments", arguments.size()));
        const size_t end = mTokens[mAt - 1].column; // the closing parenthesis
        if ((name == "abs" || name == "min" || name == "max" || name == "clamp") &&
            std::any_of(arguments.begin(), arguments.end(), [](const Scalar& s) { return !s.isNumber(); }))
            mKinks.emplace_back(mText.substr(token.column - 1, end - token.column + 1));
        return {at(token, [&] { return applied(name, arguments); })};
    }

    static Scalar applied(const std::string& name, const Values& a) {
        const auto folded = [&](auto&& operation) {
            Scalar result = a.front();
            for (size_t k = 1; k < a.size(); ++k) result = operation(result, a[k]);
            return result;
        };
        const auto smaller = [](const Scalar& p, const Scalar& q) { return smaller2(p, q, 0); };
        const auto larger = [](const Scalar& p, const Scalar& q) { return larger2(p, q, 0); };
        if (name == "min") return folded(smaller);
        if (name == "max") return folded(larger);
        if (name == "sum" || name == "avg")
            return scaled(folded([](const Scalar& p, const Scalar& q) { return p + q; }),
                          name == "avg" ? 1.0 / static_cast<double>(a.size()) : 1);
        if (name == "clamp") return larger(smaller(a[0], a[2]), a[1]);
        if (name == "smin") return smaller2(a[0], a[1], numberOf(a[2], "the smoothing"));
        if (name == "smax") return larger2(a[0], a[1], numberOf(a[2], "the smoothing"));
        if (name == "smoothstep")
            return stepped(a[2], numberOf(a[0], "the lower end"), numberOf(a[1], "the upper end"));
        if (name == "length") {
            Scalar squares = raised(a[0], Scalar(2));
            for (size_t k = 1; k < a.size(); ++k) squares = squares + raised(a[k], Scalar(2));
            return mapped(squares, Function::sqrt);
        }
        if (name == "dot") {
            if (a.size() % 2 != 0) throw ValueError("dot takes two vectors of the same size");
            Scalar product = a[0] * a[a.size() / 2];
            for (size_t k = 1; k < a.size() / 2; ++k) product = product + a[k] * a[a.size() / 2 + k];
            return product;
        }
        if (name == "log2") return scaled(mapped(a[0], Function::log), 1 / std::numbers::ln2);
        if (name == "log10") return scaled(mapped(a[0], Function::log), 1 / std::numbers::ln10);
        return mapped(a[0], functionOf(name));
    }

    static Function functionOf(const std::string& name) {
        constexpr std::array<std::pair<std::string_view, Function>, 14> kSimple{{{"sin", Function::sin},
                                                                                 {"cos", Function::cos},
                                                                                 {"tan", Function::tan},
                                                                                 {"asin", Function::asin},
                                                                                 {"acos", Function::acos},
                                                                                 {"atan", Function::atan},
                                                                                 {"sinh", Function::sinh},
                                                                                 {"cosh", Function::cosh},
                                                                                 {"tanh", Function::tanh},
                                                                                 {"exp", Function::exp},
                                                                                 {"log", Function::log},
                                                                                 {"ln", Function::log},
                                                                                 {"sqrt", Function::sqrt},
                                                                                 {"abs", Function::abs}}};
        return std::find_if(kSimple.begin(), kSimple.end(), [&](const auto& f) { return f.first == name; })->second;
    }

    std::vector<std::string> names() const {
        std::vector<std::string> all{"pi", "p"};
        for (const Known& function : kFunctions) all.emplace_back(function.name);
        for (const auto& [name, field] : mFields) all.push_back(name);
        return all;
    }

    std::string_view mText;
    std::vector<Token> mTokens;
    const NamedFields<N>& mFields;
    size_t mAt = 0;
    int mDepth = 0;
    std::vector<std::string> mKinks;
};

} // namespace

template <int N>
ParsedFormula<N> parsedFormula(std::string_view text, const NamedFields<N>& fields) {
    return Parser<N>(text, fields).parsed();
}

std::vector<std::string> namesInFormula(std::string_view text) {
    std::vector<std::string> names;
    const std::vector<Token> tokens = tokensOf(text);
    for (size_t k = 0; k < tokens.size(); ++k) {
        const std::string& name = tokens[k].text;
        if (tokens[k].kind != Token::Kind::name || tokens[k + 1].text == "(") continue;
        if (coordinateOf(name) > 0 || isConstant(name) || isVector(name) || isFunction(name)) continue;
        if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
    return names;
}

int lastCoordinateIn(std::string_view text) {
    int last = 0;
    for (const Token& token : tokensOf(text))
        if (token.kind == Token::Kind::name) last = std::max(last, coordinateOf(token.text));
    return last;
}

#define CURLEW_INSTANTIATE(N) template ParsedFormula<N> parsedFormula<N>(std::string_view, const NamedFields<N>&);
CURLEW_FOR_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
