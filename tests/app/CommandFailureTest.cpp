// SPDX-License-Identifier: Apache-2.0
#include "support/Catch.h"
#include "support/Command.h"
#include "support/Samples.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

using namespace curlew;
using test::Folder;
using test::store;
namespace fs = std::filesystem;

// User errors. Each failure prints one line that names the error, returns a nonzero status and leaves no file;
// Folder::mustFail checks all three.

namespace {

const std::string kFlow = "-noise seed=1 -noise seed=2 -dfvn ";

const std::string kPoints = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
const std::string kTetrahedron = kPoints + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

std::string firstHalf(const fs::path& path) {
    const std::string bytes = test::bytesOf(path);
    return bytes.substr(0, bytes.size() / 2);
}

/// Quotes a text for the shell.
std::string quoted(const std::string& text) { return "'" + text + "'"; }

} // namespace

TEST_CASE("command failure: missing and empty and foreign files are refused by every reader", "[app][command]") {
    const Folder folder;
    const std::string png = "\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + std::string(200, '\x7f');
    for (const std::string name : {"a.obj", "a.ply", "a.stl", "a.vdb", "a.glb", "a.gltf", "a.fbx", "a.dae", "a.csv"}) {
        CAPTURE(name);
        const std::string read = "-read " + name + " -print";
        folder.mustFail(read, {"-read", name, "no such file"});
        store(folder / name, "");
        folder.mustFail(read, {"-read", name, "empty"});
        store(folder / name, png);
        folder.mustFail(read, {"-read", name});
        store(folder / name, std::string(1000, '\0'));
        folder.mustFail(read, {"-read", name});
        store(folder / name, "This is a letter to my aunt.\nDear aunt,\n");
        folder.mustFail(read, {"-read", name});
        fs::remove(folder / name);
        fs::create_directory(folder / name);
        folder.mustFail(read, {"-read", name, "folder"});
    }
    folder.mustFail("-read mesh.blend", {"-read", "mesh.blend", ".gltf .glb .fbx"});
    folder.mustFail("-read ''", {"-read", "''"});
    folder.mustFail("-read .", {"-read", "'.'"});
    folder.mustFail("-noise -probe none.csv out.csv", {"-probe", "none.csv", "no such file"});
    store(folder / "in.csv", png);
    folder.mustFail("-noise -probe in.csv out.csv", {"-probe", "in.csv", "x,y,z"});
    store(folder / "in.csv", "x,y,z\n0,0,0\n1,nan,0\n");
    folder.mustFail("-noise -probe in.csv out.csv", {"-probe", "in.csv", "line 3", "'nan'"});
    folder.mustFail("-config none.txt", {"-config", "none.txt", "no such file"});
    store(folder / "scene.txt", std::string(1000, '\x01'));
    folder.mustFail("-config scene.txt", {"scene.txt:1"});
}

TEST_CASE("command failure: truncated files are refused by every reader", "[app][command]") {
    const Folder folder;
    folder.mustRun(kFlow + "-velocity dim=8 -write a.vdb -scatter count=100 -write p.vdb");
    for (const std::string name : {"a.vdb", "p.vdb"}) {
        store(folder / name, firstHalf(folder / name));
        folder.mustFail("-read " + name, {"-read", name, "cut short"});
    }
    store(folder / "a.obj", kTetrahedron.substr(0, kTetrahedron.size() - 5));
    folder.mustFail("-read a.obj", {"-read", "a.obj", "line 8"});
    store(folder / "a.ply",
          "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
          "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n");
    folder.mustFail("-read a.ply", {"-read", "a.ply", "cut short"});
    std::string stl(84, '\0');
    stl[80] = 2; // the header claims two triangles, the file has one
    store(folder / "a.stl", stl + std::string(50, '\0'));
    folder.mustFail("-read a.stl", {"-read", "a.stl"});
    store(folder / "in.csv", "x,y,z\n0,0,0\n1,2");
    folder.mustFail("-noise -probe in.csv out.csv", {"-probe", "in.csv", "line 3"});
    store(folder / "scene.txt", "noise\nnoise \\");
    folder.mustFail("-config scene.txt", {"scene.txt", "\\"});
}

TEST_CASE("command failure: meshes that enclose nothing are refused", "[app][command]") {
    const Folder folder;
    const auto levelSet = [&](const std::string& mesh, const std::vector<std::string>& says) {
        CAPTURE(mesh);
        store(folder / "mesh.obj", mesh);
        folder.mustFail("-read mesh.obj -mesh2ls dim=20 -write ls.vdb", says);
    };
    levelSet("v 0 0 0\nv nan 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n", {"-read", "mesh.obj", "not a finite number"});
    levelSet("v 0 0 0\nv 1e999 0 0\nv 0 1 0\nf 1 2 3\n", {"-read", "mesh.obj", "not a finite number"});
    levelSet(kPoints, {"-read", "mesh.obj", "no faces"});
    levelSet(kPoints + "p 3\n", {"-read", "mesh.obj", "no faces"});
    levelSet(kPoints + "f 1 2 9\n", {"-read", "mesh.obj", "line 5", "9"});
    levelSet("v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n", {"-mesh2ls", "encloses nothing", "thickness="}); // a sheet
    levelSet(kPoints + "f 1 1 1\nf 2 2 3\n", {"-mesh2ls", "degenerate"});
    levelSet("v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\nf 3 2 1\n", {"-mesh2ls"});    // zero area
    levelSet(kPoints + "f 1 2 3\nf 3 2 1\n", {"-mesh2ls", "encloses nothing"}); // closed, but flat
    levelSet("v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n", {"-mesh2ls"});
}

TEST_CASE("command: a mesh with a hole becomes a solid and the hole is reported", "[app][command]") {
    const Folder folder;
    store(folder / "mesh.obj", kPoints + "f 1 3 2\nf 1 2 4\nf 2 3 4\n"); // one face is missing
    const auto outcome = folder.mustRun("-read mesh.obj -mesh2ls dim=20 -write ls.vdb");
    CHECK_THAT(outcome.out + outcome.err, Catch::ContainsSubstring("3 boundary edges"));
    // If thickness= is given, any mesh becomes a sheet.
    folder.mustRun("-read mesh.obj -mesh2ls dim=20 thickness=0.2 -write sheet.vdb");
    folder.mustFail("-read mesh.obj -mesh2ls dim=20 thickness=0", {"thickness"});
}

TEST_CASE("command failure: invalid sizes and sizes beyond memory are refused", "[app][command]") {
    const Folder folder;
    store(folder / "mesh.obj", kTetrahedron);
    const std::string mesh = "-read mesh.obj -mesh2ls ", ball = "-sphere -noise -noise seed=1 -bound -dfvn -velocity ",
                      open = kFlow + "-velocity ", end = " -write out.vdb";
    for (const auto& job : {mesh, open, ball}) {
        for (const std::string size :
             {"voxel=0", "voxel=-1", "voxel=nan", "voxel=inf", "voxel=1e999", "voxel=", "voxel=0x1", "voxel=1,5",
              "dim=0", "dim=-3", "dim=1.5", "dim=1e7", "dim=1e999", "dim=nan", "dim=many"})
            folder.mustFail(job + size + end, {size, "must be"});
        for (const std::string size : {"dim=1000000", "voxel=1e-9", "voxel=1e-300"})
            folder.mustFail(job + size + end, {"iB of memory", "are available", "choose"});
    }
    folder.mustFail(mesh + "dim=10 halfWidth=0" + end, {"halfWidth=0", "at least 1"});
    folder.mustFail(mesh + "dim=10 halfWidth=1e4" + end, {"halfWidth=1e4", "at most 1000"});
    folder.mustFail(mesh + "dim=30 halfWidth=1000" + end,
                    {"-mesh2ls", "iB of memory", "half width"}); // 4e9 voxels around it
    folder.mustFail(mesh + "dim=10 -noise -noise seed=1 -bound layer=1e6 -dfvn -velocity" + end, {"-bound", "memory"});
    folder.mustFail("-sphere radius=1e-5 -noise -noise seed=1 -bound -dfvn -velocity" + end,
                    {"-velocity", "too small"});
    folder.mustFail("-box size=1e-3 rounding=0 -noise -noise seed=1 -bound -dfvn -velocity dim=1000" + end,
                    {"-velocity", "too small"});
}

TEST_CASE("command failure: invalid counts and counts beyond memory are refused", "[app][command]") {
    const Folder folder;
    const std::string scatter = "-scatter box=0,0,0,1,1,1 ";
    for (const std::string count :
         {"count=0", "count=-1", "count=1.5", "count=1e16", "count=1e999", "count=nan", "count="})
        folder.mustFail(scatter + count + " -write p.ply", {"-scatter", count, "must be"});
    for (const std::string count : {"count=1e12", "count=1e15"})
        folder.mustFail(scatter + count + " -write p.ply", {"-scatter", "points would need about", "iB of memory"});
    folder.mustFail(kFlow + "-check samples=1e9 report=a.json", {"-check", "samples", "iB of memory"});
    folder.mustFail(scatter + "seed=9007199254740993",
                    {"seed=9007199254740993", "whole number"}); // not representable as a double
    folder.mustFail(scatter + "seed=-1", {"seed=-1"});
    for (const std::string threads : {"-1", "1.5", "abc", "1e9", "''", "nan"})
        folder.mustFail("-threads " + threads, {"-threads", "whole number"});
}

TEST_CASE("command failure: misspelt names are reported with a suggestion", "[app][command]") {
    const Folder folder;
    folder.mustFail("-nosie", {"'-nosie'", "'noise'"});
    folder.mustFail("-Mesh2LS", {"'mesh2ls'"});
    folder.mustFail("-teapot", {"'-teapot'", "-list"});
    for (const std::string word : {"noise", "", " ", "=", "-"}) {
        const auto outcome = folder.run(quoted(word));
        CHECK(outcome.status == 1);
        CHECK_THAT(outcome.err,
                   Catch::StartsWith("curlew: '" + word + "' is not an action") && Catch::ContainsSubstring("dash"));
        CHECK(test::linesIn(outcome.err) == 1);
    }
    folder.mustFail("-noise freqency=2", {"-noise", "'freqency'", "'frequency'"});
    folder.mustFail("-noise o=2", {"-noise", "'o'", "octaves or octaveAlpha"});
    folder.mustFail("-noise seed=1 seed=2", {"-noise", "'seed'", "twice"});
    folder.mustFail("-noise seed", {"-noise", "'seed'", "name=value"});
    folder.mustFail("-noise type=prsd", {"-noise", "type=prsd", "'psrd'"});
    folder.mustFail("-advect scheme=rk5", {"-advect", "scheme=rk5", "'rk4'", "midpoint"});
    folder.mustFail("-read a=b.obj", {"-read", "'a'", "./a=b.obj"});
    folder.mustFail("-write a.txt", {"-write", "a.txt", ".vdb"});
    folder.mustFail("-write", {"-write", "FILE"});
    folder.mustFail("-write ''", {"-write", "''"});
    folder.mustFail(quoted("-no\nise"), {"-no\\x0aise"}); // the message stays on one line
    folder.mustFail("-read " + quoted("a\nb\x1b[31m.obj"), {"a\\x0ab\\x1b[31m.obj"});
    folder.mustFail("-noise " + std::string(100000, 'x'), {"xxx …"});
    for (const std::string value :
         {"frequency=-1", "frequency=0", "octaves=0", "octaves=1e6", "lacunarity=nan", "period=1.5", "period=-1",
          "period=1e9", "alpha=inf", "translate=1,2", "normalize=yes"})
        folder.mustFail("-noise " + value, {"-noise", value.substr(0, value.find('='))});
    folder.mustFail("-noise -slice width=0", {"-slice", "width=0"});
    folder.mustFail("-noise -slice box=1,1,1,0,0,0", {"-slice", "box=1,1,1,0,0,0", "empty"});
    folder.mustFail("-sphere radius=0", {"-sphere", "radius=0"});
    folder.mustFail("-plane normal=0", {"-plane", "normal"});
    folder.mustFail("-box size=1 rounding=5", {"-box", "rounding"});
    folder.mustFail("-torus radius=1 tube=2", {"-torus"});
}

TEST_CASE("command failure: actions without their inputs say what to make first", "[app][command]") {
    const Folder folder;
    folder.mustFail("-dfvn", {"-dfvn", "a field", "none", "-noise"});
    folder.mustFail("-noise -dfvn", {"-dfvn", "a field", "only one"});
    folder.mustFail("-noise -noise -dfvn", {"-dfvn", "does not move", "seed"});
    folder.mustFail("-constant -constant value=2 -dfvn speed=1", {"-dfvn", "does not move"});
    folder.mustFail("-noise -sum", {"-sum", "a field", "only one"});
    folder.mustFail("-product", {"-product", "a field", "none"});
    folder.mustFail("-transform", {"-transform", "a field", "none"});
    folder.mustFail("-velocity", {"-velocity", "a flow", "none", "-dfvn"});
    folder.mustFail("-noise -noise seed=1 -velocity", {"-velocity", "a flow", "none", "-dfvn"});
    folder.mustFail("-advect", {"-advect", "-scatter"});
    folder.mustFail("-scatter box=0,0,0,1,1,1 count=10 -advect", {"-advect", "a flow", "none"});
    folder.mustFail("-scatter", {"-scatter", "a shape or a level set", "none"});
    folder.mustFail("-noise -bound", {"-bound", "a shape or a level set", "none", "-sphere"});
    folder.mustFail("-sphere -bound", {"-bound", "a field for noise=", "none"});
    folder.mustFail("-sphere -noise -bound grid=0", {"-bound", "no grid"});
    folder.mustFail("-mesh2ls", {"-mesh2ls", "a mesh", "none", "-read"});
    folder.mustFail("-slice", {"-slice", "a flow or a field", "none"});
    folder.mustFail("-noise -slice show=speed", {"-slice", "show=speed", "needs a flow"});
    folder.mustFail("-check", {"-check", "nothing to check"});
    store(folder / "in.csv", "x,y,z\n0,0,0\n");
    folder.mustFail("-probe in.csv out.csv", {"-probe", "a field or a flow or a level set", "none"});
    for (const std::string name : {"a.vdb", "a.ply", "a.csv", "a.png", "a.exr"})
        folder.mustFail("-noise -write " + name, {"-write", "there "});
    folder.mustFail(kFlow + "-velocity dim=8 -write grid=3 a.vdb", {"-write", "no grid of age 3", "is 1"});
    folder.mustRun(kFlow + "-velocity dim=8 -write a.vdb");
    folder.mustFail("-read a.vdb grids=temperature", {"-read", "a.vdb", "vel"});
    folder.mustFail("-read a.vdb -noise -bound grid=0", {"-bound", "wall=", "is a velocity grid"});
}

TEST_CASE("command failure: an unwritable output is reported before the work", "[app][command]") {
    const Folder folder;
    fs::create_directory(folder / "folder.vdb");
    store(folder / "in.csv", "x,y,z\n0,0,0\n");
    // Computing this noise of 32 octaves would take minutes.
    const std::string work = "-noise octaves=32 -slice width=32768 ";
    folder.mustFail(work + "-write missing/too/a.png", {"-write", "missing/too/a.png", "folder 'missing'"});
    folder.mustFail(work + "-write a.png folder.vdb", {"-write", "folder.vdb"});
    folder.mustFail(work + "-write in.csv/a.png", {"-write", "in.csv/a.png"});
    folder.mustFail(work + "-report missing/too/a.json", {"-report", "missing/too/a.json"});
    folder.mustFail(work + "-check report=missing/too/a.json", {"-check", "missing/too/a.json"});
    folder.mustFail(work + "-probe in.csv missing/too/out.csv", {"-probe", "missing/too/out.csv"});
    if (::geteuid() != 0) {
        fs::create_directory(folder / "locked");
        fs::permissions(folder / "locked", fs::perms::owner_read | fs::perms::owner_exec);
        folder.mustFail(work + "-write locked/a.png", {"-write", "locked/a.png", "permission"});
    }
    // Targets where only an attempt to write shows the error.
    folder.mustFail(kFlow + "-velocity dim=8 -write /proc/a.vdb", {"-write", "/proc/a.vdb"});
    folder.mustFail("-scatter box=0,0,0,1,1,1 count=10 -write /proc/a.ply", {"-write", "/proc/a.ply"});
    folder.mustFail("-noise -slice width=8 -write /proc/a.png", {"-write", "/proc/a.png"});
    folder.mustFail("-noise -slice width=8 -write /proc/a.exr", {"-write", "/proc/a.exr"});
}

TEST_CASE("command failure: a full disk leaves earlier files unchanged and no new ones", "[app][command]") {
    const Folder folder;
    const std::string flow = kFlow + "-velocity dim=40 -scatter count=20000 -slice width=300 ";
    const std::string name = GENERATE("a.vdb", "a.ply", "a.csv", "a.exr", "a.png", "probe.csv");
    CAPTURE(name);
    std::string positions = "x,y,z\n";
    for (int k = 0; k < 2000; ++k) positions += fmt::format("{},0,0\n", 0.1 * k);
    store(folder / "in.csv", positions);
    store(folder / name, "what was there before");
    const std::string write =
        name == "probe.csv" ? "-probe in.csv probe.csv" : (name == "a.vdb" ? "-write grid=0 " : "-write ") + name;
    // A file size limit of 8 KiB stands for a full disk.
    const auto outcome = folder.shell("ulimit -f 16; curlew -quiet " + flow + write);
    CAPTURE(outcome.out, outcome.err);
    CHECK(outcome.status == 1);
    CHECK(test::linesIn(outcome.err) == 1);
    CHECK_THAT(outcome.err, Catch::StartsWith("curlew: -") && Catch::ContainsSubstring(name));
    CHECK(folder.names() == std::set<std::string>{"in.csv", name});
    CHECK(test::bytesOf(folder / name) == "what was there before");
    // Without the limit, the run succeeds.
    folder.mustRun("-quiet " + flow + write);
    CHECK(fs::file_size(folder / name) > 8192);
}

TEST_CASE("command: pipes and devices are written in place and link targets are replaced", "[app][command]") {
    const Folder folder;
    store(folder / "target.png", "old");
    fs::create_symlink("target.png", folder / "link.png");
    folder.mustRun("-noise -slice width=8 -write link.png");
    CHECK(fs::is_symlink(folder / "link.png"));
    CHECK(test::bytesOf(folder / "target.png").substr(0, 4) == "\x89PNG");
    // What -print prints moves to the standard error stream.
    for (const std::string action : {"-report /dev/stdout", "-report -", "-check samples=100 report=-"}) {
        const auto run =
            folder.shell("curlew -noise -noise seed=1 -dfvn box=0,0,0,1,1,1 -print " + action + " 2>log | cat");
        CAPTURE(action);
        CHECK(run.status == 0);
        CHECK_THAT(run.out, Catch::StartsWith("{") && Catch::EndsWith("}\n"));
        CHECK_THAT(test::bytesOf(folder / "log"), Catch::ContainsSubstring("flow 0: "));
    }
    CHECK_FALSE(fs::exists(folder / "-"));
    CHECK(
        folder
            .shell("mkfifo pipe.png; curlew -quiet -noise -slice width=8 -write pipe.png & head -c 4 pipe.png; wait $!")
            .out == "\x89PNG");
    CHECK(fs::is_fifo(folder / "pipe.png"));
}

TEST_CASE("command: names with control characters or invalid UTF-8 are escaped", "[app][command]") {
    const Folder folder;
    const std::string name = "caf\xe9\x1b[31m.obj";
    folder.mustFail("-read '" + name + "'", {"caf\\xe9\\x1b[31m.obj"});
    store(folder / name, kTetrahedron);
    folder.mustRun("-read '" + name + "' -report a.json");
    CHECK(nlohmann::json::accept(test::bytesOf(folder / "a.json")));
}

TEST_CASE("command: an interrupt stops any work quickly and leaves no file", "[app][command]") {
    const Folder folder;
    const std::string slice = "-noise octaves=32 -slice width=20000 -write a.exr";
    const auto [job, signal] = GENERATE_COPY(table<std::string, std::string>(
        {{slice, "INT"},
         {slice, "TERM"},
         {slice, "HUP"},
         {"-noise seed=1 -noise seed=2 -dfvn -scatter count=1000 -advect steps=1e9 -write a.ply", "INT"},
         {"-noise octaves=32 -noise seed=1 -dfvn -velocity dim=500 -write a.vdb", "INT"},
         {"-noise octaves=32 -noise seed=1 -dfvn -check samples=1e8 report=a.json", "INT"}}));
    CAPTURE(job, signal);
    // The signal is sent after the first action has printed its line, however long that takes. Who runs the tests may
    // ignore hangups (nohup).
    const auto outcome =
        folder.shell("said=$(mktemp); env --default-signal=HUP \"$curlew\" -verbose " + job +
                     " 2>\"$said\" & pid=$!; while kill -0 $pid && ! [ -s \"$said\" ]; do sleep 0.05; done; "
                     "kill -s " +
                     signal + " $pid; wait $pid; status=$?; tail -n 1 \"$said\" >&2; rm \"$said\"; exit $status");
    CAPTURE(outcome.err);
    CHECK(outcome.status == 128 + std::map<std::string, int>{{"INT", 2}, {"TERM", 15}, {"HUP", 1}}.at(signal));
    CHECK(outcome.err == "curlew: interrupted; unfinished files have been removed\n");
    CHECK(folder.names().empty());
}

TEST_CASE("command: an interrupt ends work that does not poll for it, within seconds", "[app][command]") {
    const Folder folder;
    // OpenVDB compresses a large grid for many seconds without asking whether to stop. A second signal ends it at once.
    const std::string again = GENERATE("", "sleep 0.02; kill -s INT $pid 2>/dev/null; ");
    const auto outcome = folder.shell(
        "\"$curlew\" -verbose -noise -noise seed=1 -dfvn -velocity dim=240 -write codec=zip a.vdb 2>said & pid=$!; "
        "while kill -0 $pid && ! ls -A | grep -q 'part$'; do sleep 0.05; done; kill -s INT $pid; " +
        again +
        "timeout 20 tail --pid=$pid -f /dev/null; wait $pid; status=$?; tail -n 1 said >&2; rm said; exit $status");
    CAPTURE(outcome.err);
    CHECK(outcome.status == 130);
    CHECK(outcome.err == "curlew: interrupted; unfinished files have been removed\n");
    CHECK(folder.names().empty());
}

TEST_CASE("command: a hangup that the caller ignores (nohup) does not end the work", "[app][command]") {
    const Folder folder;
    const auto outcome = folder.shell(
        "trap '' HUP; \"$curlew\" -noise alpha={T} -slice width=600 -frames 1-5 -write 'a.$F.png' 2>/dev/null & "
        "pid=$!; until test -e a.1.png; do kill -0 $pid || exit 9; sleep 0.01; done; kill -s HUP $pid; wait $pid");
    CHECK(outcome.status == 0);
    CHECK(folder.names() == std::set<std::string>{"a.1.png", "a.2.png", "a.3.png", "a.4.png", "a.5.png"});
}

TEST_CASE("command: threads that cannot be started are an error (ulimit -u)", "[app][command]") {
    const Folder folder;
    if (folder.shell("ldd \"$curlew\" | grep -q libopenvdb").status == 0) {
        WARN("skipped: links the shared OpenVDB, whose log4cplus ends the program if it cannot start its threads");
        return;
    }
    // The limit does not apply to root.
    const auto outcome = folder.shell(
        "as=; if [ $(id -u) = 0 ]; then as='setpriv --reuid=65534 --regid=65534 --clear-groups'; fi; cd /; "
        "$as test -x \"$curlew\" || exit 77; "
        "$as bash -c 'ulimit -u 1; exec \"$0\" -quiet -threads 4 -noise -noise seed=1 -dfvn -check' \"$curlew\"");
    if (outcome.status == 77) {
        WARN("skipped: another user may not run the command");
        return;
    }
    CHECK(outcome.status == 1);
    CHECK(test::linesIn(outcome.err) == 1);
    CHECK_THAT(outcome.err, Catch::ContainsSubstring("pthread_create") && Catch::ContainsSubstring("ulimit -u"));
}

TEST_CASE("command: closed and unread output streams do not change the result", "[app][command]") {
    const Folder folder;
    const auto status = [&](const std::string& line) {
        CAPTURE(line);
        const auto outcome = folder.shell(line);
        CHECK(test::linesIn(outcome.err) <= 1);
        return outcome.status;
    };
    // A reader may close the pipe early: this is no error.
    const auto pipe = folder.shell("{ curlew -help format=markdown; echo $? >status; } | head -1");
    CHECK(test::linesIn(pipe.out) == 1);
    CHECK(test::bytesOf(folder / "status") == "0\n");
    for (const std::string stream : {"", " 2>&1"}) { // the run completes
        CAPTURE(stream);
        folder.shell(
            "{ sleep 0.2; curlew -verbose -scatter box=0,0,0,1,1,1 count=10 -frames 1-5 -print -write 'a.$F.ply'; echo "
            "$? "
            ">status; }" +
            stream + " | head -c 1");
        CHECK(test::bytesOf(folder / "status") == "0\n");
        CHECK(fs::exists(folder / "a.5.ply"));
        fs::remove(folder / "a.5.ply");
    }
    const std::string work = "curlew -noise -slice width=8 -write a.png ";
    for (const std::string streams : {"2>&-", "2>/dev/full", ">&-", ">/dev/full", "<&- >&- 2>&-"}) {
        fs::remove(folder / "a.png");
        CHECK(status(work + streams) == 0); // this run prints nothing to standard output
        CHECK(test::bytesOf(folder / "a.png").substr(0, 4) == "\x89PNG");
        CHECK(status("curlew -nosie " + streams) == 1);
    }
    CHECK(status("curlew -list >&-") == 1);
    CHECK(status("curlew -list >/dev/full") == 1);
}
