// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/actions/Actions.h"
#include "curlew/app/language/Program.h"
#include "curlew/base/Error.h"

#include <catch2/catch.hpp>
#include <fmt/format.h>

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::Contains;

namespace {

/// Nothing is run: this is about what an action takes, which is known before.
Graph graphOf(const std::string& scene) {
    return graphOfScene(scene, "scene", {.registry = registry(), .world = {.lenient = true}});
}

std::string complaint(const std::string& scene) {
    try {
        graphOf(scene);
    } catch (const ValueError& e) {
        return e.what();
    }
    return "nothing is wrong with " + scene;
}

/// The names of what the last node takes: "f=swirl g=noise_2".
std::string lastInputs(const Graph& graph) {
    const Node& node = graph.nodes.back();
    std::string text;
    for (size_t k = 0; k < node.inputs.size(); ++k)
        for (const Link& link : node.inputs[k])
            text += fmt::format("{}{}={}", text.empty() ? "" : " ", node.action().takes[k].name, nameOf(graph, link));
    return text;
}
std::string taken(const std::string& scene) { return lastInputs(graphOf(scene)); }

} // namespace

// --- what is taken if nothing is said of it

TEST_CASE("an action takes the newest object that fits", "[app]") {
    CHECK(taken("noise\nnoise\nnoise\ndfvn") == "f=noise_2 g=noise_3");
    CHECK(taken("noise\nnoise\nsphere\nbound") == "noise=noise_2 wall=sphere"); // a shape is no noise
    CHECK(taken("sphere\nnoise\nnoise\ndfvn\nscatter\nadvect") == "flow=dfvn points=scatter");
    CHECK(taken("noise\nnoise\ndfvn\nsphere\nscatter") == "domain=sphere"); // whichever is the newest
    CHECK(taken("sphere\nnoise\nnoise\ndfvn\nscatter") == "domain=dfvn");
    CHECK(taken("noise\nnoise\nnoise\ncurl") == "x=noise y=noise_2 z=noise_3");
    CHECK(taken("noise dim=2\ndfvn") == "f=noise");
    CHECK(taken("noise\nnoise\nnoise type=simplex dim=4\nnoise type=simplex dim=4\nnoise type=simplex dim=4\ndfvn") ==
          "f=noise_3 g=noise_4 more=noise_5");
    // Of a shape and a level set, the one made last is the wall.
    const std::string mesh = "read a.obj\n";
    CHECK(taken(mesh + "mesh2ls dim=16\nsphere\nnoise\nbound") == "noise=noise wall=sphere");
    CHECK(taken("sphere\n" + mesh + "mesh2ls dim=16\nnoise\nbound") == "noise=noise wall=mesh2ls");
}

TEST_CASE("what an action takes is gone, unless it is kept", "[app]") {
    CHECK(taken("noise as=a\nnoise as=b\nnoise as=c\nsum\nsum") == "first=a second=sum");
    CHECK(taken("noise as=a\nnoise as=b\nnoise as=c\nsum keep=1\nsum") == "first=c second=sum");
    CHECK(taken("noise\nnoise\ndfvn\nvelocity\nvelocity") == "flow=dfvn"); // a flow stays
}

TEST_CASE("ages choose others than the newest", "[app]") {
    const std::string grids = "noise\nnoise\ndfvn\nvelocity as=old\nvelocity as=new\n";
    CHECK(taken(grids + "write a.vdb") == "what=new");
    CHECK(taken(grids + "write a.vdb grid=1") == "what=old");
    CHECK(taken(grids + "write a.vdb grid=0,1") == "what=new what=old");
    CHECK(taken(grids + "write a.vdb grid=1,0") == "what=old what=new");
    CHECK(taken("noise as=a\nnoise as=b\nsphere\nbound field=2") == "noise=a wall=sphere"); // a sphere is a field too
}

TEST_CASE("an age that does not exist is an error before anything is computed", "[app]") {
    const std::string grid = "noise\nnoise\ndfvn\nvelocity\n";
    CHECK_THAT(complaint(grid + "write a.vdb grid=1"),
               Contains("scene:5: -write: grid=1") && Contains("no grid of age 1") && Contains("there is 1"));
    CHECK_THAT(complaint("noise\nwrite a.vdb grid=0"), Contains("grid=0: there is no grid yet"));
    CHECK_THAT(complaint(grid + "velocity\nwrite a.vdb grid=0,2"), Contains("grid=2") && Contains("there are 2"));
    CHECK_THAT(complaint("sphere\nnoise\nbound field=2"), Contains("no field of age 2") && Contains("there are 2"));
    CHECK_THAT(complaint("noise\nslice width=8\ncompare"), Contains("-compare") && Contains("image"));
    CHECK_THAT(complaint("scatter box=0,0,0,1,1,1\ndistance geo=0,1"), Contains("geo=1"));
    CHECK_THAT(complaint("scatter box=0,0,0,1,1,1\ndistance geo=-1"), Contains("geo=-1") && Contains("0 the newest"));
}

TEST_CASE("an option that has no effect beside another one is an error", "[app]") {
    CHECK_THAT(complaint("noise\nnoise\ndfvn\nscatter\nadvect steps=7 dt=0.1"),
               Contains("-advect") && Contains("steps= has no effect beside dt="));
    CHECK_THAT(complaint("read a.obj\nmesh2ls dim=9\nscatter box=0,0,0,1,1,1\nkill box=0,0,0,1,1,1 grid=0"),
               Contains("-kill") && Contains("grid= has no effect"));
    CHECK_THAT(complaint("noise dim=2\ndfvn as=wind\nnoise dim=2\nslice width=8 as=plate\n"
                         "warp pattern=waves image=plate"),
               Contains("-warp") && Contains("image= has no effect"));
}

TEST_CASE("what is not there is named, with what makes it", "[app]") {
    CHECK_THAT(complaint("dfvn"), Contains("-dfvn") && Contains("a field") && Contains("none") && Contains("-noise"));
    CHECK_THAT(complaint("noise\ndfvn"), Contains("-dfvn") && Contains("-noise"));
    CHECK_THAT(complaint("advect"), Contains("-advect") && Contains("-scatter"));
    CHECK_THAT(complaint("mesh2ls"), Contains("-mesh2ls") && Contains("needs a mesh") && Contains("-read"));
    CHECK_THAT(complaint("noise\nbound"), Contains("-bound") && Contains("-sphere"));
}

TEST_CASE("a wall that no flow conforms to is a mistake", "[app]") {
    const auto line = [](const std::vector<std::string>& tokens) {
        return graphOfCommandLine(tokens, {.registry = registry()});
    };
    CHECK_NOTHROW(line({"-sphere", "-noise", "-noise", "-bound", "-dfvn"}));
    CHECK_NOTHROW(line({"-sphere", "-noise", "-bound", "-slice"})); // no flow at all
    CHECK_THROWS_WITH(line({"-noise", "-sphere", "-noise", "-bound", "-noise", "-noise", "-dfvn"}),
                      Contains("-bound") && Contains("do not see the wall") && Contains("-dfvn"));
}

// --- names

TEST_CASE("every input can be given by name", "[app]") {
    const std::string fields = "noise as=swirl\nnoise as=other\nsphere as=ball\nsphere radius=2 as=hull\n";
    CHECK(taken(fields + "bound noise=swirl wall=ball") == "noise=swirl wall=ball");
    CHECK(taken(fields + "dfvn f=swirl g=hull") == "f=swirl g=hull");
    CHECK(taken(fields + "dfvn f=hull") == "f=hull g=ball"); // the newest that is not named
    CHECK(taken(fields + "dfvn g=other") == "f=hull g=other");
    CHECK(taken(fields + "print what=ball,swirl") == "what=ball what=swirl");
    // Where an option for ages has the name of the input, or stands for it.
    const std::string grids = "noise\nnoise\ndfvn\nvelocity as=old\nvelocity as=new\n";
    CHECK(taken(grids + "write a.vdb what=old") == "what=old");
    CHECK(taken(grids + "advectGrid grid=old") == "flow=dfvn grid=old");
    CHECK(taken(grids + "advectGrid grid=1") == "flow=dfvn grid=old");
    CHECK(taken(fields + "bound field=swirl") == "noise=swirl wall=hull");
}

TEST_CASE("one result of several is named by its output", "[app]") {
    const std::string smoke = "noise\nnoise\ndfvn\nvelocity density=1 potentials=1 name=vel as=smoke\n";
    const Graph graph = graphOf(smoke);
    CHECK(graph.nodes.back().outputs.size() == 4);
    CHECK(taken(smoke + "write a.vdb what=smoke.density") == "what=smoke.density");
    CHECK(taken(smoke + "write a.vdb what=smoke") == taken(smoke + "write a.vdb what=smoke.velocity"));
    CHECK_THAT(complaint(smoke + "write a.vdb what=smoke.densty"),
               Contains("'smoke' has no output 'densty'") && Contains("did you mean 'density'") && Contains("it has "));
    const Graph trails = graphOf("noise\nnoise\ndfvn\nscatter\nadvect pathlines=1 as=dust\nwrite a.obj what=dust.curves");
    CHECK(lastInputs(trails) == "what=dust.curves");
    CHECK(trails.nodes[4].primaryOutput() == 0); // the points, which are always made
}

TEST_CASE("a name that does not exist is an error that knows a better one", "[app]") {
    CHECK_THAT(complaint("noise as=swirl\nnoise as=hull\ndfvn f=swril g=hull"),
               Contains("scene:3: -dfvn") && Contains("f=swril") && Contains("did you mean 'swirl'"));
    CHECK_THAT(complaint("noise as=swirl\ndfvn f=banana"), Contains("there is no 'banana'") && Contains("swirl"));
    CHECK_THAT(complaint("dfvn f=banana"), Contains("nothing has been made yet"));
    CHECK_THAT(complaint("noise as=swirl\ndfvn ff=swirl"), Contains("'ff'") && Contains("did you mean 'f'"));
}

TEST_CASE("an object that does not fit is named with what it is", "[app]") {
    CHECK_THAT(complaint("noise as=n\nsphere\nbound noise=n wall=n"),
               Contains("-bound") && Contains("wall= needs a shape or a level set, and 'n' is a field"));
    CHECK_THAT(complaint("sphere as=s\nscatter as=p\nadvect flow=s points=p"), Contains("flow= needs a flow"));
    CHECK_THAT(complaint("noise as=n\nnoise\ndfvn f=n,n"), Contains("f= takes 1, not 2"));
    CHECK_THAT(complaint("noise as=n\nwrite a.vdb what=n"),
               Contains("what= needs a grid") && Contains("'n' is a field"));
}

TEST_CASE("names are letters and digits, and unique", "[app]") {
    for (const char* name : {"a", "wind-2", "_x", "A1"}) {
        CAPTURE(name);
        CHECK(isNodeName(name));
        CHECK(taken(fmt::format("noise as={0}\nnoise\nslice what={0}", name)) == fmt::format("what={}", name));
    }
    for (const char* name : {"", "1a", "-a", "a b", "a.b", "a,b", "a=b", "none", "{F}"}) {
        CAPTURE(name);
        CHECK_FALSE(isNodeName(name));
        CHECK_THAT(complaint(fmt::format("noise 'as={}'", name)), Contains("-noise") && Contains("is not a name"));
    }
    CHECK_THAT(complaint("noise as=a\nsphere as=a"), Contains("as=a: there is a 'a' already") && Contains("another"));
    CHECK_THAT(complaint("noise as=a as=b"), Contains("as= is given twice"));
    CHECK_THAT(complaint("sphere\nprint as=a"), Contains("-print: as=a") && Contains("makes nothing"));
    const Graph graph = graphOf("noise\nnoise\nnoise as=noise_4");
    CHECK(graph.nodes[0].name == "noise");
    CHECK(graph.nodes[1].name == "noise_2");
    CHECK(unusedName(graph, "noise") == "noise_3");
    CHECK(unusedName(graph, "wind") == "wind");
}

TEST_CASE("a name stays with an object that is changed", "[app]") {
    const std::string dust = "noise\nnoise\ndfvn as=wind\nscatter as=dust\n";
    CHECK(taken(dust + "advect\nwrite a.ply what=dust") == "what=advect");
    CHECK(taken(dust + "advect points=dust\nadvect points=dust\nwrite a.ply what=dust") == "what=advect_2");
    CHECK(taken(dust + "advect as=moved\nwrite a.ply what=dust") == "what=moved"); // both are names of it
    // With keep=1 the action makes another object, and the name is that of the old one.
    CHECK(taken(dust + "advect keep=1 as=moved\nwrite a.ply what=dust") == "what=dust");
    CHECK(taken(dust + "advect keep=1 as=moved\nwrite a.ply") == "what=moved");
    // Names of what is taken, which is not changed, stay too.
    CHECK(taken("noise as=n\nsphere\nbound as=g\nslice what=n") == "what=n");
}

TEST_CASE("none takes nothing, where that is possible", "[app]") {
    const std::string flow = "noise\nnoise\ndfvn\nscatter as=dust\nframes 1-4\n";
    CHECK_THAT(taken(flow + "emit"), Contains("points=dust_before"));
    CHECK_THAT(taken(flow + "emit points=none"), Contains("points=emit_before"));
    CHECK_THAT(complaint("noise\nnoise\ndfvn\nscatter\nadvect points=none"),
               Contains("-advect") && Contains("'points'") && Contains("it needs points"));
    CHECK(taken("sphere\nscatter box=0,0,0,1,1,1 domain=none").empty());
}

TEST_CASE("the name of a link is read back as the same link", "[app]") {
    const Graph graph = graphOf(
        "sphere\nnoise\nnoise\nbound as=wall\ndfvn\nscatter\nframes 1-2\nemit rate=3\nadvect pathlines=1\n"
        "velocity dim=4 density=1");
    size_t links = 0;
    for (const Node& node : graph.nodes)
        for (const auto& input : node.inputs)
            for (const Link& link : input) {
                CAPTURE(nameOf(graph, link));
                CHECK(linkOf(graph, nameOf(graph, link)) == link);
                ++links;
            }
    CHECK(links > 8);
    for (size_t k = 0; k < graph.nodes.size(); ++k)
        for (size_t o = 0; o < graph.nodes[k].outputs.size(); ++o)
            CHECK(linkOf(graph, nameOf(graph, {.index = k, .output = o})) == Link{.index = k, .output = o});
    CHECK(graph.find("wall") == 3);
    CHECK_FALSE(graph.find("walls"));
}

TEST_CASE("a location is a context for messages", "[app]") {
    CHECK(contextOf({.action = "bound"}) == "-bound");
    CHECK(contextOf({.action = "bound", .node = "hull"}) == "-bound 'hull'");
    CHECK(contextOf({.action = "bound", .node = "bound"}) == "-bound");
    CHECK(contextOf({.line = 3, .file = "scene.txt:3", .action = "bound"}) == "scene.txt:3: -bound");
}

// --- objects that are there before

TEST_CASE("a program can take objects that an earlier one has left", "[app]") {
    const std::vector<Given> given{{{.kind = Kind::noise}, "swirl"}, {{.kind = Kind::noise}, ""}};
    const Reading reading{.registry = registry(), .given = given};
    const Graph graph = graphOfScene("dfvn", "scene", reading);
    CHECK(graph.nodes[0].inputs[0] == std::vector{Link{.from = Link::From::given, .index = 0}});
    CHECK(graph.nodes[0].inputs[1] == std::vector{Link{.from = Link::From::given, .index = 1}});
    const Graph named = graphOfScene("noise\ndfvn g=swirl", "scene", reading);
    CHECK(named.nodes[1].inputs[1] == std::vector{Link{.from = Link::From::given, .index = 0}});
    CHECK(lastInputs(named) == "f=noise g=swirl");
    CHECK_THROWS_WITH(graphOfScene("dfvn g=swril", "scene", reading), Contains("did you mean 'swirl'"));
}

// --- frames

TEST_CASE("points on the stack at -frames become states, others do not", "[app]") {
    const Graph graph = graphOf("noise\nnoise\ndfvn\nscatter as=dust\nframes 1-4\nadvect\nwrite 'a.$F.ply'");
    CHECK(graph.frames == 4);
    CHECK_FALSE(graph.inFrames(3));
    CHECK(graph.inFrames(4));
    REQUIRE(graph.states.size() == 1);
    CHECK(graph.states[0].initial == Link{.index = 3});
    CHECK(graph.states[0].next == Link{.index = 4});
    CHECK(graph.nodes[4].inputs[1] == std::vector{Link{.from = Link::From::state, .index = 0}});
    CHECK(graph.nodes[4].inputs[0] == std::vector{Link{.index = 2}}); // a flow is what it is
    CHECK(lastInputs(graph) == "what=advect");
    // What nothing moves stays what it is.
    const Graph still = graphOf("sphere\nscatter\nframes 1-4\nnoise");
    REQUIRE(still.states.size() == 1);
    CHECK(still.states[0].next == Link{.from = Link::From::state, .index = 0});
    CHECK_THAT(complaint("frames 1-2\nnoise\nframes 1-2\nnoise"), Contains("scene:3: -frames") && Contains("twice"));
}

TEST_CASE("what is emitted first in frames is a state of its own", "[app]") {
    const Graph graph = graphOf("frames 1-4\nsphere as=left\nemit\nsphere as=right\nemit");
    REQUIRE(graph.states.size() == 1); // the second emitter adds to the same points
    CHECK_FALSE(graph.states[0].initial);
    CHECK(graph.states[0].next == Link{.index = 3});
    CHECK(graph.nodes[3].inputs[1] == std::vector{Link{.index = 1}});
    const Graph apart = graphOf("frames 1-4\nsphere\nemit as=a\nemit points=none as=b");
    REQUIRE(apart.states.size() == 2);
    CHECK(apart.states[0].next == Link{.index = 1});
    CHECK(apart.states[1].next == Link{.index = 2});
}
