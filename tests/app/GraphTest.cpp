// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/actions/Actions.h"
#include "curlew/app/language/Program.h"
#include "curlew/base/Error.h"
#include "support/Catch.h"

#include <fmt/format.h>

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::ContainsSubstring;

namespace {

/// Builds the graph without running it: the inputs of an action are known before.
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

/// Returns the inputs of the last node, for example "f=swirl g=noise_2".
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

// --- default inputs

TEST_CASE("Graph: an action takes the newest suitable object", "[app]") {
    CHECK(taken("noise\nnoise\nnoise\ndfvn") == "f=noise_2 g=noise_3");
    CHECK(taken("noise\nnoise\nsphere\nbound") == "noise=noise_2 wall=sphere"); // a shape is not a noise
    CHECK(taken("sphere\nnoise\nnoise\ndfvn\nscatter\nadvect") == "flow=dfvn points=scatter");
    CHECK(taken("noise\nnoise\ndfvn\nsphere\nscatter") == "domain=sphere"); // the newest of all kinds that fit
    CHECK(taken("sphere\nnoise\nnoise\ndfvn\nscatter") == "domain=dfvn");
    CHECK(taken("noise\nnoise\nnoise\ncurl") == "x=noise y=noise_2 z=noise_3");
    CHECK(taken("noise dimensions=2\ndfvn") == "f=noise");
    CHECK(taken("noise\nnoise\nnoise type=simplex dimensions=4\nnoise type=simplex dimensions=4\nnoise type=simplex "
                "dimensions=4\ndfvn") == "f=noise_3 g=noise_4 more=noise_5");
    // If both a shape and a level set exist, the newer one is the wall.
    const std::string mesh = "read a.obj\n";
    CHECK(taken(mesh + "mesh2ls dim=16\nsphere\nnoise\nbound") == "noise=noise wall=sphere");
    CHECK(taken("sphere\n" + mesh + "mesh2ls dim=16\nnoise\nbound") == "noise=noise wall=mesh2ls");
}

TEST_CASE("Graph: a taken object is removed unless keep=1", "[app]") {
    CHECK(taken("noise as=a\nnoise as=b\nnoise as=c\nsum\nsum") == "first=a second=sum");
    CHECK(taken("noise as=a\nnoise as=b\nnoise as=c\nsum keep=1\nsum") == "first=c second=sum");
    CHECK(taken("noise\nnoise\ndfvn\nvelocity\nvelocity") == "flow=dfvn"); // a flow is not consumed
}

TEST_CASE("Graph: ages select older objects", "[app]") {
    const std::string grids = "noise\nnoise\ndfvn\nvelocity as=old\nvelocity as=new\n";
    CHECK(taken(grids + "write a.vdb") == "what=new");
    CHECK(taken(grids + "write a.vdb grid=1") == "what=old");
    CHECK(taken(grids + "write a.vdb grid=0,1") == "what=new what=old");
    CHECK(taken(grids + "write a.vdb grid=1,0") == "what=old what=new");
    CHECK(taken("noise as=a\nnoise as=b\nsphere\nbound field=2") == "noise=a wall=sphere"); // a sphere is also a field
}

TEST_CASE("Graph: a non-existent age is an error before anything is computed", "[app]") {
    const std::string grid = "noise\nnoise\ndfvn\nvelocity\n";
    CHECK_THAT(complaint(grid + "write a.vdb grid=1"), ContainsSubstring("scene:5: -write: grid=1") &&
                                                           ContainsSubstring("no grid of age 1") &&
                                                           ContainsSubstring("there is 1"));
    CHECK_THAT(complaint("noise\nwrite a.vdb grid=0"), ContainsSubstring("grid=0: there is no grid yet"));
    CHECK_THAT(complaint(grid + "velocity\nwrite a.vdb grid=0,2"),
               ContainsSubstring("grid=2") && ContainsSubstring("there are 2"));
    CHECK_THAT(complaint("sphere\nnoise\nbound field=2"),
               ContainsSubstring("no field of age 2") && ContainsSubstring("there are 2"));
    CHECK_THAT(complaint("noise\nslice width=8\ncompare"), ContainsSubstring("-compare") && ContainsSubstring("image"));
    CHECK_THAT(complaint("scatter box=0,0,0,1,1,1\ndistance geo=0,1"), ContainsSubstring("geo=1"));
    CHECK_THAT(complaint("scatter box=0,0,0,1,1,1\ndistance geo=-1"),
               ContainsSubstring("geo=-1") && ContainsSubstring("0 the newest"));
}

TEST_CASE("Graph: an option without effect beside another one is an error", "[app]") {
    CHECK_THAT(complaint("noise\nnoise\ndfvn\nscatter\nadvect steps=7 dt=0.1"),
               ContainsSubstring("-advect") && ContainsSubstring("steps= has no effect if dt= is given"));
    CHECK_THAT(complaint("read a.obj\nmesh2ls dim=9\nscatter box=0,0,0,1,1,1\nkill box=0,0,0,1,1,1 grid=0"),
               ContainsSubstring("-kill") && ContainsSubstring("grid= has no effect"));
    CHECK_THAT(complaint("noise dimensions=2\ndfvn as=wind\nnoise dimensions=2\nslice width=8 as=plate\n"
                         "warp pattern=waves image=plate"),
               ContainsSubstring("-warp") && ContainsSubstring("image= has no effect"));
}

TEST_CASE("Graph: a missing input is reported with the action that makes it", "[app]") {
    CHECK_THAT(complaint("dfvn"), ContainsSubstring("-dfvn") && ContainsSubstring("a field") &&
                                      ContainsSubstring("none") && ContainsSubstring("-noise"));
    CHECK_THAT(complaint("noise\ndfvn"), ContainsSubstring("-dfvn") && ContainsSubstring("-noise"));
    CHECK_THAT(complaint("advect"), ContainsSubstring("-advect") && ContainsSubstring("-scatter"));
    CHECK_THAT(complaint("mesh2ls"),
               ContainsSubstring("-mesh2ls") && ContainsSubstring("needs a mesh") && ContainsSubstring("-read"));
    CHECK_THAT(complaint("noise\nbound"), ContainsSubstring("-bound") && ContainsSubstring("-sphere"));
}

TEST_CASE("Graph: a wall that no flow conforms to is an error", "[app]") {
    const auto line = [](const std::vector<std::string>& tokens) {
        return graphOfCommandLine(tokens, {.registry = registry()});
    };
    CHECK_NOTHROW(line({"-sphere", "-noise", "-noise", "-bound", "-dfvn"}));
    CHECK_NOTHROW(line({"-sphere", "-noise", "-bound", "-slice"})); // no flow was made
    CHECK_THROWS_WITH(
        line({"-noise", "-sphere", "-noise", "-bound", "-noise", "-noise", "-dfvn"}),
        ContainsSubstring("-bound") && ContainsSubstring("no flow conforms to the wall") && ContainsSubstring("-dfvn"));
}

// --- names

TEST_CASE("Graph: every input can be given by name", "[app]") {
    const std::string fields = "noise as=swirl\nnoise as=other\nsphere as=ball\nsphere radius=2 as=hull\n";
    CHECK(taken(fields + "bound noise=swirl wall=ball") == "noise=swirl wall=ball");
    CHECK(taken(fields + "dfvn f=swirl g=hull") == "f=swirl g=hull");
    CHECK(taken(fields + "dfvn f=hull") == "f=hull g=ball"); // the newest object that is not named
    CHECK(taken(fields + "dfvn g=other") == "f=hull g=other");
    CHECK(taken(fields + "print what=ball,swirl") == "what=ball what=swirl");
    // An option of ages can have the name of the input, or another one.
    const std::string grids = "noise\nnoise\ndfvn\nvelocity as=old\nvelocity as=new\n";
    CHECK(taken(grids + "write a.vdb what=old") == "what=old");
    CHECK(taken(grids + "advectGrid grid=old") == "flow=dfvn grid=old");
    CHECK(taken(grids + "advectGrid grid=1") == "flow=dfvn grid=old");
    CHECK(taken(fields + "bound field=swirl") == "noise=swirl wall=hull");
}

TEST_CASE("Graph: one of several results is selected by its output name", "[app]") {
    const std::string smoke = "noise\nnoise\ndfvn\nvelocity density=1 potentials=1 name=vel as=smoke\n";
    const Graph graph = graphOf(smoke);
    CHECK(graph.nodes.back().outputs.size() == 4);
    CHECK(taken(smoke + "write a.vdb what=smoke.density") == "what=smoke.density");
    CHECK(taken(smoke + "write a.vdb what=smoke") == taken(smoke + "write a.vdb what=smoke.velocity"));
    CHECK_THAT(complaint(smoke + "write a.vdb what=smoke.densty"),
               ContainsSubstring("'smoke' has no output 'densty'") && ContainsSubstring("did you mean 'density'") &&
                   ContainsSubstring("it has "));
    const Graph trails =
        graphOf("noise\nnoise\ndfvn\nscatter\nadvect pathlines=1 as=dust\nwrite a.obj what=dust.curves");
    CHECK(lastInputs(trails) == "what=dust.curves");
    CHECK(trails.nodes[4].primaryOutput() == 0); // the points, which always exist
}

TEST_CASE("Graph: an unknown name is an error with a suggestion", "[app]") {
    CHECK_THAT(complaint("noise as=swirl\nnoise as=hull\ndfvn f=swril g=hull"),
               ContainsSubstring("scene:3: -dfvn") && ContainsSubstring("f=swril") &&
                   ContainsSubstring("did you mean 'swirl'"));
    CHECK_THAT(complaint("noise as=swirl\ndfvn f=banana"),
               ContainsSubstring("there is no 'banana'") && ContainsSubstring("swirl"));
    CHECK_THAT(complaint("dfvn f=banana"), ContainsSubstring("nothing has been made yet"));
    CHECK_THAT(complaint("noise as=swirl\ndfvn ff=swirl"),
               ContainsSubstring("'ff'") && ContainsSubstring("did you mean 'f'"));
}

TEST_CASE("Graph: an unsuitable object is reported with its kind", "[app]") {
    CHECK_THAT(
        complaint("noise as=n\nsphere\nbound noise=n wall=n"),
        ContainsSubstring("-bound") && ContainsSubstring("wall= needs a shape or a level set, but 'n' is a field"));
    CHECK_THAT(complaint("sphere as=s\nscatter as=p\nadvect flow=s points=p"), ContainsSubstring("flow= needs a flow"));
    CHECK_THAT(complaint("noise as=n\nnoise\ndfvn f=n,n"), ContainsSubstring("f= takes 1, not 2"));
    CHECK_THAT(complaint("noise as=n\nwrite a.vdb what=n"),
               ContainsSubstring("what= needs a grid") && ContainsSubstring("'n' is a field"));
}

TEST_CASE("Graph: names are letters and digits and unique", "[app]") {
    for (const char* name : {"a", "wind-2", "_x", "A1"}) {
        CAPTURE(name);
        CHECK(isNodeName(name));
        CHECK(taken(fmt::format("noise as={0}\nnoise\nslice what={0}", name)) == fmt::format("what={}", name));
    }
    for (const char* name : {"", "1a", "-a", "a b", "a.b", "a,b", "a=b", "none", "{F}"}) {
        CAPTURE(name);
        CHECK_FALSE(isNodeName(name));
        CHECK_THAT(complaint(fmt::format("noise 'as={}'", name)),
                   ContainsSubstring("-noise") && ContainsSubstring("is not a valid name"));
    }
    CHECK_THAT(complaint("noise as=a\nsphere as=a"),
               ContainsSubstring("as=a: there is already a 'a'") && ContainsSubstring("another"));
    CHECK_THAT(complaint("noise as=a as=b"), ContainsSubstring("as= is given twice"));
    CHECK_THAT(complaint("sphere\nprint as=a"),
               ContainsSubstring("-print: as=a") && ContainsSubstring("makes no object"));
    const Graph graph = graphOf("noise\nnoise\nnoise as=noise_4");
    CHECK(graph.nodes[0].name == "noise");
    CHECK(graph.nodes[1].name == "noise_2");
    CHECK(unusedName(graph, "noise") == "noise_3");
    CHECK(unusedName(graph, "wind") == "wind");
    CHECK(unusedName(graphOf("noise\nnoise as=noise_3\nnoise as=noise_b\nnoise as=noises"), "noise") == "noise_2");
}

TEST_CASE("Graph: a name stays with an object that is changed", "[app]") {
    const std::string dust = "noise\nnoise\ndfvn as=wind\nscatter as=dust\n";
    CHECK(taken(dust + "advect\nwrite a.ply what=dust") == "what=advect");
    CHECK(taken(dust + "advect points=dust\nadvect points=dust\nwrite a.ply what=dust") == "what=advect_2");
    CHECK(taken(dust + "advect as=moved\nwrite a.ply what=dust") == "what=moved"); // both names denote it
    // With keep=1 the action makes another object, and the name stays with the old one.
    CHECK(taken(dust + "advect keep=1 as=moved\nwrite a.ply what=dust") == "what=dust");
    CHECK(taken(dust + "advect keep=1 as=moved\nwrite a.ply") == "what=moved");
    // Objects that are consumed but not changed keep their names, too.
    CHECK(taken("noise as=n\nsphere\nbound as=g\nslice what=n") == "what=n");
}

TEST_CASE("Graph: the name none leaves an optional input empty", "[app]") {
    const std::string flow = "noise\nnoise\ndfvn\nscatter as=dust\nframes 1-4\n";
    CHECK_THAT(taken(flow + "emit"), ContainsSubstring("points=dust_before"));
    CHECK_THAT(taken(flow + "emit points=none"), ContainsSubstring("points=emit_before"));
    CHECK_THAT(complaint("noise\nnoise\ndfvn\nscatter\nadvect points=none"),
               ContainsSubstring("-advect") && ContainsSubstring("'points'") && ContainsSubstring("it needs points"));
    CHECK(taken("sphere\nscatter box=0,0,0,1,1,1 domain=none").empty());
}

TEST_CASE("Graph: nameOf and linkOf are inverse", "[app]") {
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

TEST_CASE("contextOf: formats a source location for messages", "[app]") {
    CHECK(contextOf({.action = "bound"}) == "-bound");
    CHECK(contextOf({.action = "bound", .node = "hull"}) == "-bound 'hull'");
    CHECK(contextOf({.action = "bound", .node = "bound"}) == "-bound");
    CHECK(contextOf({.line = 3, .file = "scene.txt:3", .action = "bound"}) == "scene.txt:3: -bound");
}

// --- existing objects

TEST_CASE("Graph: a program can take objects left by an earlier one", "[app]") {
    const std::vector<Given> given{{{.kind = Kind::noise}, "swirl"}, {{.kind = Kind::noise}, ""}};
    const Reading reading{.registry = registry(), .given = given};
    const Graph graph = graphOfScene("dfvn", "scene", reading);
    CHECK(graph.nodes[0].inputs[0] == std::vector{Link{.from = Link::From::given, .index = 0}});
    CHECK(graph.nodes[0].inputs[1] == std::vector{Link{.from = Link::From::given, .index = 1}});
    const Graph named = graphOfScene("noise\ndfvn g=swirl", "scene", reading);
    CHECK(named.nodes[1].inputs[1] == std::vector{Link{.from = Link::From::given, .index = 0}});
    CHECK(lastInputs(named) == "f=noise g=swirl");
    CHECK_THROWS_WITH(graphOfScene("dfvn g=swril", "scene", reading), ContainsSubstring("did you mean 'swirl'"));
}

// --- frames

TEST_CASE("Graph: points on the stack before the frames become states", "[app]") {
    const Graph graph = graphOf("noise\nnoise\ndfvn\nscatter as=dust\nframes 1-4\nadvect\nwrite 'a.$F.ply'");
    CHECK(graph.frames == 4);
    CHECK_FALSE(graph.inFrames(3));
    CHECK(graph.inFrames(4));
    REQUIRE(graph.states.size() == 1);
    CHECK(graph.states[0].initial == Link{.index = 3});
    CHECK(graph.states[0].next == Link{.index = 4});
    CHECK(graph.nodes[4].inputs[1] == std::vector{Link{.from = Link::From::state, .index = 0}});
    CHECK(graph.nodes[4].inputs[0] == std::vector{Link{.index = 2}}); // a flow is linked directly
    CHECK(lastInputs(graph) == "what=advect");
    // Points that no action moves keep their value.
    const Graph still = graphOf("sphere\nscatter\nframes 1-4\nnoise");
    REQUIRE(still.states.size() == 1);
    CHECK(still.states[0].next == Link{.from = Link::From::state, .index = 0});
    CHECK_THAT(complaint("frames 1-2\nnoise\nframes 1-2\nnoise"),
               ContainsSubstring("scene:3: -frames") && ContainsSubstring("twice"));
}

TEST_CASE("Graph: points first emitted in frames are a state of their own", "[app]") {
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
