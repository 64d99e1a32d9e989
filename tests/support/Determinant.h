// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"

#include <algorithm>
#include <numeric>

namespace curlew::test {

/// The determinant of the matrix with these rows (or columns) by the formula of Leibniz, a sum over all permutations:
/// slow and independent of anything cleverer; exact where its products and sums are.
template <class T, size_t N>
T determinant(const std::array<Vec<T, static_cast<int>(N)>, N>& rows) {
    std::array<int, N> order;
    std::iota(order.begin(), order.end(), 0);
    T sum{};
    do {
        bool odd = false;
        for (size_t i = 0; i < N; ++i)
            for (size_t j = i + 1; j < N; ++j) odd ^= order[i] > order[j];
        T product = rows[0][order[0]];
        for (size_t i = 1; i < N; ++i) product = product * rows[i][order[i]];
        if (odd)
            sum -= product;
        else
            sum += product;
    } while (std::next_permutation(order.begin(), order.end()));
    return sum;
}

} // namespace curlew::test
