// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/actions/Actions.h"
#include "curlew/app/language/Program.h"
#include "curlew/base/Error.h"
#include "support/Catch.h"
#include "support/Command.h"

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::ContainsSubstring;

namespace {

Graph graphOfLine(const std::vector<std::string>& tokens) {
    return graphOfCommandLine(tokens, {.registry = registry(), .world = {.lenient = true}});
}

Graph graphOfLines(const std::string& text, const std::string& name = "scene") {
    return graphOfScene(text, name, {.registry = registry(), .world = {.lenient = true}});
}

/// Returns the error message for a scene.
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

TEST_CASE("parsing: a command line and a scene give the same graph", "[app]") {
    const Graph line =
        graphOfLine({"-sphere", "radius=0.5", "-noise", "seed=1", "freq=2", "-noise", "translate=-1,-2,-3", "-dfvn",
                     "-velocity", "-velocity", "-write", "my file.vdb", "grid=0,1"});
    const Graph scene = graphOfLines(
        "# a scene\n"
        "sphere radius=0.5   # the wall\n"
        "\n"
        "-noise seed=1 \\\n"
        "   freq=2\r\n"
        "noise translate=-1,-2,-3\n"
        "dfvn\nvelocity\nvelocity\n"
        "  write 'my file.vdb' grid=0,1");
    REQUIRE(line.nodes.size() == 7);
    CHECK(jsonOf(line) == jsonOf(scene));
    CHECK(line.nodes[1].arguments.real("frequency") == 2);
    CHECK(line.nodes[6].arguments.words() == std::vector<std::string>{"my file.vdb"});
    // One dash or two dashes.
    CHECK(jsonOf(graphOfLine({"--noise", "seed=1"})) == jsonOf(graphOfLine({"-noise", "seed=1"})));
    // A text that begins with { is read as JSON, any other text as a scene.
    const Reading reading{.registry = registry(), .world = {.lenient = true}};
    CHECK(jsonOf(graphOfText(" \n" + jsonOf(line), "x", reading)) == jsonOf(line));
    CHECK(jsonOf(graphOfText("noise", "x", reading)) == jsonOf(graphOfLines("noise")));
}

TEST_CASE("parsing: a negative number is not taken for an action", "[app]") {
    const Graph graph = graphOfLine({"-threads", "-1", "-noise", "seed=1"});
    REQUIRE(graph.nodes.size() == 2);
    CHECK(graph.nodes[0].arguments.words() == std::vector<std::string>{"-1"});
}

TEST_CASE("parsing: an unknown action is named", "[app]") {
    CHECK_THROWS_WITH(graphOfLine({"spot.obj", "-mesh2ls"}),
                      ContainsSubstring("'spot.obj'") && ContainsSubstring("dash"));
    CHECK_THROWS_WITH(graphOfLine({"-nosie"}), ContainsSubstring("nosie") && ContainsSubstring("'noise'"));
    CHECK_THROWS_WITH(graphOfLine({"-noise", "sede=1"}), ContainsSubstring("-noise") && ContainsSubstring("'seed'"));
    CHECK_THROWS_WITH(graphOfLine({"-noise", "seed=x"}), ContainsSubstring("-noise") && ContainsSubstring("seed=x"));
    CHECK_THROWS_WITH(graphOfLine({"-noise", "-write"}),
                      ContainsSubstring("-write") && ContainsSubstring("needs FILE"));
    for (const char* token : {"", " ", "-", "=", "noise"}) {
        CAPTURE(token);
        CHECK_THROWS_AS(graphOfLine({token}), ValueError);
    }
}

TEST_CASE("parsing: an error in a scene names the file and the first line of its action", "[app]") {
    CHECK_THAT(complaint("noise\n\nnoise seed=x\n"),
               ContainsSubstring("my.scene:3") && ContainsSubstring("-noise") && ContainsSubstring("seed=x"));
    CHECK_THAT(complaint("noise\n# a\nnosie"), ContainsSubstring("my.scene:3") && ContainsSubstring("'noise'"));
    CHECK_THAT(complaint("noise \\\n seed=1 \\\n freq=0\n"),
               ContainsSubstring("my.scene:1") && ContainsSubstring("frequency=0"));
    CHECK_THAT(complaint("noise\nreport 'a.json\n"), ContainsSubstring("my.scene:2") && ContainsSubstring("quote"));
    CHECK_THAT(complaint("noise\nnoise \\"), ContainsSubstring("my.scene") && ContainsSubstring("\\"));
    // A missing input is reported in the same way.
    CHECK_THAT(complaint("noise\n\ndfvn"), ContainsSubstring("my.scene:3: -dfvn"));
    CHECK_THAT(complaint("noise\nframes 1-2\nvelocity"), ContainsSubstring("my.scene:3: -velocity"));
}

TEST_CASE("parsing: the location of an error has its line and action", "[app]") {
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
    // For an error in an included scene, the location is the line of -config in the outer scene.
    const test::Folder folder;
    test::store(folder / "inner.txt", "noise\nnoise\nnoise seed=x");
    CHECK(placeOf("sphere\nconfig \"" + (folder / "inner.txt").string() + "\"") == std::pair(2, std::string("noise")));
}

TEST_CASE("config: scenes can include scenes up to a depth and a number", "[app]") {
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
    CHECK_THROWS_WITH(config("self.txt"), ContainsSubstring("self.txt") && ContainsSubstring("deep"));

    // Not deeply nested, but 10 scenes, each of which includes the next one 10 times.
    for (int n = 0; n < 10; ++n) {
        std::string text;
        for (int k = 0; k < 10 && n < 9; ++k) text += "config \"" + (folder / std::to_string(n + 1)).string() + "\"\n";
        test::store(folder / std::to_string(n), text + "noise\n");
    }
    CHECK_THROWS_WITH(config("0"), ContainsSubstring("10000 scenes"));
}

TEST_CASE("parsing: programs that are too deep or too long are refused before evaluation", "[app]") {
    const auto sums = [](int count) {
        std::string lines = "noise";
        for (int k = 0; k < count; ++k) lines += "\nnoise\nsum";
        return lines;
    };
    CHECK_NOTHROW(graphOfLines(sums(499)));
    CHECK_THROWS_WITH(graphOfLines(sums(500)), ContainsSubstring("-sum") && ContainsSubstring("more than 500 deep"));
    const auto formulas = [](int count, int functions) {
        std::string lines = "noise as=f0";
        for (int k = 1; k <= count; ++k) {
            std::string formula = "f" + std::to_string(k - 1);
            for (int n = 0; n < functions; ++n) formula = "sin(" + formula + ")";
            lines += "\nformula '" + formula + "' as=f" + std::to_string(k);
        }
        return lines;
    };
    CHECK_NOTHROW(graphOfLines(formulas(20, 195)));
    CHECK_THROWS_WITH(graphOfLines(formulas(80, 195)), ContainsSubstring("more than 500 deep"));
    std::string sideBySide; // not deeply nested
    for (int k = 0; k < 600; ++k) sideBySide += "noise\n";
    CHECK_NOTHROW(graphOfLines(sideBySide));
    std::string many;
    for (int k = 0; k <= 20000; ++k) many += "verbose\n";
    CHECK_THROWS_WITH(graphOfLines(many), ContainsSubstring("more than 20000 actions"));
}

TEST_CASE("config: a JSON graph can be included before other actions", "[app]") {
    const test::Folder folder;
    const std::string file = (folder / "flow.json").string();
    test::store(folder / "flow.json", jsonOf(graphOfLines("noise\nnoise seed=1 as=g\ndfvn as=wind")));
    const Graph graph =
        graphOfLine({"-quiet", "-config", file, "-velocity", "dim=8", "-scatter", "-advect", "flow=wind"});
    REQUIRE(graph.nodes.size() == 7);
    CHECK(graph.nodes[0].action().name == "quiet");
    CHECK(graph.nodes[4].inputs[0] == std::vector{Link{.index = 3}}); // later actions use its results
    CHECK_THROWS_WITH(graphOfLine({"-sphere", "-config", file}), ContainsSubstring("has to come first"));
    test::store(folder / "flow.json", "{\"nodes\": [{\"action\": \"nosie\"}]}");
    CHECK_THROWS_WITH(graphOfLine({"-config", file}), ContainsSubstring("flow.json") && ContainsSubstring("'noise'"));
}

TEST_CASE("config: an unreadable scene is named", "[app]") {
    const test::Folder folder;
    const auto failure = [&](const std::string& name) -> std::string {
        try {
            graphOfLine({"-config", (folder / name).string()});
        } catch (const FileError& e) {
            return e.what();
        }
        return "nothing";
    };
    CHECK_THAT(failure("missing.txt"),
               ContainsSubstring("-config") && ContainsSubstring("missing.txt") && ContainsSubstring("no such file"));
    std::filesystem::create_directory(folder / "folder");
    CHECK_THAT(failure("folder"), ContainsSubstring("folder"));
    test::store(folder / "empty.txt", "");
    CHECK_THAT(failure("empty.txt"), ContainsSubstring("empty.txt") && ContainsSubstring("empty"));
    test::store(folder / "binary.txt", std::string("noise\0\1\2", 8));
    CHECK_THAT(failure("binary.txt"), ContainsSubstring("binary.txt") && ContainsSubstring("not text"));
}
