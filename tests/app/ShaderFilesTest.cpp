// SPDX-License-Identifier: Apache-2.0
#include "support/Command.h"

using namespace curlew::test;
using Catch::ContainsSubstring;

namespace {

const std::string kNoises = "-noise frequency=1.5 -noise frequency=1.5 seed=1 ";

} // namespace

TEST_CASE("write: a flow is written as a shader", "[app][command]") {
    const Folder folder;
    const auto outcome = folder.mustRun(kNoises +
                                        "-sphere radius=1 -bound side=outside width=0.3 -dfvn speed=1 "
                                        "-write flow.glsl -write dialect=es tables=data es.glsl");
    CHECK_THAT(outcome.err, ContainsSubstring("wrote flow.glsl: a flow in 3 dimensions as a shader"));
    const std::string text = bytesOf(folder / "flow.glsl"), es = bytesOf(folder / "es.glsl");
    CHECK_THAT(text,
               ContainsSubstring("GLSL 4.50") && ContainsSubstring("vec3 flowAdvance(vec3 p, vec2 track, float dt)"));
    CHECK_THAT(es, ContainsSubstring("GLSL ES 3.00") && ContainsSubstring("es.glsl.bin"));
    CHECK(folder.names() == std::set<std::string>{"flow.glsl", "es.glsl", "es.glsl.bin"});
    CHECK(fs::file_size(folder / "es.glsl.bin") == 2 * 289 * 4 * 4); // a table for each noise
    folder.mustRun(kNoises + "-dfvn -write flow.hlsl tables=data flow.wgsl");
    CHECK_THAT(bytesOf(folder / "flow.hlsl"),
               ContainsSubstring("HLSL") && ContainsSubstring("float3 flowVelocity(float3 p)"));
    CHECK_THAT(bytesOf(folder / "flow.wgsl"), ContainsSubstring("fn flowVelocity(p: vec3f) -> vec3f"));
    folder.mustFail(kNoises + "-dfvn -write dialect=es flow.hlsl", {"dialect= is only for .glsl"});
    folder.mustRun(kNoises + "-dfvn -write group=2 binding=5 tables=data bound.wgsl bound.glsl");
    const std::string bound = bytesOf(folder / "bound.wgsl");
    CHECK_THAT(bound, ContainsSubstring("@group(2) @binding(5) var<storage, read> flowData0"));
    CHECK_THAT(bound, ContainsSubstring("@group(2) @binding(6) var<uniform> flowZero"));
    CHECK_THAT(bytesOf(folder / "bound.glsl"),
               ContainsSubstring("#define FLOW_BINDING 5") && ContainsSubstring("#define FLOW_SET 2"));
    folder.mustFail(kNoises + "-dfvn -write dialect=es group=1 flow.glsl", {"group=", "textures instead of buffers"});
    folder.mustFail(kNoises + "-dfvn -velocity dim=8 -write binding=1 v.vdb", {"binding= is only for"});
    folder.mustRun(kNoises + "-dfvn -write coordinates=pairs pairs.glsl -write doubles.glsl");
    CHECK_THAT(bytesOf(folder / "pairs.glsl"),
               ContainsSubstring("#error define the macro flowZero") && !ContainsSubstring("double "));
    CHECK_THAT(bytesOf(folder / "doubles.glsl"), !ContainsSubstring("#error") && ContainsSubstring("double "));
    folder.mustFail(kNoises + "-dfvn -write coordinates=doubles flow.wgsl",
                    {"coordinates=doubles is only for GLSL 4.50"});
}

TEST_CASE("write: a flow in the plane, and a sum without tracks, are written as shaders", "[app][command]") {
    const Folder folder;
    folder.mustRun("-noise dimensions=2 frequency=2 -dfvn -write origin=0.5,0,0 plane.glsl");
    CHECK_THAT(bytesOf(folder / "plane.glsl"), ContainsSubstring("vec2 flowStep(vec2 p, float track, float dt)") &&
                                                   ContainsSubstring("relative to (0.5, 0)"));
    folder.mustRun("-noise -noise seed=1 -noise seed=2 -curl -write curl.glsl");
    CHECK_THAT(bytesOf(folder / "curl.glsl"), ContainsSubstring("vec3 flowStep(vec3 p, float dt)"));
}

TEST_CASE("write: the data of a level set is beside its shader", "[app][command]") {
    const Folder folder;
    const std::string bounded =
        "-read " + sourceDir() + "/scenes/spot.obj -mesh2ls dim=60 " + kNoises + "-bound width=0.3 -dfvn ";
    folder.mustRun(bounded + "-write flow.glsl");
    CHECK_THAT(bytesOf(folder / "flow.glsl"), ContainsSubstring("flowData1: "));
    CHECK(fs::file_size(folder / "flow.glsl.bin") > 100000);
    folder.mustFail(bounded + "-write - format=glsl", {"data file beside it", "must end with .glsl"});
}

TEST_CASE("write: a flow is written as a page, with its wall and the command", "[app][command]") {
    const Folder folder;
    const auto outcome = folder.mustRun(
        "-set n=2 -noise 'frequency={n}' -noise frequency=2 seed=1 -sphere -bound -dfvn -write look.html");
    CHECK_THAT(outcome.err, ContainsSubstring("wrote look.html: a flow in 3 dimensions as a page, "));
    CHECK(folder.names() == std::set<std::string>{"look.html"});
    const std::string page = bytesOf(folder / "look.html");
    CHECK_THAT(page, ContainsSubstring("<title>Curlew · look</title>") && ContainsSubstring("id=\"corners\"") &&
                         ContainsSubstring("curlew \\\n  -noise ") && ContainsSubstring(" \\\n  -write look.html"));
    CHECK(page.size() < 300000);
    folder.mustRun("-noise dimensions=2 frequency=2 -dfvn -write plane.html -write - format=html");
    CHECK_THAT(bytesOf(folder / "plane.html"), ContainsSubstring("dimension: 2"));
}

TEST_CASE("write: what cannot be a page is an error", "[app][command]") {
    const Folder folder;
    folder.mustFail(kNoises + "-write look.html", {"needs a flow"});
    folder.mustFail(kNoises + "-dfvn -write corrections=3 look.html", {"corrections= is only for .glsl"});
    folder.mustFail(kNoises + "-dfvn -write missing/folder/look.html", {"missing/folder"});
    CHECK(folder.names().empty());
}

TEST_CASE("write: what cannot be a shader is an error", "[app][command]") {
    const Folder folder;
    folder.mustFail(kNoises + "-write flow.glsl", {"needs a flow"});
    folder.mustFail(kNoises + "-dfvn -velocity dim=8 -write dialect=es v.vdb", {"dialect= is only for .glsl"});
    folder.mustFail(
        "-noise dimensions=4 type=simplex -noise dimensions=4 type=simplex seed=1 -noise dimensions=4 "
        "type=simplex seed=2 -dfvn -write flow.glsl",
        {"4 dimensions", "-lift"});
}
