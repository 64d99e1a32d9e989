// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/NoiseField.h"
#include "curlew/field/Shapes.h"
#include "curlew/flow/Flows.h"
#include "curlew/shader/FlowPage.h"
#include "support/Catch.h"
#include "support/Flows.h"

using namespace curlew;
using namespace curlew::test;
using Catch::ContainsSubstring;

namespace {

const std::string kTitle = "<b> & co";

Flow boundedBy(Side side) {
    const Wall wall{.sdf = sphereSdf(1), .side = side, .width = 0.3};
    const auto potential = [&](uint64_t seed) { return bounded(noiseField<Psrd3>({.seed = seed}), wall); };
    return Flow(potential(1), potential(2), Domain::of(wall, 0.5));
}

} // namespace

TEST_CASE("flowPage: the page names the side of the wall, the tracks and the dimension", "[shader]") {
    CHECK_THAT(flowPage(boundedBy(Side::inside), {.title = "", .command = ""}),
               ContainsSubstring("dimension: 3, tracks: true, side: \"inside\""));
    CHECK_THAT(flowPage(boundedBy(Side::outside), {.title = "", .command = ""}),
               ContainsSubstring("side: \"outside\""));
    CHECK_THAT(flowPage(boundedBy(Side::both), {.title = "", .command = ""}), ContainsSubstring("side: \"both\""));
    CHECK_THAT(flowPage(FlowN<2>({noiseField<Psrd2>()}), {.title = "", .command = ""}),
               ContainsSubstring("dimension: 2, tracks: true, side: \"\""));
    const ScalarField noise = noiseField<Psrd3>();
    CHECK_THAT(
        flowPage(curlFlow(std::array{noise, noiseField<Psrd3>({.seed = 5}), noise}, {}), {.title = "", .command = ""}),
        ContainsSubstring("tracks: false"));
}

TEST_CASE("flowPage: the page needs nothing else, and shows the title and the command as they are", "[shader]") {
    const std::string page = flowPage(
        boundedBy(Side::inside), {.title = kTitle, .command = "-formula 'x<1' $TITLE", .points = {}, .corners = {}});
    CHECK_THAT(page, ContainsSubstring("<title>&lt;b&gt; &amp; co</title>") &&
                         ContainsSubstring("<pre>-formula 'x&lt;1' $TITLE</pre>"));
    CHECK_THAT(page, !ContainsSubstring("http:") && !ContainsSubstring("https:") && !ContainsSubstring(" src="));
    CHECK(page.ends_with("</html>\n"));
    CHECK(page.size() < 150000);
}

TEST_CASE("flowPage: what cannot be shown is an error", "[shader]") {
    CHECK_THROWS_WITH(flowPage(flowOf<SineNoise<4>>({}), {.title = "", .command = ""}),
                      ContainsSubstring("4 dimensions"));
    CHECK_THROWS_WITH(flowPage(Flow(rampField({{0, 1, 0}}), rampField({{0, 2, 0}})), {.title = "", .command = ""}),
                      "the flow does not move");
}
