// SPDX-License-Identifier: Apache-2.0
#pragma once

// Only for files named *Kernels.cpp (LaneKernels.h).

#include "curlew/math/Arithmetic.h"
#include "curlew/math/Dispatch.h"

#include <hwy/highway.h>

namespace curlew {

namespace hn = hwy::HWY_NAMESPACE;

/// The instruction sets, as types. Kernels process as many positions at once as floats fit into one register.
struct Avx2 {
    static constexpr size_t kRegister = 32; ///< In bytes.
};
struct Avx512 {
    static constexpr size_t kRegister = 64;
};

/// Numbers of type T, one per position. Their count is the number of floats in a register of the instruction set S, so
/// doubles take two registers. Behaves like a single number (Arithmetic.h). T is float or double, or uint32_t or
/// uint64_t, which hashes need.
template <class T, class S>
class Lanes {
  public:
    static constexpr size_t kCount = S::kRegister / sizeof(float), kPart = S::kRegister / sizeof(T);
    static constexpr size_t kParts = kCount / kPart;
    using Tag = hn::FixedTag<T, kPart>;
    using Register = hn::Vec<Tag>;

    /// The result of a comparison.
    struct Mask {
        std::array<hn::Mask<Tag>, kParts> part;
        friend Mask operator&(const Mask& a, const Mask& b) {
            return each([&](size_t k) { return hn::And(a.part[k], b.part[k]); });
        }
        friend Mask operator|(const Mask& a, const Mask& b) {
            return each([&](size_t k) { return hn::Or(a.part[k], b.part[k]); });
        }
        friend Mask operator!(const Mask& a) {
            return each([&](size_t k) { return hn::Not(a.part[k]); });
        }
        /// Whether it holds for any lane.
        friend bool any(const Mask& a) {
            for (size_t k = 0; k < kParts; ++k)
                if (!hn::AllFalse(Tag(), a.part[k])) return true;
            return false;
        }

        template <class F>
        static Mask each(const F& f) {
            Mask m;
            for (size_t k = 0; k < kParts; ++k) m.part[k] = f(k);
            return m;
        }
    };

    std::array<Register, kParts> part;

    Lanes() : Lanes(T(0)) {}
    Lanes(T x) { // NOLINT: implicit; a number converts to lanes that all have its value
        for (auto& p : part) p = hn::Set(Tag(), x);
    }
    template <class U>
    requires(std::is_arithmetic_v<U> && !std::same_as<U, T>) explicit Lanes(U x) : Lanes(static_cast<T>(x)) {}

    static Lanes load(const T* from) {
        return each([&](size_t k) { return hn::LoadU(Tag(), from + k * kPart); });
    }

    Lanes& operator+=(const Lanes& o) { return *this = *this + o; }
    Lanes& operator-=(const Lanes& o) { return *this = *this - o; }
    Lanes& operator*=(const Lanes& o) { return *this = *this * o; }
    Lanes& operator/=(const Lanes& o) { return *this = *this / o; }
    friend Lanes operator+(const Lanes& a, const Lanes& b) {
        return each([&](size_t k) { return hn::Add(a.part[k], b.part[k]); });
    }
    friend Lanes operator-(const Lanes& a, const Lanes& b) {
        return each([&](size_t k) { return hn::Sub(a.part[k], b.part[k]); });
    }
    friend Lanes operator*(const Lanes& a, const Lanes& b) {
        return each([&](size_t k) { return hn::Mul(a.part[k], b.part[k]); });
    }
    friend Lanes operator/(const Lanes& a, const Lanes& b) {
        return each([&](size_t k) { return hn::Div(a.part[k], b.part[k]); });
    }
    friend Lanes operator-(const Lanes& a) {
        return each([&](size_t k) { return hn::Neg(a.part[k]); });
    }
    friend Mask operator<(const Lanes& a, const Lanes& b) {
        return Mask::each([&](size_t k) { return hn::Lt(a.part[k], b.part[k]); });
    }
    friend Mask operator<=(const Lanes& a, const Lanes& b) {
        return Mask::each([&](size_t k) { return hn::Le(a.part[k], b.part[k]); });
    }
    friend Mask operator>(const Lanes& a, const Lanes& b) { return b < a; }
    friend Mask operator>=(const Lanes& a, const Lanes& b) { return b <= a; }
    friend Mask operator==(const Lanes& a, const Lanes& b) {
        return Mask::each([&](size_t k) { return hn::Eq(a.part[k], b.part[k]); });
    }

    // Bitwise operators, for unsigned integers.
    friend Lanes operator&(const Lanes& a, const Lanes& b) {
        return each([&](size_t k) { return hn::And(a.part[k], b.part[k]); });
    }
    friend Lanes operator^(const Lanes& a, const Lanes& b) {
        return each([&](size_t k) { return hn::Xor(a.part[k], b.part[k]); });
    }
    friend Lanes operator<<(const Lanes& a, int bits) {
        return each([&](size_t k) { return hn::ShiftLeftSame(a.part[k], bits); });
    }
    friend Lanes operator>>(const Lanes& a, int bits) {
        return each([&](size_t k) { return hn::ShiftRightSame(a.part[k], bits); });
    }

    friend Lanes mulAdd(const Lanes& a, const Lanes& b, const Lanes& c) {
        return each([&](size_t k) { return hn::MulAdd(a.part[k], b.part[k], c.part[k]); });
    }
    friend Lanes negMulAdd(const Lanes& a, const Lanes& b, const Lanes& c) {
        return each([&](size_t k) { return hn::NegMulAdd(a.part[k], b.part[k], c.part[k]); });
    }
    friend Lanes floor(const Lanes& a) {
        return each([&](size_t k) { return hn::Floor(a.part[k]); });
    }
    friend Lanes sqrt(const Lanes& a) {
        return each([&](size_t k) { return hn::Sqrt(a.part[k]); });
    }
    friend Lanes abs(const Lanes& a) {
        return each([&](size_t k) { return hn::Abs(a.part[k]); });
    }
    // These call the C library for one lane after another.
    friend Lanes sin(const Lanes& a) {
        return oneByOne(a, [](T x) { return std::sin(x); });
    }
    friend Lanes cos(const Lanes& a) {
        return oneByOne(a, [](T x) { return std::cos(x); });
    }
    friend Lanes log(const Lanes& a) {
        return oneByOne(a, [](T x) { return std::log(x); });
    }
    friend Lanes exp(const Lanes& a) {
        return oneByOne(a, [](T x) { return std::exp(x); });
    }
    friend Lanes asin(const Lanes& a) {
        return oneByOne(a, [](T x) { return std::asin(x); });
    }
    friend Lanes acos(const Lanes& a) {
        return oneByOne(a, [](T x) { return std::acos(x); });
    }
    friend Lanes atan(const Lanes& a) {
        return oneByOne(a, [](T x) { return std::atan(x); });
    }
    friend Lanes sinh(const Lanes& a) {
        return oneByOne(a, [](T x) { return std::sinh(x); });
    }
    friend Lanes cosh(const Lanes& a) {
        return oneByOne(a, [](T x) { return std::cosh(x); });
    }
    friend Lanes tanh(const Lanes& a) {
        return oneByOne(a, [](T x) { return std::tanh(x); });
    }
    /// All lanes to the same power.
    friend Lanes pow(const Lanes& a, T exponent) {
        return oneByOne(a, [exponent](T x) { return std::pow(x, exponent); });
    }
    friend Lanes min(const Lanes& a, const Lanes& b) {
        return each([&](size_t k) { return hn::Min(a.part[k], b.part[k]); });
    }
    friend Lanes max(const Lanes& a, const Lanes& b) {
        return each([&](size_t k) { return hn::Max(a.part[k], b.part[k]); });
    }
    friend Lanes select(const Mask& m, const Lanes& yes, const Lanes& no) {
        return each([&](size_t k) { return hn::IfThenElse(m.part[k], yes.part[k], no.part[k]); });
    }
    using Words = Lanes<std::conditional_t<sizeof(T) == 8, uint64_t, uint32_t>, S>;
    friend Words select(const Mask& m, const Words& yes, const Words& no) requires std::floating_point<T> {
        return Words::each([&](size_t k) {
            return hn::IfThenElse(hn::RebindMask(typename Words::Tag(), m.part[k]), yes.part[k], no.part[k]);
        });
    }
    friend void store(const Lanes& a, T* to) {
        for (size_t k = 0; k < kParts; ++k) hn::StoreU(a.part[k], Tag(), to + k * kPart);
    }

    template <class F>
    static Lanes each(const F& f) {
        Lanes r;
        for (size_t k = 0; k < kParts; ++k) r.part[k] = f(k);
        return r;
    }

  private:
    template <class F>
    static Lanes oneByOne(const Lanes& a, const F& f) {
        std::array<T, kCount> x;
        store(a, x.data());
        for (T& number : x) number = f(number);
        return load(x.data());
    }
};

template <class T, class S>
struct LanesOf<Lanes<T, S>> {
    static constexpr int kCount = static_cast<int>(Lanes<T, S>::kCount);
    static constexpr bool kSymbolic = false;
    using Number = T;
    using Indices = IndexArray<kCount>;
    template <class U>
    using Of = Lanes<U, S>;
    static Lanes<T, S> load(const T* from) { return Lanes<T, S>::load(from); }
    static std::array<Lanes<T, S>, 4> fourFrom(const float* const* places, size_t offset);
};

template <class To, class T, class S>
requires std::same_as<To, Lanes<T, S>> To convertTo(const Lanes<T, S>& x) { return x; }
template <class To, class S>
requires std::same_as<To, Lanes<float, S>> To convertTo(const Lanes<double, S>& x) {
    const typename To::Tag tag;
    const hn::Half<typename To::Tag> half;
    To r;
    r.part[0] = hn::Combine(tag, hn::DemoteTo(half, x.part[1]), hn::DemoteTo(half, x.part[0]));
    return r;
}
template <class To, class S>
requires std::same_as<To, Lanes<double, S>> To convertTo(const Lanes<float, S>& x) {
    const typename To::Tag tag;
    const hn::Half<typename Lanes<float, S>::Tag> half;
    To r;
    r.part[0] = hn::PromoteTo(tag, hn::LowerHalf(half, x.part[0]));
    r.part[1] = hn::PromoteTo(tag, hn::UpperHalf(half, x.part[0]));
    return r;
}

/// For integers below 2^31.
template <class To, class S>
requires std::same_as<To, Lanes<float, S>> To convertTo(const Lanes<uint32_t, S>& x) {
    const typename To::Tag tag;
    To r;
    r.part[0] = hn::ConvertTo(tag, hn::BitCast(hn::RebindToSigned<typename To::Tag>(), x.part[0]));
    return r;
}
/// For integers below 2^31.
template <class To, class S>
requires std::same_as<To, Lanes<double, S>> To convertTo(const Lanes<uint32_t, S>& x) {
    const typename To::Tag tag;
    const hn::Rebind<int32_t, typename To::Tag> half;
    const auto whole = hn::BitCast(hn::RebindToSigned<typename Lanes<uint32_t, S>::Tag>(), x.part[0]);
    To r;
    r.part[0] = hn::PromoteTo(tag, hn::LowerHalf(half, whole));
    r.part[1] = hn::PromoteTo(tag, hn::UpperHalf(half, whole));
    return r;
}
/// For integers below 2^52.
template <class To, class S>
requires std::same_as<To, Lanes<double, S>> To convertTo(const Lanes<uint64_t, S>& x) {
    using Words = Lanes<uint64_t, S>;
    const To magic(0x1p52); // its 52 low bits are zero, and adjacent doubles from here on differ by 1
    return To::each([&](size_t k) {
               return hn::BitCast(typename To::Tag(),
                                  hn::Or(x.part[k], hn::BitCast(typename Words::Tag(), magic.part[k])));
           }) -
           magic;
}
/// Converts modulo 2^32.
template <class To, class S>
requires std::same_as<To, Lanes<uint32_t, S>> To convertTo(const Lanes<uint64_t, S>& x) {
    const typename To::Tag tag;
    const hn::Half<typename To::Tag> half;
    To r;
    r.part[0] = hn::Combine(tag, hn::TruncateTo(half, x.part[1]), hn::TruncateTo(half, x.part[0]));
    return r;
}

template <class S>
Lanes<uint64_t, S> wordOf(const Lanes<double, S>& x) {
    using Words = Lanes<uint64_t, S>;
    const Lanes<double, S> magic(0x1.8p52), sum = x + magic;
    return Words::each([&](size_t k) {
        const typename Words::Tag tag;
        return hn::Sub(hn::BitCast(tag, sum.part[k]), hn::BitCast(tag, magic.part[k]));
    });
}

} // namespace curlew
