// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/Splitting.h"

#include "curlew/base/Error.h"

#include <cmath>

namespace curlew {

namespace {

/// Appends the factors of a Strang step of `fraction` time steps. Merges consecutive factors of the same term.
void appendStrang(double fraction, size_t terms, std::vector<SplitFactor>& factors) {
    const auto append = [&](size_t term, double part) {
        if (!factors.empty() && factors.back().term == term)
            factors.back().fraction += part;
        else
            factors.push_back({term, part});
    };
    const size_t last = terms - 1;
    for (size_t k = 0; k < last; ++k) append(k, fraction / 2);
    append(last, fraction);
    for (size_t k = last; k-- > 0;) append(k, fraction / 2);
}

} // namespace

std::vector<SplitFactor> compositionOf(Splitting splitting, size_t terms) {
    if (terms == 0) throw ValueError("a sum without terms cannot be split");
    std::vector<SplitFactor> factors;
    switch (splitting) {
        case Splitting::strang:
            appendStrang(1, terms, factors);
            return factors;
        case Splitting::yoshida: {
            const double outer = 1 / (2 - std::cbrt(2.0));
            for (const double part : {outer, 1 - 2 * outer, outer}) appendStrang(part, terms, factors);
            return factors;
        }
        case Splitting::none:
            break;
    }
    throw ValueError("this splitting is not a composition; choose strang or yoshida");
}

} // namespace curlew
