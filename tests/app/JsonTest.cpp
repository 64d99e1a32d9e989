// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/actions/Actions.h"
#include "curlew/app/language/Program.h"
#include "support/Catch.h"
#include "support/Samples.h"
#include "support/SessionCommand.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::ContainsSubstring;
using test::Scenes;

namespace {

const Reading& lenient() {
    static const Reading reading{.registry = registry(), .world = {.lenient = true}};
    return reading;
}

Graph graphOf(const std::string& json) { return graphOfJson(json, lenient()); }

std::string complaint(const std::string& json) {
    try {
        graphOf(json);
    } catch (const ValueError& e) {
        return e.what();
    }
    return "nothing is wrong with " + json;
}

/// Returns a document with these nodes and other members such as `,"frames": …`.
std::string document(const std::string& nodes, const std::string& others = "") {
    return "{\"curlew\": 1, \"nodes\": [" + nodes + "]" + others + "}";
}

/// Two noises and a flow.
const std::string kFlow =
    R"({"name": "f", "action": "noise"}, {"name": "g", "action": "noise", "options": {"seed": 1}},
       {"name": "wind", "action": "dfvn", "inputs": {"f": ["f"], "g": ["g"]}})";
const std::string kDust =
    kFlow + R"(, {"name": "seeds", "action": "scatter", "options": {"count": 20}, "inputs": {"domain": ["wind"]}})";
const std::string kThreeFrames = R"(, "frames": {"words": ["1-3"], "options": {"fps": 10}})";

std::vector<std::string> namesOf(const Graph& graph) {
    std::vector<std::string> names;
    for (const Node& node : graph.nodes) names.push_back(node.name);
    return names;
}

} // namespace

TEST_CASE("JSON: a former name of an option becomes the current one", "[app]") {
    const Graph graph = graphOf(document(
        R"({"name": "n", "action": "noise", "options": {"dim": 3, "grid": "perlin", "offset": [1, 2, 3]}},
           {"name": "ball", "action": "sphere"},
           {"action": "bound", "options": {"width": 0.2}, "inputs": {"noise": ["n"], "wall": ["ball"]}})"));
    CHECK(graph.nodes[0].arguments.program() == "-noise dimensions=3 lattice=perlin translate=1,2,3");
    CHECK(graph.nodes[2].arguments.real("layer") == 0.2);
}

TEST_CASE("JSON: nodes have names and actions and words and options and links", "[app]") {
    const Graph graph = graphOf(document(
        R"({"name": "hull", "action": "sphere", "options": {"radius": 0.5, "translate": [1, 2.5, -3]}},
           {"name": "f", "action": "noise", "options": {"seed": 7, "normalize": false}},
           {"action": "noise", "options": {"frequency": "{1+1}"}},
           {"name": "my wall", "action": "bound", "inputs": {"noise": "noise", "wall": ["hull"]}},
           {"name": "wind", "action": "dfvn", "inputs": {"f": ["f"], "g": ["my wall"]}},
           {"name": "smoke", "action": "velocity", "options": {"density": true}, "inputs": {"flow": ["wind"]}},
           {"action": "write", "words": ["a b.vdb"], "inputs": {"what": ["smoke", "smoke.density"]}})"));
    CHECK(namesOf(graph) == std::vector<std::string>{"hull", "f", "noise", "my wall", "wind", "smoke", "write"});
    CHECK(graph.nodes[0].arguments.real("radius") == 0.5);
    CHECK(graph.nodes[0].arguments.vector("translate") == Vec3d{{1, 2.5, -3}});
    CHECK(graph.nodes[1].arguments.integer("seed") == 7);
    CHECK_FALSE(graph.nodes[1].arguments.flag("normalize"));
    CHECK(graph.nodes[2].arguments.real("frequency") == 2);
    CHECK(graph.nodes[3].inputs[1] == std::vector{Link{.index = 0}});
    CHECK(graph.nodes[4].inputs[1] == std::vector{Link{.index = 3}});
    CHECK(graph.nodes[6].arguments.words() == std::vector<std::string>{"a b.vdb"});
    REQUIRE(graph.nodes[6].inputs[0].size() == 2);
    CHECK(graph.nodes[6].inputs[0][1] == Link{.index = 5, .output = 0});
    CHECK(graph.objectOf(graph.nodes[6].inputs[0][0]).kind == Kind::velocity);
    CHECK(graphOf("{}").nodes.empty());
}

TEST_CASE("JSON: nodes may come in any order", "[app]") {
    const Graph graph = graphOf(document(
        R"({"name": "wind", "action": "dfvn", "inputs": {"f": ["f"], "g": ["g"]}}, {"name": "g", "action": "noise"},
           {"name": "f", "action": "noise"}, {"action": "quiet"})"));
    CHECK(namesOf(graph) == std::vector<std::string>{"quiet", "f", "g", "wind"}); // settings first
}

TEST_CASE("JSON: a written graph is read as the same graph", "[app]") {
    const std::string scenes[] = {
        "",
        "noise alpha={T} seed={F}\nnoise\ndfvn speed=1\nvelocity density=1 dim=8\nwrite 'it is.vdb' grid=0,1 half=1",
        "sphere as=ball\nnoise\nnoise\nbound wall=ball\ndfvn as=wind\nscatter as=dust\nadvect keep=1\nadvect flow=wind "
        "points=dust",
        "quiet\nsphere\nnoise\nnoise\ndfvn\nscatter\nframes 1-9x2 fps=10 checkpoint=a.ckpt\nadvect\nsphere "
        "translate={T},0,0\n"
        "emit rate=9\nwrite 'a.$F4.ply' b.vdb geo=0\nresume",
        "noise dimensions=2\nslice width=8\nslice width=8\npanels labels='a|b'\nwrite a.png b.exr"};
    for (const auto& scene : scenes) {
        CAPTURE(scene);
        const std::string json = jsonOf(graphOfScene(scene, "scene", lenient()));
        CHECK(jsonOf(graphOf(json)) == json);
    }
    const std::string wanted = document(kDust, R"(, "wanted": ["wind"], "effects": false)");
    CHECK(jsonOf(graphOf(jsonOf(graphOf(wanted)))) == jsonOf(graphOf(wanted)));
    CHECK_THAT(jsonOf(graphOf(wanted)), ContainsSubstring("wanted") && ContainsSubstring("\"effects\": false"));
}

TEST_CASE("JSON: time-dependent nodes are evaluated in each frame and others once unless when is given", "[app]") {
    const auto inFrames = [](const std::string& nodes, const std::string& name) {
        const Graph graph = graphOf(document(nodes, kThreeFrames));
        REQUIRE(graph.find(name));
        return graph.inFrames(*graph.find(name));
    };
    const std::string still = R"({"action": "noise"})", moving = R"({"action": "noise", "options": {"alpha": "{T}"}})";
    CHECK_FALSE(inFrames(still, "noise"));
    CHECK(inFrames(moving, "noise"));
    CHECK(inFrames(moving + R"(, {"action": "slice", "inputs": {"what": ["noise"]}})", "slice"));
    CHECK_FALSE(inFrames(still + R"(, {"action": "slice", "inputs": {"what": ["noise"]}})", "slice"));
    CHECK(inFrames(R"({"action": "noise", "when": "frame"})", "noise"));
    CHECK_FALSE(inFrames(R"({"action": "noise", "options": {"alpha": "{T}"}, "when": "once"})", "noise"));
    CHECK(inFrames(kDust + R"(, {"action": "advect", "inputs": {"flow": ["wind"], "points": ["seeds"]}})", "advect"));
    CHECK_FALSE(inFrames(kDust, "seeds"));
    CHECK(inFrames(still + R"(, {"action": "report", "words": ["a.$F.json"]})", "report")); // one file per frame
    CHECK_THAT(
        complaint(document(R"({"action": "noise", "when": "often"})")),
        ContainsSubstring("-noise") && ContainsSubstring("\"when\" is 'often'") && ContainsSubstring("once or frame"));
}

TEST_CASE("JSON: a node evaluated once uses the first frame of time-dependent inputs", "[app]") {
    // The points exist from the first frame on, while the shape that they fill keeps moving.
    const Graph graph = graphOf(document(R"({"name": "ball", "action": "sphere", "options": {"translate": "{T},0,0"}},
        {"name": "seeds", "action": "scatter", "inputs": {"domain": ["ball"]}},
        {"name": "picture", "action": "slice", "inputs": {"what": ["ball"]}})",
                                         kThreeFrames));
    REQUIRE(graph.find("seeds"));
    CHECK_FALSE(graph.inFrames(*graph.find("seeds")));
    REQUIRE(graph.find("ball"));
    CHECK(graph.inFrames(*graph.find("ball")));
    const Link domain = graph.nodes[*graph.find("seeds")].inputs[0].at(0);
    CHECK_FALSE(graph.inFrames(domain.index));
    CHECK(graph.nodes[domain.index].arguments.vector("translate") == Vec3d{});
    CHECK_THAT(complaint(document(kDust + R"(, {"name": "dust", "action": "advect",
                                                "inputs": {"flow": ["wind"], "points": ["seeds"]}},
        {"name": "late", "action": "snap", "options": {"iso": 0}, "when": "once",
         "inputs": {"field": ["f"], "points": ["dust"]}})",
                                  kThreeFrames)),
               ContainsSubstring("'dust'") && ContainsSubstring("advances with the frames"));
}

TEST_CASE("JSON: a moment evaluates expressions for a still", "[app]") {
    const Graph graph = graphOf(document(R"({"action": "noise", "options": {"seed": "{F}", "alpha": "{T*fps}"}},
        {"action": "report", "words": ["a.$F4.json"]})",
                                         R"(, "moment": {"frame": 12, "time": 0.5, "fps": 10})"));
    CHECK(graph.nodes[0].arguments.integer("seed") == 12);
    CHECK(graph.nodes[0].arguments.real("alpha") == 5);
    CHECK(graph.nodes[1].arguments.words() == std::vector<std::string>{"a.0012.json"});
    CHECK_THAT(complaint(document("", R"(, "moment": {"frame": 1})" + kThreeFrames)),
               ContainsSubstring("without frames"));
    CHECK_THAT(complaint(document("", R"(, "moment": {"frames": 1})")), ContainsSubstring("did you mean 'frame'"));
    CHECK_THAT(complaint(document("", R"(, "moment": {"time": "1"})")),
               ContainsSubstring("'time'") && ContainsSubstring("number"));
}

TEST_CASE("JSON: errors name the node and suggest a correction", "[app]") {
    CHECK_THAT(complaint(document(R"({"name": "n", "action": "nosie"})")),
               ContainsSubstring("'n'") && ContainsSubstring("did you mean 'noise'"));
    CHECK_THAT(complaint(document(R"({"name": "swirl", "action": "noise", "options": {"sede": 1}})")),
               ContainsSubstring("-noise 'swirl'") && ContainsSubstring("did you mean 'seed'"));
    CHECK_THAT(
        complaint(document(R"({"name": "swirl", "action": "noise", "options": {"seed": 0.5}})")),
        ContainsSubstring("-noise 'swirl'") && ContainsSubstring("seed=0.5") && ContainsSubstring("whole number"));
    CHECK_THAT(complaint(document(R"({"name": "swirl", "action": "noise", "inputs": {"f": []}})")),
               ContainsSubstring("-noise 'swirl'") && ContainsSubstring("no input 'f'"));
    CHECK_THAT(
        complaint(document(kFlow + R"(, {"name": "w", "action": "dfvn", "inputs": {"ff": ["f"]}})")),
        ContainsSubstring("-dfvn 'w'") && ContainsSubstring("no input 'ff'") && ContainsSubstring("did you mean 'f'"));
    CHECK_THAT(
        complaint(document(kFlow + R"(, {"name": "v", "action": "velocity", "inputs": {"flow": ["wnid"]}})")),
        ContainsSubstring("-velocity 'v'") && ContainsSubstring("'wnid'") && ContainsSubstring("did you mean 'wind'"));
    CHECK_THAT(complaint(document(kFlow + R"(, {"name": "v", "action": "velocity", "inputs": {"flow": ["wind.x"]}})")),
               ContainsSubstring("-velocity 'v'") && ContainsSubstring("'wind' has no output 'x'") &&
                   ContainsSubstring("flow"));
    CHECK_THAT(complaint(document(kFlow + R"(, {"name": "v", "action": "velocity", "inputs": {"flow": ["f"]}})")),
               ContainsSubstring("-velocity 'v'") && ContainsSubstring("flow= needs a flow, but 'f' is a field"));
    CHECK_THAT(complaint(document(R"({"name": "v", "action": "velocity"})")),
               ContainsSubstring("-velocity 'v'") && ContainsSubstring("nothing is connected to 'flow'") &&
                   ContainsSubstring("a flow"));
    CHECK_THAT(complaint(document(R"({"name": "a", "action": "noise"}, {"name": "a", "action": "sphere"})")),
               ContainsSubstring("two nodes have the name 'a'"));
    CHECK_THAT(complaint(document(R"({"action": "write"})")),
               ContainsSubstring("-write") && ContainsSubstring("needs FILE"));
    CHECK_THAT(complaint(document(kFlow + R"(, {"name": "out", "action": "write", "words": ["a.vdb"],
                                                "inputs": {"what": ["wind"]}})")),
               ContainsSubstring("-write 'out'"));
    CHECK_THAT(complaint(document(R"({"name": "n", "action": "noise"}, {"name": "s", "action": "slice",
        "inputs": {"what": ["n"]}}, {"name": "out", "action": "write", "words": ["a.vdb"],
        "inputs": {"what": ["s"]}})")),
               ContainsSubstring("-write 'out'") && ContainsSubstring("'a.vdb' cannot hold 's'") &&
                   ContainsSubstring("image"));
    SourceLocation location;
    CHECK_THROWS(graphOfJson(document(R"({"name": "swirl", "action": "noise", "options": {"seed": -1}})"),
                             {.registry = registry(), .location = &location}));
    CHECK(location.node == "swirl");
    CHECK(location.action == "noise");
}

TEST_CASE("JSON: an error beside the nodes is blamed on none of them", "[app]") {
    for (const char* beside :
         {R"(, "wanted": ["gone"])", R"(, "frames": {"words": ["1-2"]}, "states": [{"name": "s", "initial": "gone"}])",
          R"(, "frames": {"words": ["1-2"], "fps": 24})"}) {
        CAPTURE(beside);
        SourceLocation location;
        CHECK_THROWS(graphOfJson(document(R"({"name": "swirl", "action": "noise"})", beside),
                                 {.registry = registry(), .location = &location}));
        CHECK(location.node.empty());
    }
}

TEST_CASE("JSON: a file that cannot be read yet may hold any of its kinds", "[app]") {
    const auto reads = [](const std::string& file, const std::string& next) {
        return document(R"({"name": "r", "action": "read", "words": [")" + file + R"("]}, {"action": ")" + next);
    };
    const std::string rail = R"(rail", "inputs": {"curves": ["r"]}})",
                      level = R"(mesh2ls", "inputs": {"mesh": ["r"]}})";
    for (const char* file : {"later.ply", "later.obj"})
        for (const auto& next : {rail, level}) CHECK(graphOf(reads(file, next)).nodes.size() == 2);
    CHECK(graphOf(reads("later.csv", rail)).nodes.size() == 2);
    CHECK_THAT(complaint(reads("later.csv", level)), ContainsSubstring("mesh"));
    CHECK_THAT(complaint(reads("later.stl", rail)), ContainsSubstring("curves"));
}

TEST_CASE("JSON: unknown members are errors", "[app]") {
    CHECK_THAT(complaint(R"({"curlew": 1, "node": []})"),
               ContainsSubstring("the graph has no member 'node'") && ContainsSubstring("did you mean 'nodes'"));
    CHECK_THAT(complaint(document(R"({"action": "noise", "option": {}})")),
               ContainsSubstring("no member 'option'") && ContainsSubstring("did you mean 'options'"));
    CHECK_THAT(complaint(document("", R"(, "states": [{"nam": "a"}])")), ContainsSubstring("did you mean 'name'"));
    CHECK_THAT(complaint(document("", R"(, "states": [{"name": "s", "next": "a"}])")),
               ContainsSubstring("the graph has no 'frames'"));
    CHECK_THAT(complaint(document("", R"(, "frames": {"words": ["1-2"], "fps": 24})")),
               ContainsSubstring("'frames' has no member 'fps'"));
    CHECK_THAT(complaint(document("", R"(, "frames": {"words": ["1-2"], "options": {"fsp": 24}})")),
               ContainsSubstring("frames") && ContainsSubstring("did you mean 'fps'"));
    CHECK_THAT(complaint(R"({"curlew": 2})"), ContainsSubstring("version 2") && ContainsSubstring("version 1"));
    CHECK_THAT(complaint(document("7")), ContainsSubstring("a node must be an object"));
    for (const char* wrong : {R"({"nodes": {}})",
                              R"({"nodes": 1})",
                              R"({"nodes": [{"action": 7}]})",
                              R"({"nodes": [{"action": "noise", "options": []}]})",
                              R"({"nodes": [{"action": "noise", "options": {"seed": null}}]})",
                              R"({"nodes": [{"action": "noise", "options": {"seed": {}}}]})",
                              R"({"nodes": [{"action": "noise", "inputs": 7}]})",
                              R"({"nodes": [{"action": "noise", "name": ["a"], "words": 7}]})",
                              R"({"nodes": [{"action": "noise", "name": ""}]})",
                              R"({"states": 7})",
                              R"({"resume": "yes"})",
                              R"({"effects": 1.5})",
                              R"({"wanted": {}})",
                              R"({"wanted": ["x"]})",
                              R"({"frames": 7})",
                              R"({"frames": {}})",
                              "[]",
                              "{",
                              "{]",
                              "{\"a\": 1e}"}) {
        CAPTURE(wrong);
        CHECK_THROWS_AS(graphOf(wrong), ValueError);
    }
    CHECK_THAT(complaint("{\"nodes\": ["), ContainsSubstring("not a graph in JSON"));
    // Options for stacks have no meaning in a graph.
    for (const char* option : {"keep", "field", "grid"})
        CHECK_THAT(complaint(document(
                       fmt::format(R"({{"name": "wall", "action": "bound", "options": {{"{}": 1}}}})", option))),
                   ContainsSubstring("-bound 'wall'") && ContainsSubstring(option) && ContainsSubstring("links"));
    for (const char* action : {"frames", "config", "set", "resume"})
        CHECK_THAT(complaint(document(fmt::format(R"({{"action": "{}", "words": ["a=1"]}})", action))),
                   ContainsSubstring(action) && ContainsSubstring("not a node"));
}

TEST_CASE("JSON: cyclic links are an error", "[app]") {
    CHECK_THAT(complaint(document(
                   R"({"name": "a", "action": "clip", "inputs": {"field": ["b"]}},
                      {"name": "b", "action": "clip", "inputs": {"field": ["a"]}})")),
               ContainsSubstring("-clip '") && ContainsSubstring("form a cycle"));
    CHECK_THAT(complaint(document(R"({"name": "a", "action": "clip", "inputs": {"field": ["a"]}})")),
               ContainsSubstring("-clip 'a'") && ContainsSubstring("form a cycle"));
}

TEST_CASE("JSON: deep nesting and long chains do not crash", "[app]") {
    for (const size_t depth : {size_t{100}, size_t{200'000}}) {
        const std::string nested = std::string(depth, '[') + std::string(depth, ']');
        CHECK_THROWS_AS(graphOf("{\"nodes\": " + nested + "}"), ValueError);
        CHECK_THROWS_AS(graphOf(document(R"({"action": "noise", "options": {"seed": )" + nested + "}}")), ValueError);
        CHECK_THROWS_AS(graphOf(document(R"({"action": "noise", "name": )" + nested + "}")), ValueError);
    }
    CHECK_THROWS_AS(graphOf(std::string(200'000, '{')), ValueError);
    // Each node is linked to the next one.
    std::string chain;
    constexpr int kLength = 20'000;
    for (int k = 0; k < kLength; ++k)
        chain += fmt::format(R"({{"name": "n{}", "action": "clip", "inputs": {{"field": ["n{}"]}}}},)", k, k + 1);
    chain += fmt::format(R"({{"name": "n{}", "action": "noise"}})", kLength);
    const std::string found = complaint(document(chain));
    CHECK_THAT(found, ContainsSubstring("more than 500 deep"));
    CHECK(found.size() < 2000);
}

TEST_CASE("JSON: a graph gives the same points as the scene", "[app]") {
    Scenes scene, json;
    const std::string text =
        "sphere\nnoise\nnoise seed=1\nbound\ndfvn\nscatter count=50\nframes 1-3 fps=10\nadvect steps=2";
    scene.run(text);
    json.run(jsonOf(graphOfScene(text, "scene", lenient())));
    const Points a = test::pointsOf(scene.session), b = test::pointsOf(json.session);
    REQUIRE(a.size() == 50);
    CHECK(a.x == b.x);
    CHECK(a.f == b.f);
}

// --- states

TEST_CASE("JSON: points changed in frames are carried without a declared state", "[app]") {
    const std::string advected = kDust + R"(, {"name": "dust", "action": "advect",
                                               "inputs": {"flow": ["wind"], "points": ["seeds"]}})";
    const Graph graph = graphOf(document(advected, kThreeFrames));
    REQUIRE(graph.states.size() == 1);
    CHECK(nameOf(graph, *graph.states[0].initial) == "seeds");
    CHECK(nameOf(graph, graph.states[0].next) == "dust");
}

TEST_CASE("JSON: two emitters without links have separate points", "[app]") {
    const Graph graph = graphOf(document(R"({"name": "ball", "action": "sphere"},
        {"name": "a", "action": "emit", "inputs": {"domain": ["ball"]}},
        {"name": "b", "action": "emit", "options": {"rate": 10}, "inputs": {"domain": ["ball"]}})",
                                         kThreeFrames));
    REQUIRE(graph.states.size() == 2);
    CHECK(nameOf(graph, graph.states[0].next) == "a");
    CHECK(nameOf(graph, graph.states[1].next) == "b");
}

TEST_CASE("JSON: two nodes that change the same points in frames are refused", "[app]") {
    const std::string two = R"({"name": "ball", "action": "sphere"}, {"name": "wind", "action": "uniform"},
        {"name": "born", "action": "emit", "inputs": {"domain": ["ball"]}},
        {"name": "a", "action": "advect", "inputs": {"flow": ["wind"], "points": ["born"]}},
        {"name": "b", "action": "advect", "inputs": {"flow": ["wind"], "points": ["born"]}})";
    CHECK_THAT(complaint(document(two, kThreeFrames)),
               ContainsSubstring("-advect 'b'") && ContainsSubstring("'born'") && ContainsSubstring("its own points"));
    // Each node has its own copy of the points from before the frames and continues with its own result.
    const std::string apart =
        kDust + R"(, {"name": "a", "action": "advect", "inputs": {"flow": ["wind"], "points": ["seeds"]}},
        {"name": "b", "action": "advect", "options": {"steps": 2}, "inputs": {"flow": ["wind"], "points": ["seeds"]}})";
    const Graph graph = graphOf(document(apart, kThreeFrames));
    REQUIRE(graph.states.size() == 2);
    CHECK(graph.states[0].initial == graph.states[1].initial);
    CHECK(nameOf(graph, graph.states[1].next) == "b");
}
