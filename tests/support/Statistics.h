// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <vector>

namespace curlew::test {

inline double sumOfProducts(const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0;
    for (size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
    return sum;
}

/// Of values whose mean is zero.
inline double correlation(const std::vector<double>& a, const std::vector<double>& b) {
    return sumOfProducts(a, b) / std::sqrt(sumOfProducts(a, a) * sumOfProducts(b, b));
}

} // namespace curlew::test
