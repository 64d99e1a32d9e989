// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/registry/Action.h"
#include "support/Catch.h"

#include <stdexcept>

using namespace curlew::app;

TEST_CASE("accepts: kind field covers every field and kind grid every grid", "[app]") {
    for (const Kind field : {Kind::field, Kind::noise, Kind::shape}) CHECK(accepts(Kind::field, field));
    for (const Kind grid : {Kind::grid, Kind::levelSet, Kind::velocity}) CHECK(accepts(Kind::grid, grid));
    CHECK(accepts(Kind::points, Kind::points));
    CHECK_FALSE(accepts(Kind::noise, Kind::shape));
    CHECK_FALSE(accepts(Kind::shape, Kind::noise));
    CHECK_FALSE(accepts(Kind::levelSet, Kind::grid));
    CHECK_FALSE(accepts(Kind::field, Kind::flow));
    CHECK_FALSE(accepts(Kind::points, Kind::mesh));
    CHECK(accepts({Kind::flow, Kind::field}, Kind::shape));
    CHECK_FALSE(accepts({Kind::flow, Kind::shape}, Kind::noise));
    CHECK_FALSE(accepts(std::vector<Kind>{}, Kind::noise));
}

TEST_CASE("Action: options and inputs are found by name", "[app]") {
    const Action action{.name = "bend",
                        .takes = {{.name = "noise", .kinds = {Kind::noise}}, {.name = "wall", .kinds = {Kind::shape}}},
                        .makes = {{.name = "field", .kinds = {Kind::field}}},
                        .options = {{.name = "width"}, {.name = "side"}}};
    CHECK(action.option("side") == &action.options[1]);
    CHECK(action.option("sid") == nullptr);
    CHECK(action.input("wall") == &action.takes[1]);
    CHECK(action.input("width") == nullptr);
    CHECK(action.inputIndex("wall") == 1);
    CHECK_THROWS_AS(action.inputIndex("walls"), std::logic_error); // a programming error
    CHECK(action.makesKind(Kind::shape));                          // a field can be a shape
    CHECK_FALSE(action.makesKind(Kind::points));
}
