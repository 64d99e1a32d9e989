// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/actions/Actions.h"
#include "curlew/app/language/Program.h"
#include "support/Catch.h"
#include "support/Command.h"

#include <fmt/format.h>

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::ContainsSubstring;
using test::Folder;
namespace fs = std::filesystem;

namespace {

const Reading& lenient() {
    static const Reading reading{.registry = registry(), .world = {.lenient = true}};
    return reading;
}

Graph graphOf(const std::string& text) { return graphOfText(text, "scene", lenient()); }

/// Returns the graph of `text` as a scene, after checking that the scene gives a graph with the same scene text.
std::string sceneAgain(const std::string& text) {
    const std::string scene = sceneOf(graphOf(text));
    CAPTURE(text, scene);
    CHECK(sceneOf(graphOf(scene)) == scene);
    return scene;
}

/// A folder in which scenes find their meshes and tables.
struct SceneFolder : Folder {
    SceneFolder() { fs::create_directory_symlink(fs::path(test::sourceDir()) / "scenes", *this / "scenes"); }
};

/// Returns the contents of the files that a program has written, by name.
std::map<std::string, std::string> filesIn(const Folder& folder) {
    std::map<std::string, std::string> files;
    for (const auto& name : folder.names())
        if (name.starts_with("out/") && !name.ends_with(".json")) files[name] = test::bytesOf(folder / name);
    return files;
}

} // namespace

TEST_CASE("print action: graph=1 prints the program once, although it has frames", "[app][command]") {
    const Folder folder;
    const std::string printed = folder.mustRun("-frames 1-3 -noise -noise seed=1 -dfvn -print graph=1").out;
    CHECK(printed.find("frames") == printed.rfind("frames"));
    test::store(folder / "again.txt", printed);
    CHECK(folder.mustRun("-config again.txt").out == printed);
}

TEST_CASE("sceneOf: omits names if the newest objects are meant", "[app]") {
    const std::string plain =
        "torus radius=1 tube=0.25\nnoise\nnoise seed=1\ndfvn speed=1\nvelocity dim=8\nwrite \"it's a.vdb\" '#1.vdb' "
        "half=1\n";
    CHECK(sceneAgain(plain) ==
          "torus radius=1 tube=0.25\nnoise\nnoise seed=1\ndfvn speed=1\nvelocity dim=8\n"
          "write \"it's a.vdb\" \"#1.vdb\" half=1\n");
    CHECK(sceneOf({}).empty());
    CHECK(sceneAgain("noise alpha={2*pi*T} seed={F}\nslice width=8\nwrite 'out.$F4.png'\n") ==
          "noise alpha={2*pi*T} seed={F}\nslice width=8\nwrite out.$F4.png\n");
    CHECK(sceneAgain("sphere\nscatter\nframes 1-9 fps=10\nsphere translate={T},0,0\nkill\nwrite a.$F.ply\nresume") ==
          "sphere\nscatter\nframes 1-9 fps=10\nsphere translate={T},0,0\nkill\nwrite a.$F.ply\nresume\n");
}

TEST_CASE("sceneOf: writes names if other objects are meant", "[app]") {
    const std::string ages = sceneAgain("noise\nnoise\ndfvn\nvelocity\nvelocity staggered=1\nwrite a.vdb grid=1");
    CHECK_THAT(ages, ContainsSubstring("velocity as=velocity\n") && ContainsSubstring("write a.vdb what=velocity\n") &&
                         !ContainsSubstring("grid="));
    const std::string kept = sceneAgain("noise\nnoise\nsum keep=1\nsum\nsum\nslice");
    CHECK(jsonOf(graphOf(kept)).find("noise_2") != std::string::npos);
    // Names that the user has given are kept.
    CHECK_THAT(sceneAgain("noise as=swirl\nslice"), ContainsSubstring("noise as=swirl\n"));
    CHECK_THAT(sceneAgain("noise as=a\nnoise as=b\nsphere\nbound noise=a as=g\ndfvn f=b g=g"),
               ContainsSubstring("bound noise=a as=g\n") && ContainsSubstring("dfvn"));
    CHECK_THAT(sceneAgain("noise\nnoise\ndfvn\nscatter\nframes 1-2\nemit points=none"),
               ContainsSubstring("emit points=none"));
}

TEST_CASE("sceneOf: text to graph to text keeps all kinds of links", "[app]") {
    for (const std::string scene :
         {"noise\nnoise\nnoise\ncurl keep=1\ndfvn\nsuperpose\nvelocity density=1 potentials=1\nwrite grid=0,2 a.vdb",
          "noise as=a\nnoise as=b\ndfvn f=b g=a as=w\nscatter as=p\nadvect points=p keep=1 as=q\nadvect "
          "points=p\nwrite a.ply what=q",
          "noise\nnoise\ndfvn\nscatter as=p\nframes 1-3\nadvect points=p\nadvect points=p as=twice\nwrite a.$F.ply "
          "what=p",
          "noise\nnoise\ndfvn\nscatter as=p\nscatter seed=1 as=q\nframes 1-3\nadvect points=p\nadvect points=q\nwrite "
          "a.$F.ply what=p b.$F.ply",
          "frames 1-3\nsphere as=s\nemit as=a\nemit points=none as=b\nkill points=a box=0,0,0,1,1,1\nwrite a.$F.ply "
          "what=b",
          "noise\nnoise\ndfvn\nscatter\nadvect pathlines=1\nscatter\nwrite a.obj\nsplat geo=1",
          "noise dimensions=2\nslice\nslice position=1\nslice position=2\npanels count=2\ncompare with=1",
          "read a.obj\nmesh2ls dim=9 keep=1\nframes 1-2\nmesh2ls dim=12\nnoise\nnoise\nbound "
          "grid=1\ndfvn\nadvectLevelSet keep=1"}) {
        CAPTURE(scene);
        const std::string again = sceneAgain(scene);
        // Ignores names, which a scene gives where it needs them; compares the nodes' actions and links.
        const auto bare = [](const Graph& graph) {
            std::string text;
            for (const Node& node : graph.nodes) {
                text += node.action().name;
                for (const auto& input : node.inputs) {
                    text += " |";
                    for (const Link& link : input)
                        text += fmt::format(" {}.{}.{}", static_cast<int>(link.from), link.index, link.output);
                }
                text += '\n';
            }
            for (const State& state : graph.states)
                text +=
                    fmt::format("state {} {}\n", state.next.index, state.initial ? state.initial->index : size_t{999});
            return text;
        };
        CHECK(bare(graphOf(again)) == bare(graphOf(scene)));
    }
}

TEST_CASE("scenes: every scene survives the round trip through scene and JSON", "[app]") {
    const fs::path before = fs::current_path();
    fs::current_path(test::sourceDir()); // scenes use paths relative to this folder
    size_t scenes = 0;
    for (const auto& entry : fs::directory_iterator("scenes")) {
        if (entry.path().extension() != ".txt") continue;
        CAPTURE(entry.path().string());
        const Graph graph = graphOf(test::bytesOf(entry.path()));
        CHECK(graph.nodes.size() > 5);
        const std::string json = jsonOf(graph), scene = sceneOf(graph);
        CHECK((jsonOf(graphOf(json)) == json));
        CHECK((sceneOf(graphOf(scene)) == scene));
        CHECK(graphOf(scene).nodes.size() == graph.nodes.size());
        ++scenes;
    }
    fs::current_path(before);
    CHECK(scenes > 20);
}

TEST_CASE("scenes: scene and rewritten scene and JSON write the same files", "[app][command]") {
    const std::string name = GENERATE("demo", "icn_fig5_image_warp", "icn_fig8_animated_jitter");
    CAPTURE(name);
    const SceneFolder scene, written, json;
    const std::string text = test::bytesOf(fs::path(test::sourceDir()) / "scenes" / (name + ".txt"));
    const size_t begin = text.find("# reduced:") + 10;
    const std::string reduced = text.substr(begin, text.find('\n', begin) - begin);
    scene.mustRun(fmt::format("-quiet -set {} -config scenes/{}.txt -write graph.json", reduced, name));
    const auto files = filesIn(scene);
    REQUIRE(!files.empty());
    const auto print = scene.run(fmt::format("-quiet -print graph=1 -set {} -config scenes/{}.txt", reduced, name));
    CAPTURE(print.err);
    REQUIRE(print.status == 0);
    test::store(written / "again.txt", print.out);
    written.mustRun("-config again.txt");
    CHECK((filesIn(written) == files));
    fs::copy_file(scene / "graph.json", json / "graph.json");
    json.mustRun("-config graph.json");
    CHECK((filesIn(json) == files));
}
