// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/run/Session.h"
#include "curlew/vdb/Openvdb.h"
#include "support/Catch.h"
#include "support/Command.h"
#include "support/SessionCommand.h"

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::ContainsSubstring;
using test::countOf;
using test::Folder;
using test::Scenes;
using Names = std::vector<std::string>;

namespace {

std::shared_ptr<const Mesh> tetrahedron(float x = 0) {
    Mesh mesh =
        meshOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3}, {3, 3, 3, 3});
    for (auto& point : mesh.points) point.x() += x;
    return std::make_shared<const Mesh>(std::move(mesh));
}

Digest digestOf(const std::string& text) { return DigestBuilder().add(text).digest(); }

std::string replaced(std::string text, const std::string& what, const std::string& by) {
    REQUIRE(text.find(what) != std::string::npos);
    return text.replace(text.find(what), what.size(), by);
}

/// From a mesh to points that move in it.
const std::string kJob =
    "read tetrahedron as=mesh\nmesh2ls dim=16 as=ls\nnoise frequency=2 as=f\nnoise frequency=2 seed=1 as=n\n"
    "bound noise=n wall=ls layer=0.1 as=g\ndfvn f=f g=g speed=1 as=flow\nscatter domain=flow count=50 as=seeds\n"
    "advect flow=flow points=seeds duration=0.1 steps=2 as=dust";

Names jobNames() { return {"mesh", "ls", "f", "n", "g", "flow", "seeds", "dust"}; }

struct Job : Scenes {
    Job() { session.provide("tetrahedron", tetrahedron(), digestOf("one")); }
    /// Returns the nodes that a text evaluates.
    Names evaluated(const std::string& text) { return runAnew(text).evaluated(); }
};

} // namespace

// --- what a program leaves behind

TEST_CASE("Session: actions run in order and an error carries the action's name", "[app]") {
    Scenes scenes;
    Session& session = scenes.run("sphere\nnoise seed=1\nnoise seed=2\nbound layer=0.2");
    CHECK(countOf(session, Kind::field) == 3);
    CHECK(std::get<FieldValue>(test::valueOf(session, Kind::field)).wall);
    CHECK(session.report["actions"].size() == 4);
    CHECK(session.report["actions"][3]["action"] == "-bound layer=0.2");
    CHECK_THROWS_WITH(scenes.run("velocity"),
                      ContainsSubstring("-velocity: ") && ContainsSubstring("a flow") && ContainsSubstring("-dfvn"));
    // A scene whose output cannot be written does not start.
    CHECK_THROWS_WITH(scenes.run("noise\nslice width=4\nwrite missing/too/a.png"),
                      ContainsSubstring("missing/too/a.png"));
    CHECK(countOf(session, Kind::field) == 3);
    CHECK(countOf(session, Kind::image) == 0);
    // Exceptions of OpenVDB get the context, too.
    Scenes failing([](Context&) { OPENVDB_THROW(openvdb::IoError, "why"); });
    CHECK_THROWS_WITH(failing.run("here"), ContainsSubstring("-here: ") && ContainsSubstring("why"));
}

TEST_CASE("Session: a program continues with the objects of the previous one", "[app]") {
    Scenes apart, whole;
    apart.run("noise\nnoise seed=1\nscatter box=-1,-1,-1,1,1,1 count=20 as=dust");
    apart.run("dfvn as=wind");
    CHECK(countOf(apart.session, Kind::field) == 0); // they were consumed
    apart.run("noise\nadvect duration=0.1 steps=2 flow=wind points=dust");
    CHECK(countOf(apart.session, Kind::points) == 1);
    whole.run("noise\nnoise seed=1\nscatter box=-1,-1,-1,1,1,1 count=20\ndfvn\nadvect duration=0.1 steps=2");
    CHECK(test::pointsOf(apart.session).x == test::pointsOf(whole.session).x);
    CHECK(countOf(apart.session, Kind::flow) == 1);
    CHECK(sceneOf(apart.graph("noise seed=2\nslice width=4")) == "noise seed=2\nslice width=4\n");
    CHECK(sceneOf(apart.graph("noise\nvelocity dim=4")) == "noise\nvelocity dim=4\n"); // of the earlier flow
    apart.session.clear();
    CHECK(apart.session.objects().empty());
    CHECK_THROWS_AS(apart.run("velocity"), ValueError);
}

TEST_CASE("Session: results of a failed or cancelled program remain", "[app]") {
    Scenes scenes;
    scenes.run("noise\nnoise seed=1\ndfvn\nscatter count=20");
    CHECK_THROWS_WITH(scenes.run("sphere\nadvect duration=0.1 steps=1\nnoise\nnoise\ndfvn"),
                      ContainsSubstring("does not move"));
    CHECK(countOf(scenes.session, Kind::shape) == 1);
    CHECK(countOf(scenes.session, Kind::points) == 1);
    CHECK(countOf(scenes.session, Kind::noise) == 2); // -dfvn could not make a flow of them
    CHECK(countOf(scenes.session, Kind::flow) == 1);
}

TEST_CASE("Session: a result is found by the name of its node", "[app]") {
    Scenes scenes;
    Session& session = scenes.run(
        "sphere as=ball\nnoise as=f\nnoise seed=1\nbound as=g\ndfvn f=f g=g as=wind\n"
        "velocity dim=4 density=1 as=smoke\nscatter count=7");
    CHECK(kindOf(session.result("ball").value) == Kind::shape);
    CHECK(session.result("g").object.kind == Kind::noise);
    CHECK(session.result("noise").name == "noise"); // -bound has consumed it
    CHECK(std::get<GridValue>(session.result("smoke.density").value).grid->getName() == "density");
    CHECK(std::get<GridValue>(session.result("smoke").value).grid->getName() == "vel");
    CHECK(test::pointsOf(session.result("scatter").value).size() == 7);
    CHECK_THROWS_WITH(session.result("wnid"), ContainsSubstring("'wnid'") && ContainsSubstring("did you mean 'wind'"));
    CHECK_THROWS_WITH(session.result("smoke.densty"), ContainsSubstring("did you mean 'density'"));
}

TEST_CASE("Session: a cancelled program stops at the next node", "[app]") {
    int asked = 0;
    Console console([&] { return ++asked > 1; });
    console.setVerbosity(Verbosity::quiet);
    Scenes scenes({}, console);
    CHECK_THROWS_AS(scenes.run("noise\nnoise\nnoise"), Interrupted);
    CHECK(countOf(scenes.session, Kind::field) == 1);
}

TEST_CASE("Session: the location of a failure has line and action and node", "[app]") {
    const auto placeOf = [](const std::string& text) {
        Scenes scenes;
        CHECK_THROWS_AS(scenes.run(text), Error);
        const SourceLocation& location = scenes.session.location;
        return std::tuple(location.line, location.action, location.node);
    };
    using Place = std::tuple<int, std::string, std::string>;
    CHECK(placeOf("noise\n\nnoise as=same\ndfvn as=stuck") == Place(4, "dfvn", "stuck"));
    CHECK(placeOf("noise\n\nnoise\ndfvn") == Place(4, "dfvn", "dfvn"));
    CHECK(placeOf("noise\nslice width=4\nwrite no/such/folder.png") == Place(3, "write", "write"));
    CHECK(placeOf("noise\nframes 4-9\nsphere radius={2-T*24} as=ball") == Place(3, "sphere", "ball"));
}

TEST_CASE("Session: onFrame sees the results of each frame", "[app]") {
    Scenes scenes;
    std::vector<int> frames;
    scenes.session.onFrame = [&](int frame) {
        frames.push_back(frame);
        CHECK(countOf(scenes.session, Kind::field) == 2);
        CHECK(std::get<FieldValue>(scenes.session.result("late").value).program == "-noise seed={F}");
        if (frame == 5) throw Interrupted();
    };
    CHECK_THROWS_AS(scenes.run("noise\nframes 1-9x2\nnoise seed={F} as=late"), Interrupted);
    CHECK(frames == std::vector{1, 3, 5});
}

TEST_CASE("Session: provided objects take precedence over files", "[app]") {
    Scenes scenes;
    Session& session = scenes.session;
    const auto mesh = tetrahedron();
    session.provide("no such file.ply", mesh, digestOf("mesh"));
    auto points = std::make_shared<PointSet>();
    points->particles.x = {1}, points->particles.y = {2}, points->particles.z = {3}, points->particles.id = {4};
    session.provide("points", points, digestOf("points"));
    scenes.run("read 'no such file.ply' points");
    REQUIRE(session.objects().size() == 2);
    CHECK(std::get<MeshPointer>(session.objects()[0].value) == mesh);
    CHECK(test::pointsOf(session).id == std::vector<int64_t>{4});
    CHECK_THROWS_WITH(scenes.run("read other.ply"), ContainsSubstring("other.ply"));
    CHECK_THROWS_WITH(scenes.run("read other"), ContainsSubstring("no known extension"));
    CHECK(session.withdraw("points"));
    CHECK_FALSE(session.withdraw("points"));
    CHECK_THROWS_WITH(scenes.run("read points"), ContainsSubstring("no known extension"));
    // At the beginning of a frame, moving meshes are those of the previous frame.
    Scenes moving;
    for (int frame = 1; frame <= 2; ++frame)
        moving.session.provide("mesh" + std::to_string(frame), tetrahedron(0.1f * static_cast<float>(frame)),
                               digestOf(std::to_string(frame)));
    moving.run("frames 1-2\nread mesh$F\nmesh2ls dim=16\nnoise\nnoise seed=1\nbound\ndfvn\nscatter count=20\nadvect");
    CHECK(moving.session.report["advect"]["outside"] == 0);
}

// --- caching of values by content

TEST_CASE("Session: running the same program again evaluates no value", "[app]") {
    Job job;
    CHECK(job.evaluated(kJob) == jobNames());
    const Points first = test::pointsOf(job.session);
    CHECK(job.evaluated(kJob).empty());
    CHECK(test::pointsOf(job.session).x == first.x);
    CHECK(job.evaluated(kJob).empty()); // values are kept while each run uses them
    // Effects are evaluated in each run and see the same values.
    int looked = 0;
    Scenes scenes([&](Context& c) {
        ++looked;
        CHECK(c.points("points").particles.size() == 20);
    });
    for (int k = 1; k <= 3; ++k) {
        CHECK(scenes.runAnew("sphere\nscatter count=20\nhere").evaluated() ==
              (k == 1 ? Names{"sphere", "scatter", "here"} : Names{"here"}));
        CHECK(looked == k);
    }
}

TEST_CASE("Session: an edit evaluates only what depends on it", "[app]") {
    Job job;
    job.run(kJob);
    const auto edited = [&](const std::string& what, const std::string& by) {
        return job.evaluated(replaced(kJob, what, by));
    };
    // Changes the frequency of a noise: the mesh is not voxelised again.
    CHECK(edited("noise frequency=2 as=f", "noise frequency=3 as=f") == Names{"f", "flow", "seeds", "dust"});
    CHECK(job.evaluated(kJob) == Names{"f", "flow", "seeds", "dust"}); // and nothing upstream
    CHECK(edited("steps=2", "steps=3") == Names{"dust"});              // and nothing above it
    CHECK(edited("count=50", "count=60") == Names{"seeds", "dust"});
    job.runAnew(kJob);
    CHECK(edited("layer=0.1", "layer=0.2") == Names{"g", "flow", "seeds", "dust"});
    job.runAnew(kJob);
    CHECK(edited("dim=16", "dim=17") == Names{"ls", "g", "flow", "seeds", "dust"});
    // Writing out an option's default or renaming a node does not change a value.
    job.runAnew(kJob);
    CHECK(job.evaluated(replaced(kJob, "as=dust", "as=smoke")).empty());
    CHECK(job.evaluated(kJob + "\nslice width=4 as=picture") == Names{"picture"});
    CHECK(job.evaluated(kJob).empty());
}

TEST_CASE("Session: changed content under the same name is evaluated again", "[app]") {
    Job job;
    job.run(kJob);
    job.session.provide("tetrahedron", tetrahedron(), digestOf("one")); // the same content again
    CHECK(job.evaluated(kJob).empty());
    job.session.provide("tetrahedron", tetrahedron(1), digestOf("two"));
    const Names all = job.evaluated(kJob);
    CHECK(all == Names{"mesh", "ls", "g", "flow", "seeds", "dust"}); // all but the noises
    // A file that has changed is another value, too.
    const Folder folder;
    const std::string read = "read \"" + (folder / "a.vdb").string() + "\" as=p\nspacing";
    job.runAnew("sphere\nscatter count=10\nwrite \"" + (folder / "a.vdb").string() + "\"");
    CHECK(job.evaluated(read) == Names{"p", "spacing"});
    CHECK(job.evaluated(read) == Names{"spacing"});
    job.runAnew("sphere\nscatter count=11\nwrite \"" + (folder / "a.vdb").string() + "\"");
    CHECK(job.evaluated(read) == Names{"p", "spacing"});
    CHECK(test::pointsOf(job.session).size() == 11);
}

TEST_CASE("Session: an edit gives the same result as a new session", "[app]") {
    Job edited;
    edited.run(kJob);
    for (const auto& [what, by] : {std::pair<std::string, std::string>{"frequency=2 as=f", "frequency=3 as=f"},
                                   {"count=50", "count=51"},
                                   {"steps=2", "steps=1"},
                                   {"seed=1", "seed=2"},
                                   {"dim=16", "dim=20"}}) {
        CAPTURE(what, by);
        Job anew;
        const std::string text = replaced(kJob, what, by);
        edited.runAnew(text), anew.run(text);
        const Points a = test::pointsOf(edited.session), b = test::pointsOf(anew.session);
        CHECK(a.x == b.x);
        CHECK(a.f == b.f);
        CHECK(a.vx == b.vx);
    }
}

TEST_CASE("Session: moving points does not change the value they were made from", "[app]") {
    Job job;
    const std::string text = "sphere\nscatter count=9 as=seeds\npush as=moved";
    const auto xOf = [&](const std::string& name) { return test::pointsOf(job.session.result(name).value).x; };
    job.run(text);
    const auto seeds = xOf("seeds"), moved = xOf("moved");
    CHECK(moved[0] == seeds[0] + 1);
    for (int k = 0; k < 3; ++k) {
        CHECK(job.evaluated(text + (k == 1 ? "\npush as=again" : "")) == (k == 1 ? Names{"again"} : Names{}));
        CHECK(xOf("seeds") == seeds);
        CHECK(xOf("moved") == moved);
    }
}

TEST_CASE("Session: in frames values without time dependence are evaluated once", "[app]") {
    Scenes scenes;
    const std::string text = "noise as=n\nframes 1-4\nnoise seed=1 as=still\nnoise alpha={T} as=moving\ndfvn as=flow";
    const Names first = scenes.runAnew(text).evaluated();
    CHECK(std::count(first.begin(), first.end(), "n") == 1);
    CHECK(std::count(first.begin(), first.end(), "still") == 1);
    CHECK(std::count(first.begin(), first.end(), "moving") == 4);
    CHECK(std::count(first.begin(), first.end(), "flow") == 4);
    const Names again = scenes.runAnew(text + "\nslice width=4 as=s").evaluated();
    CHECK(std::count(again.begin(), again.end(), "n") == 0);
    CHECK(std::count(again.begin(), again.end(), "still") == 0);
    CHECK(std::count(again.begin(), again.end(), "s") == 4);
}

TEST_CASE("Session: only wanted nodes and effects are evaluated", "[app]") {
    int looked = 0;
    Scenes scenes([&](Context&) { ++looked; });
    const std::string nodes =
        R"({"nodes": [{"name": "f", "action": "noise"}, {"name": "g", "action": "noise", "options": {"seed": 1}},
        {"name": "unused", "action": "sphere"}, {"name": "wind", "action": "dfvn", "inputs": {"f": ["f"], "g": ["g"]}},
        {"name": "seen", "action": "here", "inputs": {"what": ["f"]}}, {"action": "quiet"}])";
    const auto evaluated = [&](const std::string& members) {
        Names names = scenes.runAnew(nodes + members + "}").evaluated();
        std::erase(names, "quiet");
        return names;
    };
    CHECK(evaluated("").size() == 5);
    CHECK(looked == 1);
    scenes.runAnew("{}"); // clears the cached values
    CHECK(evaluated(R"(, "wanted": ["g"])") == Names{"f", "g", "seen"});
    CHECK(looked == 2);
    scenes.runAnew("{}");
    CHECK(evaluated(R"(, "wanted": ["wind"], "effects": false)") == Names{"f", "g", "wind"});
    CHECK(looked == 2);
    CHECK(kindOf(scenes.session.result("wind").value) == Kind::flow);
    CHECK_THROWS_WITH(scenes.session.result("unused"), ContainsSubstring("'unused' has not been made"));
    scenes.runAnew("{}");
    CHECK(evaluated(R"(, "effects": false)").empty()); // no node is wanted
    CHECK(looked == 2);
    CHECK_THROWS_WITH(evaluated(R"(, "wanted": ["wnid"])"), ContainsSubstring("did you mean 'wind'"));
}

TEST_CASE("Session: the frame rate in an expression is that of the frames, also before them", "[app]") {
    std::vector<double> seen;
    Scenes scenes([&](Context& c) { seen.push_back(c.moment().fps); });
    for (const double fps : {24.0, 30.0, 60.0}) {
        scenes.runAnew(fmt::format("here\nnoise alpha={{fps}} as=n\nframes 1-1 fps={}\nslice width=4", fps));
        CHECK(seen.back() == fps);
        CHECK(std::ranges::count(scenes.session.evaluated(), "n") == 1); // not a value of another rate
    }
}

TEST_CASE("Session: the sums over frames are those of one node and one run", "[app]") {
    Scenes scenes;
    const std::string program =
        "noise as=f\nnoise seed=1 as=g\ndfvn f=f g=g speed=1\nscatter count=50 as=many\nscatter count=5 as=few\n"
        "frames 1-3\nadvect points=many steps=2 as=a\nadvect points=few steps=2 as=b";
    for (int run = 0; run < 2; ++run) {
        scenes.runAnew(program);
        CHECK(scenes.session.report["a"]["substeps"] == 300);
        CHECK(scenes.session.report["b"]["substeps"] == 30);
    }
}

TEST_CASE("Session: a graph with a moment is evaluated at that moment", "[app]") {
    Moment seen;
    Scenes scenes([&](Context& c) { seen = c.moment(); });
    const std::string nodes = R"({"nodes": [{"name": "e", "action": "enright"}, {"name": "n", "action": "noise"},
        {"name": "h", "action": "here"}])";
    scenes.runAnew(nodes + "}");
    CHECK(seen.time == 0);
    scenes.runAnew(nodes + R"(, "moment": {"frame": 7, "time": 1.3, "fps": 5}})");
    CHECK(seen.frame == 7);
    CHECK(seen.time == 1.3);
    CHECK(seen.fps == 5);
    // Only what changes with time is evaluated again.
    CHECK(scenes.session.evaluated() == Names{"e", "h"});
}
