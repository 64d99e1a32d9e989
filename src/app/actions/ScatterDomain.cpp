#include "ScatterDomain.h"

#include "curlew/app/registry/Options.h"

namespace curlew::app {

using namespace options;

Input domainInput() {
    Input input =
        maybe(stays("domain", {Kind::flow, Kind::shape, Kind::levelSet}, "grid"), "with box= there may be none");
    input.amountWith = [](const Arguments& a, const Scope& scope) -> Amount {
        if (!a.given("box") || a.given("grid")) return {1, 1};
        return scope.linked() || scope.count({Kind::flow}) > 0 ? Amount{0, 1} : Amount{0, 0};
    };
    return input;
}

Domain domainOfInput(const Context& c, std::string_view input) {
    if (c.kind(input) == Kind::flow) return c.flow(input).domain();
    Domain domain = Domain::of({.sdf = c.sdf(input, 0), .side = Side::inside});
    if (!domain.wall->sdf.bounds.finite()) domain.box = boxOf(c.value(input)).value_or(domain.box); // a shape in 2D
    return domain;
}

Domain scatterDomain(const Context& c, const Arguments& a) {
    Domain domain = c.has("domain") ? domainOfInput(c, "domain") : Domain{};
    if (a.given("box")) domain.box = a.box("box");
    return domain;
}

} // namespace curlew::app
