// SPDX-License-Identifier: Apache-2.0
#include "support/Catch.h"

#if defined(__x86_64__)

// As in the kernels (cmake/Room.cmake). Tests are compiled for AVX2.
#ifndef HWY_DISABLE_PCLMUL_AES
#define HWY_DISABLE_PCLMUL_AES
#endif
#include "curlew/base/Random.h"
#include "curlew/math/LaneTables.h"

#include <bit>
#include <limits>
#include <vector>

// In the namespace, so that calls with numbers find its own functions, not those of the C library.
namespace curlew {

namespace {

template <class T>
using Bits = std::conditional_t<sizeof(T) == 8, uint64_t, uint32_t>;

/// Returns whether two numbers are bitwise equal. All NaNs are equal.
template <class T>
bool same(T a, T b) {
    return std::bit_cast<Bits<T>>(a) == std::bit_cast<Bits<T>>(b) || (a != a && b != b);
}

/// Numbers of all kinds.
template <class T>
std::vector<T> numbers() {
    using Limits = std::numeric_limits<T>;
    std::vector<T> all{0,
                       1,
                       static_cast<T>(-1),
                       T(0.5),
                       T(1.5),
                       -T(1.5),
                       255,
                       T(1e7),
                       Limits::max(),
                       Limits::min(),
                       Limits::denorm_min()};
    if constexpr (std::floating_point<T>)
        all.insert(all.end(),
                   {-T(0), Limits::quiet_NaN(), Limits::infinity(), -Limits::infinity(), -Limits::max(), T(-0.3)});
    for (uint64_t k = 0; k < 20; ++k) {
        if constexpr (std::floating_point<T>)
            all.push_back(static_cast<T>(std::ldexp(2 * randomUniform(1, k) - 1, static_cast<int>(k) - 8)));
        else
            all.push_back(static_cast<T>(randomBits(1, k)));
    }
    return all;
}

/// Counts the triples of numbers for which a lane of f differs from f of the numbers. All triples are tested.
template <class T, class F>
int differences(const F& f) {
    using L = Lanes<T, Avx2>;
    constexpr size_t kCount = L::kCount;
    const std::vector<T> all = numbers<T>();
    const size_t n = all.size(), triples = n * n * n;
    int wrong = 0;
    for (size_t first = 0; first < triples; first += kCount) {
        std::array<T, kCount> a, b, c;
        for (size_t lane = 0; lane < kCount; ++lane) {
            const size_t k = (first + lane) % triples;
            a[lane] = all[k % n];
            b[lane] = all[k / n % n];
            c[lane] = all[k / n / n];
        }
        const auto result = f(L::load(a.data()), L::load(b.data()), L::load(c.data()));
        std::array<NumberOf<std::remove_const_t<decltype(result)>>, kCount> got;
        store(result, got.data());
        for (size_t lane = 0; lane < kCount; ++lane) wrong += !same(got[lane], f(a[lane], b[lane], c[lane]));
    }
    return wrong;
}

/// The same for functions of one number.
template <class T, class F>
int differencesOfOne(const F& f) {
    return differences<T>([&f](auto a, auto, auto) { return f(a); });
}

/// Lanes of whole numbers 0, 1, …, below `end`.
template <class L>
L counting(uint64_t seed, uint64_t end) {
    std::array<NumberOf<L>, L::kCount> x;
    for (size_t lane = 0; lane < L::kCount; ++lane) x[lane] = static_cast<NumberOf<L>>(randomBits(seed, lane) % end);
    return L::load(x.data());
}

template <class L>
auto numbersOf(const L& lanes) {
    std::array<NumberOf<L>, L::kCount> x;
    store(lanes, x.data());
    return x;
}

} // namespace

TEMPLATE_TEST_CASE("Lanes: floating-point arithmetic matches scalars bit for bit", "[math]", float, double) {
    using T = TestType;
    CHECK(differences<T>([](auto a, auto b, auto) { return a + b; }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto) { return a - b; }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto) { return a * b; }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto) { return a / b; }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto) { return a += b; }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto) { return a -= b; }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto) { return a *= b; }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto) { return a /= b; }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto) { return min(a, b); }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto) { return max(a, b); }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto c) { return mulAdd(a, b, c); }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto c) { return negMulAdd(a, b, c); }) == 0);
    CHECK(differencesOfOne<T>([](auto a) { return -a; }) == 0);
    CHECK(differencesOfOne<T>([](auto a) { return floor(a); }) == 0);
    CHECK(differencesOfOne<T>([](auto a) { return sqrt(a); }) == 0);
    CHECK(differencesOfOne<T>([](auto a) { return abs(a); }) == 0);
    CHECK(differencesOfOne<T>([](auto a) { return sin(a); }) == 0);
    CHECK(differencesOfOne<T>([](auto a) { return cos(a); }) == 0);
    CHECK(differencesOfOne<T>([](auto a) { return log(a); }) == 0);
    CHECK(differencesOfOne<T>([](auto a) { return nearestProduct(a, decltype(a)(T(0.125))); }) == 0);
}

TEMPLATE_TEST_CASE("Lanes: comparison and select match scalars", "[math]", float, double) {
    using T = TestType;
    CHECK(differences<T>([](auto a, auto b, auto c) { return select(a < b, a, c); }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto c) { return select(a <= b, a, c); }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto c) { return select(a > b, a, c); }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto c) { return select(a >= b, a, c); }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto c) { return select(a == b, a, c); }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto c) { return select((a < b) & (b < c), a, c); }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto c) { return select((a < b) | (b < c), a, c); }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto c) { return select(!(a < b), a, c); }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto) {
              using Word = Rebind<decltype(a), Bits<T>>;
              return select(a < b, Word(3), Word(7));
          }) == 0);
}

TEMPLATE_TEST_CASE("Lanes: integer arithmetic matches scalars", "[math]", uint32_t, uint64_t) {
    using T = TestType;
    CHECK(differences<T>([](auto a, auto b, auto) { return a + b; }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto) { return a - b; }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto) { return a * b; }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto) { return a & b; }) == 0);
    CHECK(differences<T>([](auto a, auto b, auto) { return a ^ b; }) == 0);
    for (const int bits : {1, 6, 13, 31}) {
        CHECK(differencesOfOne<T>([bits](auto a) { return a << bits; }) == 0);
        CHECK(differencesOfOne<T>([bits](auto a) { return a >> bits; }) == 0);
    }
}

TEST_CASE("Lanes: conversions match scalars", "[math]") {
    CHECK(differencesOfOne<float>([](auto a) { return convertTo<Rebind<decltype(a), double>>(a); }) == 0);
    CHECK(differencesOfOne<double>([](auto a) { return convertTo<Rebind<decltype(a), float>>(a); }) == 0);
    CHECK(differencesOfOne<double>([](auto a) { return convertTo<decltype(a)>(a); }) == 0);
    CHECK(differencesOfOne<uint64_t>([](auto a) { return convertTo<Rebind<decltype(a), uint32_t>>(a); }) == 0);
    CHECK(differencesOfOne<uint64_t>([](auto a) { return convertTo<Rebind<decltype(a), double>>(a >> 12); }) == 0);
    CHECK(differencesOfOne<uint32_t>([](auto a) { return convertTo<Rebind<decltype(a), double>>(a >> 1); }) == 0);
    CHECK(differencesOfOne<uint32_t>([](auto a) { return convertTo<Rebind<decltype(a), float>>(a >> 1); }) == 0);
    const auto wordWithin = [](auto a) {
        using L = decltype(a);
        return wordOf(floor(max(min(a, L(0x1p51)), L(-0x1p51))));
    };
    CHECK(differencesOfOne<double>(wordWithin) == 0);
}

TEMPLATE_TEST_CASE("Lanes: table lookups match scalars", "[math]", float, double) {
    using T = TestType;
    using L = Lanes<T, Avx2>;
    using F = Lanes<float, Avx2>;
    std::array<Row<T>, 256> rows;
    std::array<float, 256> table;
    for (uint64_t k = 0; k < 256; ++k) {
        table[k] = static_cast<float>(randomUniform(2, k));
        for (uint64_t i = 0; i < 4; ++i) rows[k].c[i] = static_cast<T>(randomUniform(3, k, i));
    }
    int wrong = 0;
    for (uint64_t seed = 0; seed < 100; ++seed) {
        const F within = counting<F>(seed, 200), beyond = counting<F>(seed, 512);
        const auto place = numbersOf(within), far = numbersOf(beyond), values = numbersOf(valuesAt(table, beyond));
        const auto index = indicesOf(within, 199), wrapped = wrappedIndicesOf(beyond, 255);
        unrolled<4>([&](auto last) {
            constexpr size_t kCount = last + 1;
            const auto found = rowsAt<L, kCount>(rows.data(), index);
            for (size_t k = 0; k < kCount; ++k) {
                const auto some = numbersOf(found[k]);
                for (size_t lane = 0; lane < L::kCount; ++lane)
                    wrong += !same(some[lane], rowsAt<T, kCount>(rows.data(), indicesOf(place[lane], 199))[k]);
            }
        });
        for (size_t lane = 0; lane < L::kCount; ++lane) {
            wrong += index[lane] != indicesOf(place[lane], 199)[0];
            wrong += wrapped[lane] != wrappedIndicesOf(far[lane], 255)[0];
            wrong += !same(values[lane], valuesAt(table, far[lane]));
        }
    }
    CHECK(wrong == 0);
    // Values that are not an index become a valid index.
    for (const float x : numbers<float>()) {
        CAPTURE(x);
        CHECK(indicesOf(x, 199)[0] <= 199);
        for (const uint32_t place : indicesOf(F(x), 199)) CHECK(place <= 199);
    }
}

} // namespace curlew

#endif
