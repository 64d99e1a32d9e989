// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace curlew {

// Kernels are templates on a number type T: float, double, or SIMD lanes of them (Lanes.h). They use the functions
// below. Each arithmetic function rounds once, so a kernel gives the same bits for a single number and for lanes. The
// overloads for lanes are found by argument-dependent lookup; those for single numbers are here. Kernels choose between
// values with `select` and never branch on a T. T may also be a symbol, which records the operations (Symbol.h).

/// Returns a b + c, fused. (std::fma is not constexpr: constant evaluation rounds twice.)
template <std::floating_point T>
constexpr T mulAdd(T a, T b, T c) {
    if (std::is_constant_evaluated()) return a * b + c;
    return std::fma(a, b, c);
}
/// Returns c - a b, fused.
template <std::floating_point T>
constexpr T negMulAdd(T a, T b, T c) {
    return mulAdd(-a, b, c);
}
/// For types that consist of numbers, such as jets: not fused.
template <class T>
requires(!std::floating_point<T>) constexpr T mulAdd(const T& a, const T& b, const T& c) { return a * b + c; }
template <class T>
requires(!std::floating_point<T>) constexpr T negMulAdd(const T& a, const T& b, const T& c) { return c - a * b; }

template <std::floating_point T>
T floor(T x) {
    return std::floor(x);
}
template <std::floating_point T>
T sqrt(T x) {
    return std::sqrt(x);
}
template <std::floating_point T>
T abs(T x) {
    return std::abs(x);
}
template <std::floating_point T>
T sin(T x) {
    return std::sin(x);
}
template <std::floating_point T>
T cos(T x) {
    return std::cos(x);
}
template <std::floating_point T>
T log(T x) {
    return std::log(x);
}
template <std::floating_point T>
T exp(T x) {
    return std::exp(x);
}
template <std::floating_point T>
T asin(T x) {
    return std::asin(x);
}
template <std::floating_point T>
T acos(T x) {
    return std::acos(x);
}
template <std::floating_point T>
T atan(T x) {
    return std::atan(x);
}
template <std::floating_point T>
T sinh(T x) {
    return std::sinh(x);
}
template <std::floating_point T>
T cosh(T x) {
    return std::cosh(x);
}
template <std::floating_point T>
T tanh(T x) {
    return std::tanh(x);
}
template <std::floating_point T>
T pow(T x, T y) {
    return std::pow(x, y);
}
/// If an argument is NaN, min and max return b.
template <std::floating_point T>
constexpr T min(T a, T b) {
    return a < b ? a : b;
}
template <std::floating_point T>
constexpr T max(T a, T b) {
    return a > b ? a : b;
}
template <class T>
requires std::is_arithmetic_v<T>
constexpr T select(bool condition, T yes, T no) { return condition ? yes : no; }
/// Whether a comparison holds for any lane.
inline bool any(bool condition) { return condition; }
/// The type of T < T.
template <class T>
using MaskOf = decltype(T() < T());

template <int Count>
struct alignas(4 * Count) IndexArray : std::array<uint32_t, size_t{Count}> {};

template <class T>
struct LanesOf {
    static constexpr int kCount = 1;
    static constexpr bool kSymbolic = false;
    using Number = T;
    using Indices = IndexArray<1>;
    template <class U>
    using Of = U;
    static T load(const T* from) { return *from; }
    static std::array<T, 4> fourFrom(const float* const* places, size_t offset) {
        const float* from = places[0] + offset;
        return {static_cast<T>(from[0]), static_cast<T>(from[1]), static_cast<T>(from[2]), static_cast<T>(from[3])};
    }
};
/// The number type of lanes; T itself for a single number.
template <class T>
using NumberOf = typename LanesOf<T>::Number;
/// The number of lanes in T; 1 for a single number.
template <class T>
inline constexpr int kLanes = LanesOf<T>::kCount;
/// The type with lanes of U, as many as T has.
template <class T, class U>
using Rebind = typename LanesOf<T>::template Of<U>;
/// Whether operations on T are recorded instead of carried out (Symbol.h).
template <class T>
inline constexpr bool kSymbolic = LanesOf<T>::kSymbolic;
/// One table index per lane of T.
template <class T>
using Indices = typename LanesOf<T>::Indices;

template <class T, class U>
requires(std::is_arithmetic_v<T>&& std::is_arithmetic_v<U>) T convertTo(U x) { return static_cast<T>(x); }

/// Returns the integer x, |x| <= 2^51, modulo 2^64.
inline uint64_t wordOf(double x) { return static_cast<uint64_t>(static_cast<int64_t>(x)); }

template <class T>
T load(const NumberOf<T>* from) {
    return LanesOf<T>::load(from);
}
template <class T>
requires std::is_arithmetic_v<T>
void store(T x, T* to) { *to = x; }

/// Four numbers of a table that are looked up together.
template <class T>
struct alignas(4 * sizeof(T)) Row {
    std::array<T, 4> c{};
};

/// Converts integers in 0 … last to indices into a table of last + 1 rows. Any other value gives some valid index.
inline IndexArray<1> indicesOf(float x, uint32_t last) {
    return {{x >= 0 && x <= static_cast<float>(last) ? static_cast<uint32_t>(x) : last}};
}
/// Converts integers in [0, 2^31) to indices modulo last + 1, which must be a power of two.
inline IndexArray<1> wrappedIndicesOf(float x, uint32_t last) { return {{static_cast<uint32_t>(x) & last}}; }
/// Looks up a table at the integers x >= 0, modulo its size.
template <size_t Size>
float valuesAt(const std::array<float, Size>& table, float x) {
    static_assert((Size & (Size - 1)) == 0);
    return table[static_cast<uint32_t>(x) & (Size - 1)];
}
/// Returns the first K numbers of the rows at these indices.
template <class T, size_t K>
std::array<T, K> rowsAt(const Row<T>* rows, const IndexArray<1>& index) {
    std::array<T, K> numbers;
    for (size_t k = 0; k < K; ++k) numbers[k] = rows[index[0]].c[k];
    return numbers;
}

/// Loads four consecutive floats for each lane, starting at places[lane] + offset. Element k of the result holds the
/// k-th float of every lane.
template <class T>
std::array<T, 4> fourFrom(const float* const* places, size_t offset) {
    return LanesOf<T>::fourFrom(places, offset);
}

/// Returns a b rounded to the nearest integer, with a single rounding; |a b| < 2^51 for double, 2^22 for float.
template <class T>
T nearestProduct(const T& a, const T& b) {
    const auto magic = static_cast<T>(std::is_same_v<NumberOf<T>, float> ? 0x1.8p23 : 0x1.8p52);
    return mulAdd(a, b, magic) - magic;
}

/// Returns i modulo p in [0, p) for integers |i| < 2^51 in double; an arbitrary number for larger |i| and for NaN.
/// `inverse` is 1 / p.
template <class T>
T floorMod(const T& i, double p, double inverse) {
    // Adding 0.5 to i keeps the quotient away from integers, where the rounding error of `inverse` could change
    // floor().
    return negMulAdd(floor(mulAdd(i, T(inverse), T(0.5 * inverse))), T(p), i);
}

/// Returns a word of 64 bits modulo n <= 2^16, as a number F.
template <class F, class Word>
F remainderOf(const Word& word, uint32_t n) {
    using P = Rebind<F, double>;
    // The high half is first multiplied by 2^32 mod n, so every step is exact.
    const P folded = mulAdd(convertTo<P>(word >> 32), P(static_cast<double>((uint64_t{1} << 32) % n)),
                            convertTo<P>(word & Word(0xffffffff)));
    return convertTo<F>(floorMod(folded, n, 1.0 / n));
}

/// Calls f(0), …, f(N - 1), each argument as an integral_constant.
template <int N, class F>
constexpr void unrolled(const F& f) {
    [&]<int... K>(std::integer_sequence<int, K...>) { (f(std::integral_constant<int, K>{}), ...); }
    (std::make_integer_sequence<int, N>{});
}

} // namespace curlew
