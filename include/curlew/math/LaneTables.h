// SPDX-License-Identifier: Apache-2.0
#pragma once

// The table lookups of Arithmetic.h for lanes. Only for files named *Kernels.cpp (LaneKernels.h).

#include "curlew/math/Lanes.h"

namespace curlew {

template <class S>
Indices<Lanes<float, S>> indicesOf(const Lanes<float, S>& x, uint32_t last) {
    using Tag = typename Lanes<float, S>::Tag;
    const hn::RebindToUnsigned<Tag> index;
    // Floats in [2^23, 2^24) are exactly the integers there. All other inputs give an index beyond `last`, which Min
    // clamps.
    const auto magic = hn::Set(Tag(), 0x1p23f);
    const auto places = hn::Sub(hn::BitCast(index, hn::Add(x.part[0], magic)), hn::BitCast(index, magic));
    Indices<Lanes<float, S>> indices;
    hn::Store(hn::Min(places, hn::Set(index, last)), index, indices.data());
    // Forces the compiler to read the indices from memory one by one: extracting them from a register is slower.
    asm volatile("" : "+m"(indices)); // NOLINT
    return indices;
}

template <class S>
Indices<Lanes<float, S>> wrappedIndicesOf(const Lanes<float, S>& x, uint32_t last) {
    using Tag = typename Lanes<float, S>::Tag;
    const hn::RebindToSigned<Tag> whole;
    const hn::RebindToUnsigned<Tag> index;
    Indices<Lanes<float, S>> indices;
    hn::Store(hn::And(hn::BitCast(index, hn::ConvertTo(whole, x.part[0])), hn::Set(index, last)), index,
              indices.data());
    asm volatile("" : "+m"(indices)); // NOLINT: as above
    return indices;
}
template <size_t Size, class S>
Lanes<float, S> valuesAt(const std::array<float, Size>& table, const Lanes<float, S>& x) {
    static_assert((Size & (Size - 1)) == 0);
    using Tag = typename Lanes<float, S>::Tag;
    const hn::RebindToSigned<Tag> whole;
    Lanes<float, S> values;
    values.part[0] = hn::GatherIndex(
        Tag(), table.data(), hn::And(hn::ConvertTo(whole, x.part[0]), hn::Set(whole, static_cast<int32_t>(Size - 1))));
    return values;
}

namespace detail {

/// Loads the 128-bit blocks at from(first), from(first + step), … side by side into one register.
template <class Tag, class From>
hn::Vec<Tag> blocks(Tag tag, const From& from, size_t first, size_t step) {
    using T = hn::TFromD<Tag>;
    constexpr size_t kBlocks = hn::MaxLanes(Tag()) * sizeof(T) / 16;
    if constexpr (kBlocks == 1) {
        return hn::LoadU(tag, from(first));
    } else {
        const hn::Half<Tag> half;
        return hn::Combine(tag, blocks(half, from, first + kBlocks / 2 * step, step), blocks(half, from, first, step));
    }
}

// Loads whole rows and transposes them: several times faster than one gather per number.

/// Returns the first K of the four numbers at from(lane), for all lanes.
template <class P, size_t K, class From>
std::array<P, K> transposed(const From& from) {
    const typename P::Tag tag;
    const hn::Repartition<double, typename P::Tag> pairs;
    const auto a = blocks(tag, from, 0, 4), b = blocks(tag, from, 1, 4), c = blocks(tag, from, 2, 4),
               d = blocks(tag, from, 3, 4);
    const auto ab = hn::BitCast(pairs, hn::InterleaveLower(tag, a, b)),
               cd = hn::BitCast(pairs, hn::InterleaveLower(tag, c, d));
    std::array<P, K> numbers;
    numbers[0].part[0] = hn::BitCast(tag, hn::InterleaveLower(pairs, ab, cd));
    if constexpr (K > 1) numbers[1].part[0] = hn::BitCast(tag, hn::InterleaveUpper(pairs, ab, cd));
    if constexpr (K > 2) {
        const auto ef = hn::BitCast(pairs, hn::InterleaveUpper(tag, a, b)),
                   gh = hn::BitCast(pairs, hn::InterleaveUpper(tag, c, d));
        numbers[2].part[0] = hn::BitCast(tag, hn::InterleaveLower(pairs, ef, gh));
        if constexpr (K > 3) numbers[3].part[0] = hn::BitCast(tag, hn::InterleaveUpper(pairs, ef, gh));
    }
    return numbers;
}

} // namespace detail

template <class P, size_t K>
requires(std::same_as<NumberOf<P>, float>&& kLanes<P> > 1) std::array<P, K> rowsAt(const Row<float>* rows,
                                                                                   const Indices<P>& index) {
    return detail::transposed<P, K>([&](size_t lane) { return rows[index[lane]].c.data(); });
}
template <class P, size_t K>
requires(std::same_as<NumberOf<P>, double>&& kLanes<P> > 1) std::array<P, K> rowsAt(const Row<double>* rows,
                                                                                    const Indices<P>& index) {
    const typename P::Tag tag;
    std::array<P, K> numbers;
    for (size_t pair = 0; pair < (K + 1) / 2; ++pair)
        for (size_t k = 0; k < P::kParts; ++k) {
            const auto from = [&](size_t lane) { return rows[index[lane + k * P::kPart]].c.data() + 2 * pair; };
            const auto even = detail::blocks(tag, from, 0, 2), odd = detail::blocks(tag, from, 1, 2);
            numbers[2 * pair].part[k] = hn::InterleaveLower(tag, even, odd);
            if (2 * pair + 1 < K) numbers[2 * pair + 1].part[k] = hn::InterleaveUpper(tag, even, odd);
        }
    return numbers;
}

template <class T, class S>
std::array<Lanes<T, S>, 4> LanesOf<Lanes<T, S>>::fourFrom(const float* const* places, size_t offset) {
    using P = Lanes<T, S>;
    const auto four = detail::transposed<Lanes<float, S>, 4>([&](size_t lane) { return places[lane] + offset; });
    return {convertTo<P>(four[0]), convertTo<P>(four[1]), convertTo<P>(four[2]), convertTo<P>(four[3])};
}

} // namespace curlew
