// SPDX-License-Identifier: Apache-2.0
#include "ScatterDomain.h"

#include "curlew/app/registry/Options.h"

namespace curlew::app {

using namespace options;

Input domainInput() {
    Input input = maybe(stays("domain", {Kind::flow, Kind::shape, Kind::levelSet}, "grid"),
                        "optional with box=, unless on=surface; a shape or level set then only as domain=NAME");
    input.amountWith = [](const Arguments& a, const Scope& scope) -> Amount {
        if (!fillsBox(a) || a.given("grid")) return {1, 1};
        return scope.linked() || scope.count({Kind::flow}) > 0 ? Amount{0, 1} : Amount{0, 0};
    };
    return input;
}

bool fillsBox(const Arguments& a) { return a.given("box") && a.choice<ScatterOn>("on") == ScatterOn::volume; }

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

Option onOption() {
    return choice(
        "on", kScatterOnNames,
        "volume: inside the domain; surface: on the wall of a flow, or on the surface of a shape or level set");
}

Option offsetOption(const std::string& byDefault) {
    return onlyWith(
        {"on=surface"},
        notNegative("offset", "", "world units",
                    fmt::format("distance from the surface, on the flow's side, or outside a shape or level "
                                "set (default: {} of the diagonal of its box)",
                                byDefault)));
}

Input densityInput() {
    return onRequest(stays("density", {Kind::field}),
                     "only as density=NAME: relative density of the points, from 0 to 1",
                     [](const Arguments&) { return false; });
}

Birthplace birthplaceOf(const Context& c, const Arguments& a, OffSurface off) {
    constexpr double kLittle = 1e-3; // relative to the diagonal
    const bool surface = a.choice<ScatterOn>("on") == ScatterOn::surface;
    Birthplace birth{.domain = scatterDomain(c, a), .place = {.on = a.choice<ScatterOn>("on")}};
    if (c.has("density")) birth.place.density = inSpace(c.field("density").field);
    if (!surface) return birth;
    if (a.given("box")) birth.place.within = birth.domain.box;
    if (!birth.domain.wall)
        throw ValueError(
            "on=surface needs a shape, a level set or a flow with a wall; to use one that is not the newest, name it "
            "with as=NAME and give domain=NAME here");
    const bool flow = c.kind("domain") == Kind::flow;
    const Box& bounds = birth.domain.wall->sdf.bounds;
    const double size = length((bounds.finite() ? bounds : birth.domain.box).size());
    double offset = flow || off == OffSurface::always ? kLittle * size : 0;
    if (a.given("offset")) offset = a.real("offset");
    const bool inside = flow && birth.domain.wall->side == Side::inside;
    birth.place.level = inside ? -offset : offset;
    // A level set's distance is only valid within its narrow band.
    if (!flow && c.kind("domain") == Kind::levelSet) birth.domain.wall->sdf = c.sdf("domain", offset + kLittle * size);
    return birth;
}

} // namespace curlew::app
