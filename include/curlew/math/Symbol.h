// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Jet.h"

#include <bit>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

namespace curlew {

// A kernel that runs on symbols instead of numbers records what it computes, as a graph of operations. From the graph,
// a text in another language is written (shader/ShaderText.h). A Symbol<T> is a constant or a node of the function that
// is being recorded. Equal nodes are one node, and operations on constants are carried out at once. x + 0, x * 1, x * 0
// and the like are simplified; so 0 * NaN and 0 * infinity give 0, unlike for numbers.
//
// A Symbol<float> stands for a number of the precision of values, whichever the text uses. A Symbol<double> stands for
// a coordinate ("wide"), from which lattice cells are subtracted; it needs more precision. Constants of both are
// double.

enum class SymbolType : uint8_t { mask, real, wide, word, longWord };

enum class SymbolOp : uint8_t {
    constant,  ///< data: the bits of a double, or the word
    parameter, ///< data: its index
    result,    ///< Of a call. data: index of the call << 32 | index of the result
    table,     ///< A number of a table at the row a. data: index of the table << 32 | column
    buffer,    ///< An element of a buffer at the index a. data: index of the buffer
    add,
    subtract,
    multiply,
    divide,
    negate,
    mulAdd, ///< a b + c
    floor,
    nearest, ///< The nearest integer, halves to even.
    sqrt,
    abs,
    sin,
    cos,
    log,
    exp,
    asin,
    acos,
    atan,
    sinh,
    cosh,
    tanh,
    power, ///< a^b for a > 0
    min,
    max,
    select, ///< a ? b : c
    less,
    lessEqual,
    equal,
    both,
    either,
    opposite,
    bitAnd,
    bitXor,
    shiftLeft, ///< By the number of bits in data.
    shiftRight,
    modulo,  ///< a modulo data
    convert, ///< To the node's type. Words wrap; a real becomes a word if it is an integer from 0 to 2^32 - 1.
    integer, ///< A wide integer as a longWord, modulo 2^64.
};

struct SymbolNode {
    SymbolOp op;
    SymbolType type;
    std::array<uint32_t, 3> from{}; ///< Operands; unused ones are 0.
    uint64_t data = 0;
    friend auto operator<=>(const SymbolNode&, const SymbolNode&) = default;
};

/// A call of an earlier function of the module.
struct SymbolCall {
    size_t function;
    std::vector<uint32_t> arguments;
    friend bool operator==(const SymbolCall&, const SymbolCall&) = default;
};

class SymbolModule;

/// A recorded function. Nodes refer to earlier nodes only.
struct SymbolFunction {
    SymbolModule* module = nullptr;
    std::string name; ///< Of what it computes; not unique.
    std::vector<SymbolType> parameters;
    std::vector<SymbolNode> nodes;
    std::vector<SymbolCall> calls;
    std::vector<uint32_t> results;
    std::map<SymbolNode, uint32_t> known; ///< Index of each node; empty once the function is complete.

    uint32_t add(const SymbolNode& node);
};

/// A symbol of any type. Without a function it is a constant.
struct AnySymbol {
    SymbolType type;
    SymbolFunction* function = nullptr;
    uint64_t data = 0; ///< Index of the node, or the bits of the constant.

    bool isConstant() const { return function == nullptr; }
    double number() const { return std::bit_cast<double>(data); }
    friend bool operator==(const AnySymbol&, const AnySymbol&) = default;
};

/// Rows of `columns` numbers each.
struct SymbolTable {
    size_t columns;
    std::vector<double> numbers;
    friend bool operator==(const SymbolTable&, const SymbolTable&) = default;
};

/// Elements that are too many to be written into a text: words of 32 bits, or floats.
struct SymbolBuffer {
    std::string name;                                  ///< The module gives it.
    SymbolType type;                                   ///< word or real
    std::shared_ptr<const std::vector<uint32_t>> data; ///< The words, or the bits of the floats.
};

/// The functions that belong together, with their tables and buffers. Not safe to share between threads.
class SymbolModule {
  public:
    using Symbols = std::vector<AnySymbol>;
    using Body = std::function<Symbols(const Symbols& parameters)>;

    SymbolModule() = default;
    SymbolModule(const SymbolModule&) = delete;
    SymbolModule& operator=(const SymbolModule&) = delete;

    /// Records a function of parameters of these types, and returns its index. Functions with equal content are one.
    size_t record(const std::string& name, const std::vector<SymbolType>& parameters, const Body& body);

    /// Records a function only once for each owner and kind, and returns its index. Keeps the owner alive.
    size_t recordOnce(const std::shared_ptr<const void>& owner, int kind, const std::string& name,
                      const std::vector<SymbolType>& parameters, const Body& body);

    /// Calls a function from the one that is being recorded. A constant result becomes a constant.
    Symbols call(size_t function, const Symbols& arguments);

    /// Returns a number of the table for each of the first `count` columns, at a row that is a word.
    Symbols lookUp(SymbolTable table, const AnySymbol& row, size_t count);

    /// Returns the element at an index that is a word.
    AnySymbol load(const SymbolBuffer& buffer, const AnySymbol& index);

    const std::deque<SymbolFunction>& functions() const { return mFunctions; }
    const std::vector<SymbolTable>& tables() const { return mTables; }
    const std::vector<SymbolBuffer>& buffers() const { return mBuffers; }

  private:
    std::deque<SymbolFunction> mFunctions;
    std::vector<std::unique_ptr<SymbolFunction>> mOpen; // being recorded, the innermost last
    std::vector<SymbolTable> mTables;
    std::vector<SymbolBuffer> mBuffers;
    std::map<std::pair<const void*, int>, size_t> mRecorded;
    std::vector<std::shared_ptr<const void>> mOwners;
};

/// Records an operation of up to three operands, or carries it out if all operands are constants.
AnySymbol recorded(SymbolOp op, SymbolType type, std::initializer_list<AnySymbol> operands, uint64_t data = 0);

/// Carries out an operation on numbers: those of the types real, wide and mask (1 or 0), except convert.
template <class T>
T applied(SymbolOp op, T a, T b, T c);
/// The same for words.
uint64_t applied(SymbolOp op, uint64_t a, uint64_t b, uint64_t data);

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

inline SymbolIndex indicesOf(const Symbol<float>& x, uint32_t last) {
    return {min(convertTo<Symbol<uint32_t>>(x), Symbol<uint32_t>(last)), last + 1};
}
inline SymbolIndex wrappedIndicesOf(const Symbol<float>& x, uint32_t last) {
    return {convertTo<Symbol<uint32_t>>(x) & Symbol<uint32_t>(last), last + 1};
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
