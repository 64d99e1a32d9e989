// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "support/Formula.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

namespace curlew::test {

/// A polynomial in x0 … x6 as the reference files write it: "-x0**4 - 2*x0**3*x1 + x2".
struct Polynomial {
    struct Term {
        double factor;
        std::array<int, 7> powers{};
    };
    std::vector<Term> terms;

    explicit Polynomial(const std::string& text) {
        size_t k = 0;
        const auto skip = [&] { k = std::min(text.find_first_not_of(' ', k), text.size()); };
        const auto number = [&] {
            size_t used = 0;
            const int n = std::stoi(text.substr(k), &used);
            k += used;
            return n;
        };
        for (skip(); k < text.size(); skip()) {
            Term term{.factor = 1};
            if (text[k] == '-' || text[k] == '+') term.factor = text[k++] == '-' ? -1 : 1;
            for (bool more = true; more;) {
                skip();
                if (k < text.size() && text[k] == 'x') {
                    ++k;
                    const auto variable = static_cast<size_t>(number());
                    const bool power = text.compare(k, 2, "**") == 0;
                    if (power) k += 2;
                    term.powers.at(variable) += power ? number() : 1;
                } else {
                    term.factor *= number();
                }
                more = k < text.size() && text[k] == '*';
                k += more;
            }
            terms.push_back(term);
        }
        if (terms.empty()) throw std::invalid_argument("no polynomial: " + text);
    }

    /// How many variables it needs.
    int variables() const {
        int count = 0;
        for (const Term& term : terms)
            for (int axis = 0; axis < 7; ++axis)
                if (term.powers[static_cast<size_t>(axis)] > 0) count = std::max(count, axis + 1);
        return count;
    }

    template <class J, int N>
    J operator()(const Vec<J, N>& x) const {
        using T = decltype(J::value);
        J sum;
        for (const Term& term : terms) {
            J product(static_cast<T>(term.factor));
            for (int axis = 0; axis < N; ++axis)
                for (int k = 0; k < term.powers[static_cast<size_t>(axis)]; ++k) product = product * x[axis];
            sum += product;
        }
        return sum;
    }
};

template <int N = 3>
ScalarFieldN<N> polynomial(const std::string& text) {
    Polynomial p(text);
    if (p.variables() > N) throw std::invalid_argument("a variable too many: " + text);
    return formula<N>(std::move(p));
}

} // namespace curlew::test
