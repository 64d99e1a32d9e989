#include "curlew/app/Program.h"
#include "support/Command.h"

#include <catch2/catch.hpp>

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::Contains;

namespace {

std::vector<std::string> linesOf(const Program& program) {
    std::vector<std::string> lines;
    for (const auto& arguments : program.actions) lines.push_back(arguments.program());
    return lines;
}

} // namespace

TEST_CASE("a command line and a scene are the same program", "[app]") {
    const Program line = parseCommandLine({"-sphere", "radius=0.5", "-noise", "seed=1", "freq=2", "-write",
                                           "my file.vdb", "grid=0,1", "-noise", "offset=-1,-2,-3"});
    const Program scene = parseScene(
        "# a scene\n"
        "sphere radius=0.5   # the wall\n"
        "\n"
        "-noise seed=1 \\\n"
        "   freq=2\r\n"
        "  write 'my file.vdb' grid=0,1\n"
        "noise offset=-1,-2,-3",
        "scene");
    CHECK(line.actions.size() == 4);
    CHECK(linesOf(line) == linesOf(scene));
    CHECK(line.actions[1].real("frequency") == 2);
    CHECK(line.actions[2].words() == std::vector<std::string>{"my file.vdb"});
    // One dash or two.
    CHECK(linesOf(parseCommandLine({"--noise", "seed=1"})) == linesOf(parseCommandLine({"-noise", "seed=1"})));
}

TEST_CASE("a program can be written as a scene", "[app]") {
    const Program program = parseCommandLine(
        {"-torus", "radius=1", "-noise", "-dfvn", "keep=1", "-write", "it's a.vdb", "#1.vdb", "half=1"});
    CHECK(linesOf(parseScene(sceneOf(program), "again")) == linesOf(program));
    CHECK(sceneOf({}).empty());
}

TEST_CASE("a number is never taken for an action", "[app]") {
    const Program program = parseCommandLine({"-threads", "-1", "-noise", "seed=1"});
    REQUIRE(program.actions.size() == 2);
    CHECK(program.actions[0].words() == std::vector<std::string>{"-1"});
}

TEST_CASE("what is no action is named", "[app]") {
    CHECK_THROWS_WITH(parseCommandLine({"spot.obj", "-mesh2ls"}), Contains("'spot.obj'") && Contains("dash"));
    CHECK_THROWS_WITH(parseCommandLine({"-nosie"}), Contains("nosie") && Contains("'noise'"));
    CHECK_THROWS_WITH(parseCommandLine({"-noise", "sede=1"}), Contains("-noise") && Contains("'seed'"));
    CHECK_THROWS_WITH(parseCommandLine({"-noise", "seed=x"}), Contains("-noise") && Contains("seed=x"));
    CHECK_THROWS_WITH(parseCommandLine({"-noise", "-write"}), Contains("-write") && Contains("needs FILE"));
    for (const char* token : {"", " ", "-", "=", "noise"}) {
        CAPTURE(token);
        CHECK_THROWS_AS(parseCommandLine({token}), ValueError);
    }
}

TEST_CASE("an error in a scene names the file and the line on which its action begins", "[app]") {
    const auto complaint = [](const std::string& text) -> std::string {
        try {
            parseScene(text, "my.scene");
        } catch (const ValueError& e) {
            return e.what();
        }
        return "nothing";
    };
    CHECK_THAT(complaint("noise\n\nnoise seed=x\n"),
               Contains("my.scene:3") && Contains("-noise") && Contains("seed=x"));
    CHECK_THAT(complaint("noise\n# a\nnosie"), Contains("my.scene:3") && Contains("'noise'"));
    CHECK_THAT(complaint("noise \\\n seed=1 \\\n freq=0\n"), Contains("my.scene:1") && Contains("frequency=0"));
    CHECK_THAT(complaint("noise\nwrite 'a.vdb\n"), Contains("my.scene:2") && Contains("quote"));
    CHECK_THAT(complaint("noise\nnoise \\"), Contains("my.scene") && Contains("\\"));
}

TEST_CASE("scenes can include scenes, but not for ever", "[app]") {
    const test::Folder folder;
    const auto config = [&](const std::string& name) {
        return parseCommandLine({"-sphere", "-config", (folder / name).string(), "-dfvn"});
    };
    test::store(folder / "inner.txt", "noise seed=5\n");
    test::store(folder / "outer.txt",
                "noise seed=4\nconfig \"" + (folder / "inner.txt").string() + "\"\nnoise seed=6\n");
    const Program program = config("outer.txt");
    std::vector<int64_t> seeds;
    for (size_t k = 1; k + 1 < program.actions.size(); ++k) seeds.push_back(program.actions[k].integer("seed"));
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

TEST_CASE("a scene that cannot be read is named", "[app]") {
    const test::Folder folder;
    const auto complaint = [&](const std::string& name) -> std::string {
        try {
            parseCommandLine({"-config", (folder / name).string()});
        } catch (const FileError& e) {
            return e.what();
        }
        return "nothing";
    };
    CHECK_THAT(complaint("missing.txt"), Contains("-config") && Contains("missing.txt") && Contains("no such file"));
    std::filesystem::create_directory(folder / "folder");
    CHECK_THAT(complaint("folder"), Contains("folder"));
    test::store(folder / "empty.txt", "");
    CHECK_THAT(complaint("empty.txt"), Contains("empty.txt") && Contains("empty"));
    test::store(folder / "binary.txt", std::string("noise\0\1\2", 8));
    CHECK_THAT(complaint("binary.txt"), Contains("binary.txt") && Contains("not text"));
}

TEST_CASE("actions run in order, and an error carries the action's name", "[app]") {
    Console console(nullptr);
    console.setVerbosity(Verbosity::quiet);
    Session session(console);
    run(parseScene("sphere\nnoise seed=1\nnoise seed=2\nbound width=0.2", "scene"), session);
    CHECK(session.fields.size() == 3);
    CHECK(session.fields.at().wall);
    CHECK(session.report["actions"].size() == 4);
    CHECK(session.report["actions"][3]["action"] == "-bound width=0.2");
    CHECK_THROWS_WITH(run(parseScene("velocity", "scene"), session), Contains("-velocity: there is no flow yet"));
    // A scene that cannot write what it says does not begin.
    CHECK_THROWS_WITH(run(parseScene("noise\nwrite missing/a.vdb", "scene"), session), Contains("missing/a.vdb"));
    CHECK(session.fields.size() == 3);
    // What OpenVDB throws carries it too.
    Action failing{.name = "fails", .run = [](Session&, const Arguments&) { OPENVDB_THROW(openvdb::IoError, "why"); }};
    CHECK_THROWS_WITH(run(Program{{Arguments(failing)}}, session), Contains("-fails: ") && Contains("why"));
}

TEST_CASE("where a program has failed is known by line and action", "[app]") {
    const auto placeOf = [](const std::string& text) {
        Place place;
        Console silent(Listener{});
        Session session(silent);
        try {
            const Program program = parseScene(text, "scene", &place);
            run(program, session);
        } catch (const Error&) {
            if (place.line == 0) place = session.place;
        }
        return std::pair(place.line, place.action);
    };
    CHECK(placeOf("noise\n\n# comment\nnonsense") == std::pair(4, std::string("nonsense")));
    CHECK(placeOf("noise \\\n seed=1 \\\n frequency=0\nnoise") == std::pair(1, std::string("noise")));
    CHECK(placeOf("noise\nnoise \"") == std::pair(2, std::string()));
    CHECK(placeOf("noise\nset x=1\n\nvelocity\nnoise") == std::pair(4, std::string("velocity")));
    CHECK(placeOf("noise\nwrite no/such/folder.vdb") == std::pair(2, std::string("write")));
    CHECK(placeOf("noise\nframes 1-2\nnoise\nvelocity") == std::pair(4, std::string("velocity")));
    CHECK(placeOf("noise\nframes 2-1\nnoise") == std::pair(2, std::string("frames")));
    // In a scene that another includes, that one's line counts.
    const test::Folder folder;
    test::store(folder / "inner.txt", "noise\nnoise\nnoise seed=x");
    CHECK(placeOf("sphere\nconfig \"" + (folder / "inner.txt").string() + "\"") == std::pair(2, std::string("noise")));
}

TEST_CASE("a program reads what its caller provides before it looks for files", "[app]") {
    Console silent(Listener{});
    Session session(silent);
    const auto mesh = std::make_shared<const Mesh>(
        meshOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3}, {3, 3, 3, 3}));
    session.provided["no such file.ply"] = mesh;
    Particles points;
    points.x = {1}, points.y = {2}, points.z = {3}, points.id = {4};
    session.provided["points"] = std::move(points);
    run(parseScene("read 'no such file.ply' points", "scene"), session);
    REQUIRE(session.geometry.size() == 2);
    CHECK(std::get<std::shared_ptr<const Mesh>>(session.geometry.at(1)) == mesh);
    CHECK(session.particles().id == std::vector<int64_t>{4});
    CHECK_THROWS_WITH(run(parseScene("read other.ply", "scene"), session), Contains("other.ply"));
    CHECK_THROWS_WITH(run(parseScene("read other", "scene"), session), Contains("no known extension"));
    // Meshes that change from frame to frame are those of the frame before at its beginning.
    Session moving(silent);
    for (int frame = 1; frame <= 2; ++frame) {
        Mesh moved = *mesh;
        for (auto& point : moved.points) point.x() += 0.1f * static_cast<float>(frame);
        moving.provided["mesh" + std::to_string(frame)] = std::make_shared<const Mesh>(std::move(moved));
    }
    run(parseScene(
            "frames 1-2\nread mesh$F\nmesh2ls dim=16\nnoise\nnoise seed=1\nbound\ndfvn\nscatter count=20\nadvect",
            "scene"),
        moving);
    CHECK(moving.report["advect"]["outside"] == 0);
}

TEST_CASE("a caller sees each frame while what it has made is there", "[app]") {
    Console silent(Listener{});
    Session session(silent);
    std::vector<int> frames;
    session.onFrame = [&](int frame) {
        frames.push_back(frame);
        CHECK(session.fields.size() == 2);
        if (frame == 5) throw Interrupted();
    };
    CHECK_THROWS_AS(run(parseScene("noise\nframes 1-9x2\nnoise seed=1", "scene"), session), Interrupted);
    CHECK(frames == std::vector{1, 3, 5});
}

TEST_CASE("a program that is cancelled stops at the next action", "[app]") {
    int asked = 0;
    Console console([&] { return ++asked > 1; });
    console.setVerbosity(Verbosity::quiet);
    Session session(console);
    CHECK_THROWS_AS(run(parseScene("noise\nnoise\nnoise", "scene"), session), Interrupted);
    CHECK(session.fields.size() == 1);
}
