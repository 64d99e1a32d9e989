// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Jet.h"
#include "curlew/math/SymbolModule.h"

#include <tuple>

namespace curlew {

// A kernel that runs on symbols instead of numbers records what it computes (SymbolModule.h). A Symbol<T> is a constant
// or a node of the function that is being recorded.
//
// A Symbol<float> stands for a number of the precision of values, whichever the text uses. A Symbol<double> stands for
// a coordinate ("wide"), from which lattice cells are subtracted; it needs more precision.

template <class T>
inline constexpr SymbolType kSymbolType = SymbolType::mask;
template <>
inline constexpr SymbolType kSymbolType<float> = SymbolType::real;
template <>
inline constexpr SymbolType kSymbolType<double> = SymbolType::wide;
template <>
inline constexpr SymbolType kSymbolType<uint32_t> = SymbolType::word;
template <>
inline constexpr SymbolType kSymbolType<uint64_t> = SymbolType::longWord;

/// T is float, double, uint32_t, uint64_t, or bool for the result of a comparison. Behaves like a number
/// (Arithmetic.h).
template <class T>
class Symbol {
    using Constant = std::conditional_t<std::is_floating_point_v<T>, double, T>;

  public:
    constexpr Symbol() = default; // zero
    template <class U>
    requires std::is_arithmetic_v<U>
    constexpr Symbol(U x) : mData(bitsOf(static_cast<Constant>(x))) {} // NOLINT: implicit; a number is a symbol
    explicit Symbol(const AnySymbol& any) : mFunction(any.function), mData(any.data) {}

    AnySymbol any() const { return {kSymbolType<T>, mFunction, mData}; }

    Symbol& operator+=(const Symbol& o) { return *this = *this + o; }
    Symbol& operator-=(const Symbol& o) { return *this = *this - o; }
    Symbol& operator*=(const Symbol& o) { return *this = *this * o; }
    Symbol& operator/=(const Symbol& o) { return *this = *this / o; }
    friend Symbol operator+(const Symbol& a, const Symbol& b) { return of(SymbolOp::add, a, b); }
    friend Symbol operator-(const Symbol& a, const Symbol& b) { return of(SymbolOp::subtract, a, b); }
    friend Symbol operator*(const Symbol& a, const Symbol& b) { return of(SymbolOp::multiply, a, b); }
    friend Symbol operator/(const Symbol& a, const Symbol& b) { return of(SymbolOp::divide, a, b); }
    friend Symbol operator-(const Symbol& a) { return of(SymbolOp::negate, a); }
    friend Symbol<bool> operator<(const Symbol& a, const Symbol& b) { return compared(SymbolOp::less, a, b); }
    friend Symbol<bool> operator<=(const Symbol& a, const Symbol& b) { return compared(SymbolOp::lessEqual, a, b); }
    friend Symbol<bool> operator>(const Symbol& a, const Symbol& b) { return b < a; }
    friend Symbol<bool> operator>=(const Symbol& a, const Symbol& b) { return b <= a; }
    friend Symbol<bool> operator==(const Symbol& a, const Symbol& b) { return compared(SymbolOp::equal, a, b); }

    // For masks: and, or, not; & also for words.
    friend Symbol operator&(const Symbol& a, const Symbol& b) {
        return of(std::same_as<T, bool> ? SymbolOp::both : SymbolOp::bitAnd, a, b);
    }
    friend Symbol operator|(const Symbol& a, const Symbol& b) requires std::same_as<T, bool> {
        return of(SymbolOp::either, a, b);
    }
    friend Symbol operator!(const Symbol& a) requires std::same_as<T, bool> { return of(SymbolOp::opposite, a); }
    friend Symbol operator^(const Symbol& a, const Symbol& b) { return of(SymbolOp::bitXor, a, b); }
    friend Symbol operator<<(const Symbol& a, int bits) { return shifted(SymbolOp::shiftLeft, a, bits); }
    friend Symbol operator>>(const Symbol& a, int bits) { return shifted(SymbolOp::shiftRight, a, bits); }

    friend Symbol mulAdd(const Symbol& a, const Symbol& b, const Symbol& c) { return of(SymbolOp::mulAdd, a, b, c); }
    friend Symbol negMulAdd(const Symbol& a, const Symbol& b, const Symbol& c) { return mulAdd(-a, b, c); }
    friend Symbol floor(const Symbol& a) { return of(SymbolOp::floor, a); }
    friend Symbol sqrt(const Symbol& a) { return of(SymbolOp::sqrt, a); }
    friend Symbol abs(const Symbol& a) { return of(SymbolOp::abs, a); }
    friend Symbol sin(const Symbol& a) { return of(SymbolOp::sin, a); }
    friend Symbol cos(const Symbol& a) { return of(SymbolOp::cos, a); }
    friend Symbol log(const Symbol& a) { return of(SymbolOp::log, a); }
    friend Symbol exp(const Symbol& a) { return of(SymbolOp::exp, a); }
    friend Symbol asin(const Symbol& a) { return of(SymbolOp::asin, a); }
    friend Symbol acos(const Symbol& a) { return of(SymbolOp::acos, a); }
    friend Symbol atan(const Symbol& a) { return of(SymbolOp::atan, a); }
    friend Symbol sinh(const Symbol& a) { return of(SymbolOp::sinh, a); }
    friend Symbol cosh(const Symbol& a) { return of(SymbolOp::cosh, a); }
    friend Symbol tanh(const Symbol& a) { return of(SymbolOp::tanh, a); }
    friend Symbol pow(const Symbol& a, const Symbol& b) { return of(SymbolOp::power, a, b); }
    friend Symbol min(const Symbol& a, const Symbol& b) { return of(SymbolOp::min, a, b); }
    friend Symbol max(const Symbol& a, const Symbol& b) { return of(SymbolOp::max, a, b); }
    friend Symbol select(const Symbol<bool>& mask, const Symbol& yes, const Symbol& no) {
        return selected(mask, yes, no);
    }
    /// With one product that may be rounded before the nearest integer is taken (Arithmetic.h).
    friend Symbol nearestProduct(const Symbol& a, const Symbol& b) { return of(SymbolOp::nearest, a * b); }

  private:
    static constexpr uint64_t bitsOf(Constant x) {
        if constexpr (std::is_floating_point_v<T>)
            return std::bit_cast<uint64_t>(x);
        else
            return x;
    }
    static Symbol of(SymbolOp op, const Symbol& a);
    static Symbol of(SymbolOp op, const Symbol& a, const Symbol& b);
    static Symbol of(SymbolOp op, const Symbol& a, const Symbol& b, const Symbol& c);
    static Symbol<bool> compared(SymbolOp op, const Symbol& a, const Symbol& b);
    static Symbol selected(const Symbol<bool>& mask, const Symbol& yes, const Symbol& no);
    static Symbol shifted(SymbolOp op, const Symbol& a, int bits);

    SymbolFunction* mFunction = nullptr;
    uint64_t mData = 0;
};

/// A row of a table of `rows` rows.
struct SymbolIndex {
    Symbol<uint32_t> at;
    uint32_t rows;
};

template <class T>
struct LanesOf<Symbol<T>> {
    static constexpr int kCount = 1;
    static constexpr bool kSymbolic = true;
    using Number = std::conditional_t<std::is_floating_point_v<T>, double, T>;
    using Indices = SymbolIndex;
    template <class U>
    using Of = Symbol<U>;
};

template <class To, class T>
requires kSymbolic<To> To convertTo(const Symbol<T>& x) {
    if constexpr (std::same_as<To, Symbol<T>>)
        return x;
    else
        return To(recorded(SymbolOp::convert, To().any().type, {x.any()}));
}
inline Symbol<uint64_t> wordOf(const Symbol<double>& x) {
    return Symbol<uint64_t>(recorded(SymbolOp::integer, SymbolType::longWord, {x.any()}));
}

inline Symbol<uint32_t> indexOf(const Symbol<float>& x) {
    return Symbol<uint32_t>(recorded(SymbolOp::index, SymbolType::word, {x.any()}));
}
inline SymbolIndex indicesOf(const Symbol<float>& x, uint32_t last) {
    return {min(indexOf(x), Symbol<uint32_t>(last)), last + 1};
}
inline SymbolIndex wrappedIndicesOf(const Symbol<float>& x, uint32_t last) {
    return {indexOf(x) & Symbol<uint32_t>(last), last + 1};
}
/// Returns the numbers of a table at a row, as many as `count`. Without symbols in the row, they are constants.
std::vector<AnySymbol> lookUp(SymbolTable table, const Symbol<uint32_t>& row, size_t count);

template <size_t Size>
Symbol<float> valuesAt(const std::array<float, Size>& table, const Symbol<float>& x) {
    static_assert((Size & (Size - 1)) == 0);
    return Symbol<float>(lookUp({1, {table.begin(), table.end()}}, wrappedIndicesOf(x, Size - 1).at, 1)[0]);
}
template <class T, size_t K, class U>
requires kSymbolic<T> std::array<T, K> rowsAt(const Row<U>* rows, const SymbolIndex& index) {
    SymbolTable table{K, {}};
    for (uint32_t row = 0; row < index.rows; ++row)
        for (size_t k = 0; k < K; ++k) table.numbers.push_back(static_cast<double>(rows[row].c[k]));
    const auto found = lookUp(std::move(table), index.at, K);
    std::array<T, K> numbers;
    for (size_t k = 0; k < K; ++k) numbers[k] = T(found[k]);
    return numbers;
}

/// As for numbers (Arithmetic.h).
template <class F>
requires std::same_as<F, Symbol<float>> F remainderOf(const Symbol<uint64_t>& word, uint32_t n) {
    using Word = Symbol<uint32_t>;
    const auto modulo = [n](const Word& w) { return Word(recorded(SymbolOp::modulo, SymbolType::word, {w.any()}, n)); };
    const auto high = static_cast<uint32_t>((uint64_t{1} << 32) % n);
    const Word folded = modulo(convertTo<Word>(word >> 32)) * Word(high) + modulo(convertTo<Word>(word));
    return convertTo<F>(modulo(folded));
}

/// Calls f on vectors of symbols as a function of its own: f(parameters…), where each argument is a Symbol or a Vec of
/// symbols. `f` returns a Jet of symbols. Equal functions are written once.
template <class J, class F, class... A>
J outlined(const char* name, const F& f, const A&... arguments);

namespace detail {

template <class T>
void append(std::vector<AnySymbol>& to, const Symbol<T>& x) {
    to.push_back(x.any());
}
template <class T, int N>
void append(std::vector<AnySymbol>& to, const Vec<T, N>& v) {
    for (const T& x : v.c) append(to, x);
}
template <class T, int N, int Order>
void append(std::vector<AnySymbol>& to, const Jet<T, N, Order>& jet) {
    for (int k = 0; k < jet.kSize; ++k) append(to, jet.component(k));
}
template <class T>
void take(const AnySymbol*& from, Symbol<T>& x) {
    x = Symbol<T>(*from++);
}
template <class T, int N>
void take(const AnySymbol*& from, Vec<T, N>& v) {
    for (T& x : v.c) take(from, x);
}
template <class T, int N, int Order>
void take(const AnySymbol*& from, Jet<T, N, Order>& jet) {
    for (int k = 0; k < jet.kSize; ++k) take(from, jet.component(k));
}

} // namespace detail

template <class J, class F, class... A>
J outlined(const char* name, const F& f, const A&... arguments) {
    std::vector<AnySymbol> all;
    (detail::append(all, arguments), ...);
    SymbolFunction* caller = nullptr;
    std::vector<SymbolType> types;
    for (const AnySymbol& argument : all) {
        if (!argument.isConstant()) caller = argument.function;
        types.push_back(argument.type);
    }
    if (!caller) return f(arguments...);
    SymbolModule& module = *caller->module;
    const size_t function = module.record(name, types, [&](const std::vector<AnySymbol>& parameters) {
        std::tuple<A...> own;
        const AnySymbol* next = parameters.data();
        std::apply([&](auto&... each) { (detail::take(next, each), ...); }, own);
        std::vector<AnySymbol> results;
        detail::append(results, std::apply(f, own));
        return results;
    });
    const auto results = module.call(function, all);
    J jet;
    const AnySymbol* next = results.data();
    detail::take(next, jet);
    return jet;
}

} // namespace curlew
