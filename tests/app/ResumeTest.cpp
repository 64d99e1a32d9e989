// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Digest.h"
#include "support/Catch.h"
#include "support/Command.h"
#include "support/SessionCommand.h"

#include <fmt/format.h>

#include <cstring>

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::ContainsSubstring;
using test::bytesOf;
using test::Folder;

namespace {

/// Existing points, births and deaths, and an animated flow: all state that the next frame can depend on.
std::string scene(const std::string& frames = "1-6") {
    return "-quiet -noise seed=9 -scatter count=200 box=-1,-1,-1,1,1,1 -frames " + frames +
           " fps=10 checkpoint=run.checkpoint -noise frequency=2 alpha='{2*pi*T}' -noise frequency=2 seed=2 -dfvn "
           "speed=1 -advect duration='{1/fps}' steps=3 -sphere radius=0.3 translate='{T},0,0' -emit rate=977 life=0.3 "
           "spread=0.5 -kill box=-1,-1,-1,1,1,1 -write 'p.$F4.vdb' 'p.$F4.ply' 'p.$F4.csv'";
}

const std::vector<std::string>& outputs() {
    static const std::vector<std::string> kOutputs = [] {
        std::vector<std::string> names{"run.checkpoint"};
        for (int frame = 1; frame <= 6; ++frame)
            for (const char* kind : {"vdb", "ply", "csv"}) names.push_back(fmt::format("p.{:04}.{}", frame, kind));
        return names;
    }();
    return kOutputs;
}

void requireSame(const Folder& a, const Folder& b) {
    for (const auto& name : outputs()) {
        CAPTURE(name);
        REQUIRE(!bytesOf(a / name).empty());
        REQUIRE((bytesOf(a / name) == bytesOf(b / name)));
    }
}

} // namespace

TEST_CASE("resume: a killed and resumed run gives the same bytes as an uninterrupted one", "[app][command]") {
    const Folder whole, killed;
    whole.mustRun(scene());
    // The process is killed during the fourth frame or a little later.
    killed.shell("\"$curlew\" " + scene() +
                 " & p=$!\nwhile [ ! -e p.0003.csv ]; do sleep 0.001; done\nkill -9 $p\nwait");
    REQUIRE(std::filesystem::exists(killed / "run.checkpoint"));
    killed.mustRun("-threads 1 " + scene() + " -resume"); // the number of threads may differ
    requireSame(whole, killed);
    // The run is complete, so resuming again does nothing.
    std::filesystem::remove(killed / "p.0006.ply");
    killed.mustRun(scene() + " -resume");
    CHECK_FALSE(std::filesystem::exists(killed / "p.0006.ply"));
}

TEST_CASE("resume: a run can continue after any frame and beyond its original range", "[app][command]") {
    const Folder whole, pieces;
    whole.mustRun(scene());
    for (const char* frames : {"1-1", "1-2", "1-4", "1-6"}) {
        for (const auto& name : pieces.names())
            if (name != "run.checkpoint" && !name.starts_with("keep"))
                std::filesystem::rename(pieces / name, pieces / ("keep." + name));
        pieces.mustRun("-resume " + scene(frames)); // the first run has no checkpoint
    }
    for (const auto& name : pieces.names())
        if (name.starts_with("keep.")) std::filesystem::rename(pieces / name, pieces / name.substr(5));
    requireSame(whole, pieces);
}

TEST_CASE("resume: a checkpoint needs one name for all frames", "[app][command]") {
    const Folder folder;
    const std::string scene = "-sphere -scatter count=5 -frames 1-2 ";
    folder.mustFail(scene + "checkpoint= -print", {"checkpoint= is empty"});
    folder.mustFail(scene + "'checkpoint=c.$F4' -print", {"-frames", "F, FF and T have no value"});
}

TEST_CASE("resume: says if there is nothing left to do", "[app][command]") {
    const Folder folder;
    const std::string scene = "-sphere -scatter count=5 -frames 1-2 checkpoint=c -write p.##.csv ";
    folder.mustRun(scene);
    CHECK_THAT(folder.mustRun(scene + "-resume").err, ContainsSubstring("all frames up to 2 are done"));
}

TEST_CASE("resume: a cancelled run leaves the checkpoint of its last complete frame", "[app]") {
    const Folder folder;
    const std::string text =
        "scatter count=50 box=0,0,0,1,1,1\nframes 1-9 \"checkpoint=" + (folder / "run.checkpoint").string() +
        "\"\nnoise\nnoise seed=1\ndfvn\nadvect duration=0.1 steps=1";
    bool stop = false;
    int runs = 0;
    Console console([&] { return stop; });
    console.setVerbosity(Verbosity::quiet);
    const auto count = [&](Context& c) {
        ++runs;
        stop = c.clock()->frame == 4;
    };
    test::Scenes scenes(count, console);
    CHECK_THROWS_AS(scenes.run(text + "\nhere\nnoise"), Interrupted);
    CHECK(runs == 4);
    stop = false;
    test::Scenes again(count, console);
    CHECK_THROWS_AS(again.run(text + "\nhere\nnoise\nresume"), Interrupted); // stops in frame 4 again
    CHECK(runs == 5);                                                        // frame 4 was not complete
}

TEST_CASE("resume: a damaged checkpoint or one of another program is refused", "[app][command]") {
    const Folder folder;
    folder.mustRun(scene("1-2"));
    const std::string good = bytesOf(folder / "run.checkpoint");
    const std::string resume = "-resume " + scene("1-3");
    const auto damaged = [&](const std::string& bytes) {
        test::store(folder / "run.checkpoint", bytes);
        folder.mustFail(resume, {"-resume", "'run.checkpoint'", "damaged"});
    };
    damaged("");
    damaged("what is this");
    damaged(good.substr(0, good.size() - 1));
    damaged(good.substr(0, 20));
    damaged(good + "x");
    for (const size_t place : {size_t{25}, good.size() / 2, good.size() - 1}) {
        CAPTURE(place);
        std::string bytes = good;
        bytes[place] = static_cast<char>(bytes[place] ^ 0x10);
        damaged(bytes);
    }
    test::store(folder / "run.checkpoint", good);
    std::string other = resume;
    other.replace(other.find("rate=977"), 8, "rate=978");
    folder.mustFail(other, {"another program"});
    folder.mustFail("-resume " + scene("2-3"), {"another program"}); // other times
    folder.mustRun("-threads 1 " + resume);                          // does not affect the results
}

TEST_CASE("resume: a checkpoint is refused if an input file has changed", "[app][command]") {
    const Folder folder;
    folder.mustRun("-quiet -scatter count=9 box=-1,-1,-1,1,1,1 -write p.0001.vdb p.0002.vdb p.0003.vdb");
    test::store(folder / "ball.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n# end\n");
    const auto run = [](const std::string& frames) {
        return "-quiet -read ball.obj -scatter count=20 box=-1,-1,-1,1,1,1 -frames " + frames +
               " checkpoint=run.checkpoint -read 'p.$F4.vdb' -noise -noise seed=1 -dfvn -advect duration=0.1 steps=1";
    };
    const auto change = [&](const std::string& file) { // changes one byte and keeps the time of the file
        std::string bytes = bytesOf(folder / file);
        const auto time = std::filesystem::last_write_time(folder / file);
        char& byte = bytes[file.ends_with(".obj") ? bytes.size() - 2 : bytes.size() / 2];
        byte = static_cast<char>(byte ^ 1);
        test::store(folder / file, bytes);
        std::filesystem::last_write_time(folder / file, time);
    };
    folder.mustRun(run("1-2"));
    const std::string good = bytesOf(folder / "run.checkpoint");
    folder.mustRun("-resume " + run("1-3"));
    for (const char* file : {"ball.obj", "p.0001.vdb", "p.0002.vdb"}) {
        CAPTURE(file);
        test::store(folder / "run.checkpoint", good);
        change(file);
        folder.mustFail("-resume " + run("1-3"), {"-resume", "has changed since the checkpoint 'run.checkpoint'"});
        change(file);
    }
    folder.mustRun("-resume " + run("1-3"));
}

TEST_CASE("resume: a forged checkpoint with inconsistent arrays is refused", "[app][command]") {
    const Folder folder;
    folder.mustRun(scene("1-2"));
    const std::string good = bytesOf(folder / "run.checkpoint");
    // Magic number, program, frame, states; then the key, next id, identity and frame of the track; then x, y, …, each
    // with its size.
    const size_t x = 8 + 16 + 4 + 8 + 16 + 8 + 16 + 4;
    uint64_t size = 0;
    std::memcpy(&size, &good[x], sizeof size);
    REQUIRE(size > 100);
    for (const size_t shorter : {uint64_t{0}, uint64_t{1}, size / 2}) {
        std::string forged = good.substr(0, good.size() - sizeof(Digest));
        const size_t y = x + 8 + 8 * size;
        std::memcpy(&forged[y], &shorter, sizeof shorter);
        forged.erase(y + 8 + 8 * shorter, 8 * (size - shorter));
        const Digest digest = DigestBuilder().addBytes(forged.data(), forged.size()).digest();
        forged.append(reinterpret_cast<const char*>(&digest), sizeof digest);
        test::store(folder / "run.checkpoint", forged);
        folder.mustFail("-resume " + scene("1-3"), {"'run.checkpoint'", "damaged"});
    }
}

TEST_CASE("resume: an unwritable checkpoint is reported before the work", "[app][command]") {
    const Folder folder;
    folder.mustFail("-frames 1-2 checkpoint=missing/too/a -noise", {"-frames", "missing/too/a"});
}
