#pragma once

#include "support/Formula.h"

#include <stdexcept>
#include <string>
#include <vector>

namespace curlew::test {

/// A polynomial in x0, x1, x2 as the reference files write it: "-x0**4 - 2*x0**3*x1 + x2".
struct Polynomial {
    struct Term {
        double factor;
        std::array<int, 3> powers{};
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

    template <class V>
    auto operator()(const V& x) const {
        using J = std::remove_cvref_t<decltype(x[0])>;
        using T = std::remove_cvref_t<decltype(x[0].value)>;
        J sum;
        for (const Term& term : terms) {
            J product(static_cast<T>(term.factor));
            for (int axis = 0; axis < 3; ++axis)
                for (int k = 0; k < term.powers[static_cast<size_t>(axis)]; ++k) product = product * x[axis];
            sum += product;
        }
        return sum;
    }
};

inline ScalarField polynomial(const std::string& text) { return formula(Polynomial(text)); }

} // namespace curlew::test
