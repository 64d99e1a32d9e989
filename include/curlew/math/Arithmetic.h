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

// What a kernel is written in: a type T of numbers that is float, double, or several of them at once (Lanes.h), and
// these functions, each rounded once. So a kernel gives the same bits on any of them. Found by argument-dependent
// lookup for lanes; here for one number. A choice between values is a `select`, never a branch on one of them.

/// a b + c. (std::fma is not constexpr; what the compiler evaluates is rounded twice.)
template <std::floating_point T>
constexpr T mulAdd(T a, T b, T c) {
    if (std::is_constant_evaluated()) return a * b + c;
    return std::fma(a, b, c);
}
/// c - a b.
template <std::floating_point T>
constexpr T negMulAdd(T a, T b, T c) {
    return mulAdd(-a, b, c);
}
/// For what is not a number but made of some, such as jets: not fused.
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
/// b where one of them is NaN.
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
/// What comparing two T gives.
template <class T>
using MaskOf = decltype(T() < T());

template <class T>
struct LanesOf {
    static constexpr int kCount = 1;
    using Number = T;
    template <class U>
    using Of = U;
    static T load(const T* from) { return *from; }
    static std::array<T, 4> fourFrom(const float* const* places, size_t offset) {
        const float* from = places[0] + offset;
        return {T{from[0]}, T{from[1]}, T{from[2]}, T{from[3]}};
    }
};
/// What lanes are of; of a number, its own type.
template <class T>
using NumberOf = typename LanesOf<T>::Number;
/// How many numbers T is.
template <class T>
inline constexpr int kLanes = LanesOf<T>::kCount;
/// As many numbers of type U as T has.
template <class T, class U>
using Rebind = typename LanesOf<T>::template Of<U>;
template <int Count>
struct alignas(4 * Count) IndexArray : std::array<uint32_t, size_t{Count}> {};
/// As many places in a table.
template <class T>
using Indices = IndexArray<kLanes<T>>;

template <class T, class U>
requires(std::is_arithmetic_v<T>&& std::is_arithmetic_v<U>) T convertTo(U x) { return static_cast<T>(x); }

/// The whole number x, |x| <= 2^51, modulo 2^64.
inline uint64_t wordOf(double x) { return static_cast<uint64_t>(static_cast<int64_t>(x)); }

template <class T>
T load(const NumberOf<T>* from) {
    return LanesOf<T>::load(from);
}
template <class T>
requires std::is_arithmetic_v<T>
void store(T x, T* to) { *to = x; }

/// Four numbers that are looked up together.
template <class T>
struct alignas(4 * sizeof(T)) Row {
    std::array<T, 4> c{};
};

/// Whole numbers of 0 … last as places in a table of last + 1 rows; anything else is some such place, too.
inline IndexArray<1> indicesOf(float x, uint32_t last) {
    return {{x >= 0 && x <= static_cast<float>(last) ? static_cast<uint32_t>(x) : last}};
}
/// Whole numbers, below 2^31 and not negative, modulo last + 1, which is a power of two.
inline IndexArray<1> wrappedIndicesOf(float x, uint32_t last) { return {{static_cast<uint32_t>(x) & last}}; }
/// The numbers of a table at the whole numbers x >= 0 modulo its size.
template <size_t Size>
float valuesAt(const std::array<float, Size>& table, float x) {
    static_assert((Size & (Size - 1)) == 0);
    return table[static_cast<uint32_t>(x) & (Size - 1)];
}
/// The first numbers of the rows at these places.
template <class T, size_t K>
std::array<T, K> rowsAt(const Row<T>* rows, const IndexArray<1>& index) {
    std::array<T, K> numbers;
    for (size_t k = 0; k < K; ++k) numbers[k] = rows[index[0]].c[k];
    return numbers;
}

/// Four numbers that lie together, at an offset from one place for each lane.
template <class T>
std::array<T, 4> fourFrom(const float* const* places, size_t offset) {
    return LanesOf<T>::fourFrom(places, offset);
}

/// a b rounded to a whole number, once; |a b| < 2^51 for double, 2^22 for float.
template <class T>
T nearestProduct(const T& a, const T& b) {
    const auto magic = static_cast<T>(std::is_same_v<NumberOf<T>, float> ? 0x1.8p23 : 0x1.8p52);
    return mulAdd(a, b, magic) - magic;
}

/// i modulo p, within [0, p), for whole numbers |i| < 2^51 in double. Beyond, and for NaN: any number. `inverse`: 1 /
/// p.
template <class T>
T floorMod(const T& i, double p, double inverse) {
    // Half more keeps the quotient away from whole numbers, where the rounding of the inverse could tell.
    return negMulAdd(floor(mulAdd(i, T(inverse), T(0.5 * inverse))), T(p), i);
}

/// f(0), …, f(N - 1), each with its number as a constant.
template <int N, class F>
constexpr void unrolled(const F& f) {
    [&]<int... K>(std::integer_sequence<int, K...>) { (f(std::integral_constant<int, K>{}), ...); }
    (std::make_integer_sequence<int, N>{});
}

} // namespace curlew
