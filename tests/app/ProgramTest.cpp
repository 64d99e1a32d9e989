// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/actions/Actions.h"
#include "curlew/app/language/Program.h"
#include "curlew/base/Error.h"
#include "support/Command.h"

#include <catch2/catch.hpp>

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::Contains;

namespace {

Graph graphOfLine(const std::vector<std::string>& tokens) {
    return graphOfCommandLine(tokens, {.registry = registry(), .world = {.lenient = true}});
}

Graph graphOfLines(const std::string& text, const std::string& name = "scene") {
    return graphOfScene(text, name, {.registry = registry(), .world = {.lenient = true}});
}

/// What is wrong with a scene.
template <class Thrown = ValueError>
std::string complaint(const std::string& text) {
    try {
        graphOfLines(text, "my.scene");
    } catch (const Thrown& e) {
        return e.what();
    }
    return "nothing";
}

} // namespace

TEST_CASE("a command line and a scene are the same graph", "[app]") {
    const Graph line = graphOfLine({"-sphere", "radius=0.5", "-noise", "seed=1", "freq=2", "-noise", "offset=-1,-2,-3",
                                    "-dfvn", "-velocity", "-velocity", "-write", "my file.vdb", "grid=0,1"});
    const Graph scene = graphOfLines(
        "# a scene\n"
        "sphere radius=0.5   # the wall\n"
        "\n"
        "-noise seed=1 \\\n"
        "   freq=2\r\n"
        "noise offset=-1,-2,-3\n"
        "dfvn\nvelocity\nvelocity\n"
        "  write 'my file.vdb' grid=0,1");
    REQUIRE(line.nodes.size() == 7);
    CHECK(jsonOf(line) == jsonOf(scene));
    CHECK(line.nodes[1].arguments.real("frequency") == 2);
    CHECK(line.nodes[6].arguments.words() == std::vector<std::string>{"my file.vdb"});
    // One dash or two.
    CHECK(jsonOf(graphOfLine({"--noise", "seed=1"})) == jsonOf(graphOfLine({"-noise", "seed=1"})));
    // A text that begins with { is JSON, another one a scene.
    const Reading reading{.registry = registry(), .world = {.lenient = true}};
    CHECK(jsonOf(graphOfText(" \n" + jsonOf(line), "x", reading)) == jsonOf(line));
    CHECK(jsonOf(graphOfText("noise", "x", reading)) == jsonOf(graphOfLines("noise")));
}

TEST_CASE("a number is never taken for an action", "[app]") {
    const Graph graph = graphOfLine({"-threads", "-1", "-noise", "seed=1"});
    REQUIRE(graph.nodes.size() == 2);
    CHECK(graph.nodes[0].arguments.words() == std::vector<std::string>{"-1"});
}

TEST_CASE("what is no action is named", "[app]") {
    CHECK_THROWS_WITH(graphOfLine({"spot.obj", "-mesh2ls"}), Contains("'spot.obj'") && Contains("dash"));
    CHECK_THROWS_WITH(graphOfLine({"-nosie"}), Contains("nosie") && Contains("'noise'"));
    CHECK_THROWS_WITH(graphOfLine({"-noise", "sede=1"}), Contains("-noise") && Contains("'seed'"));
    CHECK_THROWS_WITH(graphOfLine({"-noise", "seed=x"}), Contains("-noise") && Contains("seed=x"));
    CHECK_THROWS_WITH(graphOfLine({"-noise", "-write"}), Contains("-write") && Contains("needs FILE"));
    for (const char* token : {"", " ", "-", "=", "noise"}) {
        CAPTURE(token);
        CHECK_THROWS_AS(graphOfLine({token}), ValueError);
    }
}

TEST_CASE("an error in a scene names the file and the line on which its action begins", "[app]") {
    CHECK_THAT(complaint("noise\n\nnoise seed=x\n"),
               Contains("my.scene:3") && Contains("-noise") && Contains("seed=x"));
    CHECK_THAT(complaint("noise\n# a\nnosie"), Contains("my.scene:3") && Contains("'noise'"));
    CHECK_THAT(complaint("noise \\\n seed=1 \\\n freq=0\n"), Contains("my.scene:1") && Contains("frequency=0"));
    CHECK_THAT(complaint("noise\nreport 'a.json\n"), Contains("my.scene:2") && Contains("quote"));
    CHECK_THAT(complaint("noise\nnoise \\"), Contains("my.scene") && Contains("\\"));
    // What is not there to be taken, too.
    CHECK_THAT(complaint("noise\n\ndfvn"), Contains("my.scene:3: -dfvn"));
    CHECK_THAT(complaint("noise\nframes 1-2\nvelocity"), Contains("my.scene:3: -velocity"));
}

TEST_CASE("where a text is wrong is known by line and action", "[app]") {
    const auto placeOf = [](const std::string& text) {
        SourceLocation location;
        try {
            graphOfScene(text, "scene", {.registry = registry(), .location = &location});
        } catch (const Error&) {
            return std::pair(location.line, location.action);
        }
        return std::pair(-1, std::string("nothing is wrong"));
    };
    CHECK(placeOf("noise\n\n# comment\nnonsense") == std::pair(4, std::string("nonsense")));
    CHECK(placeOf("noise \\\n seed=1 \\\n frequency=0\nnoise") == std::pair(1, std::string("noise")));
    CHECK(placeOf("noise\nnoise \"") == std::pair(2, std::string()));
    CHECK(placeOf("noise\nset x=1\n\nvelocity\nnoise") == std::pair(4, std::string("velocity")));
    CHECK(placeOf("noise\nframes 1-2\nnoise\nvelocity") == std::pair(4, std::string("velocity")));
    CHECK(placeOf("noise\nframes 2-1\nnoise") == std::pair(2, std::string("frames")));
    // In a scene that another includes, that one's line counts.
    const test::Folder folder;
    test::store(folder / "inner.txt", "noise\nnoise\nnoise seed=x");
    CHECK(placeOf("sphere\nconfig \"" + (folder / "inner.txt").string() + "\"") == std::pair(2, std::string("noise")));
}

TEST_CASE("scenes can include scenes, but not for ever", "[app]") {
    const test::Folder folder;
    const auto config = [&](const std::string& name) {
        return graphOfLine({"-sphere", "-config", (folder / name).string(), "-dfvn"});
    };
    test::store(folder / "inner.txt", "noise seed=5\n");
    test::store(folder / "outer.txt",
                "noise seed=4\nconfig \"" + (folder / "inner.txt").string() + "\"\nnoise seed=6\n");
    const Graph graph = config("outer.txt");
    std::vector<int64_t> seeds;
    for (size_t k = 1; k + 1 < graph.nodes.size(); ++k) seeds.push_back(graph.nodes[k].arguments.integer("seed"));
    CHECK(seeds == std::vector<int64_t>{4, 5, 6});

    test::store(folder / "self.txt", "config \"" + (folder / "self.txt").string() + "\"\n");
    CHECK_THROWS_WITH(config("self.txt"), Contains("self.txt") && Contains("deep"));

    // Not deep, but 10 scenes each of which includes the next one 10 times.
    for (int n = 0; n < 10; ++n) {
        std::string text;
        for (int k = 0; k < 10 && n < 9; ++k) text += "config \"" + (folder / std::to_string(n + 1)).string() + "\"\n";
        test::store(folder / std::to_string(n), text + "noise\n");
    }
    CHECK_THROWS_WITH(config("0"), Contains("10000 scenes"));
}

TEST_CASE("programs that are too deep or too long are refused before they are evaluated", "[app]") {
    const auto sums = [](int count) {
        std::string lines = "noise";
        for (int k = 0; k < count; ++k) lines += "\nnoise\nsum";
        return lines;
    };
    CHECK_NOTHROW(graphOfLines(sums(499)));
    CHECK_THROWS_WITH(graphOfLines(sums(500)), Contains("-sum") && Contains("more than 500 fields"));
    std::string sideBySide; // not deep
    for (int k = 0; k < 600; ++k) sideBySide += "noise\n";
    CHECK_NOTHROW(graphOfLines(sideBySide));
    std::string many;
    for (int k = 0; k <= 20000; ++k) many += "verbose\n";
    CHECK_THROWS_WITH(graphOfLines(many), Contains("more than 20000 actions"));
}

TEST_CASE("a graph in a .json file can be included, after nothing but settings", "[app]") {
    const test::Folder folder;
    const std::string file = (folder / "flow.json").string();
    test::store(folder / "flow.json", jsonOf(graphOfLines("noise\nnoise seed=1 as=g\ndfvn as=wind")));
    const Graph graph =
        graphOfLine({"-quiet", "-config", file, "-velocity", "dim=8", "-scatter", "-advect", "flow=wind"});
    REQUIRE(graph.nodes.size() == 7);
    CHECK(graph.nodes[0].action().name == "quiet");
    CHECK(graph.nodes[4].inputs[0] == std::vector{Link{.index = 3}}); // what follows works on its results
    CHECK_THROWS_WITH(graphOfLine({"-sphere", "-config", file}), Contains("has to come first"));
    test::store(folder / "flow.json", "{\"nodes\": [{\"action\": \"nosie\"}]}");
    CHECK_THROWS_WITH(graphOfLine({"-config", file}), Contains("flow.json") && Contains("'noise'"));
}

TEST_CASE("a scene that cannot be read is named", "[app]") {
    const test::Folder folder;
    const auto failure = [&](const std::string& name) -> std::string {
        try {
            graphOfLine({"-config", (folder / name).string()});
        } catch (const FileError& e) {
            return e.what();
        }
        return "nothing";
    };
    CHECK_THAT(failure("missing.txt"), Contains("-config") && Contains("missing.txt") && Contains("no such file"));
    std::filesystem::create_directory(folder / "folder");
    CHECK_THAT(failure("folder"), Contains("folder"));
    test::store(folder / "empty.txt", "");
    CHECK_THAT(failure("empty.txt"), Contains("empty.txt") && Contains("empty"));
    test::store(folder / "binary.txt", std::string("noise\0\1\2", 8));
    CHECK_THAT(failure("binary.txt"), Contains("binary.txt") && Contains("not text"));
}
