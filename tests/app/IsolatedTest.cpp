// SPDX-License-Identifier: Apache-2.0
// Point files and .exr files are read by a child process, which may crash or hang without harm.

#include "support/Catch.h"
#include "support/Command.h"
#include "support/Places.h"

#include <chrono>
#include <random>

using namespace curlew;
using test::bytesOf;
using test::Folder;

namespace {

/// Writes a script that replaces the reader program.
void reader(const Folder& folder, const std::string& script) {
    test::store(folder / "reader", "#!/bin/sh\n" + script + "\n");
    std::filesystem::permissions(folder / "reader", std::filesystem::perms::owner_all);
}

test::Outcome withReader(const Folder& folder, const std::string& arguments) {
    return folder.shell("CURLEW_READER=./reader \"$curlew\" " + arguments);
}

} // namespace

TEST_CASE("isolated reading: gives the same objects as reading in the same process", "[app][command]") {
    const Folder folder;
    folder.mustRun(
        "-quiet -scatter count=500 box=-1,-1,-1,1,1,1 -noise -noise seed=1 -dfvn -velocity dim=16 -write mixed.vdb");
    folder.mustRun("-quiet -scatter count=500 box=-1,-1,-1,1,1,1 -write points.vdb");
    folder.mustRun("-quiet -noise -slice width=16 -write a.exr");
    const auto copy = [&](const std::string& reading, const std::string& from, const std::string& to) {
        CHECK(folder.shell(reading + "\"$curlew\" -quiet -read " + from + " -write " + to).status == 0);
        return bytesOf(folder / to);
    };
    std::filesystem::copy_file(test::sourceDir() + "/scenes/walker.glb", folder / "walker.glb");
    for (const std::string file : {"points.vdb", "mixed.vdb", "a.exr", "walker.glb"}) {
        CAPTURE(file);
        const std::string written = file == "walker.glb" ? "walker.ply" : file;
        const std::string apart = copy("", file, "1-" + written), here = copy("CURLEW_READER= ", file, "2-" + written);
        CHECK(!apart.empty());
        CHECK((apart == here));
    }
}

TEST_CASE("isolated reading: a crash or invalid answer of the reader is an error of the file", "[app][command]") {
    const Folder folder;
    folder.mustRun("-quiet -scatter count=50 box=-1,-1,-1,1,1,1 -write p.vdb");
    folder.mustRun("-quiet -noise -slice width=16 -write p.exr");
    test::store(folder / "p.glb", bytesOf(test::sourceDir() + "/scenes/walker.glb"));
    for (const char* script : {"kill -SEGV $$", "kill -ABRT $$", "exit 0", "exit 1", "echo nonsense >&3",
                               "head -c 99 /dev/zero >&3", "printf '\\001\\0\\0\\0\\0\\0\\0\\0' >&3",
                               "printf '\\001\\0\\0\\0\\0\\0\\0\\0\\377\\377\\377\\377\\377\\377\\377\\377' >&3",
                               // a part of 1 GB that never arrives; success without any part
                               "printf '\\001\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\100\\0\\0\\0\\0' >&3",
                               "printf '\\002\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0' >&3"})
        for (const char* file : {"p.vdb", "p.exr", "p.glb"}) {
            CAPTURE(script, file);
            reader(folder, script);
            const test::Outcome outcome = withReader(folder, std::string("-quiet -read ") + file);
            CHECK(outcome.status == 1);
            CHECK_THAT(outcome.err, Catch::ContainsSubstring(file));
            // Only a signal, or an answer that makes no sense, is a sign of damage.
            const std::string_view does = script;
            if (does.starts_with("exit")) CHECK_THAT(outcome.err, Catch::ContainsSubstring("without an answer"));
            if (does.starts_with("kill")) CHECK_THAT(outcome.err, Catch::ContainsSubstring("is damaged"));
        }
    const test::Outcome missing = folder.shell("CURLEW_READER=./missing \"$curlew\" -quiet -read p.vdb");
    CHECK_THAT(missing.err, Catch::ContainsSubstring("cannot start a process"));
}

TEST_CASE("isolated reading: errors of the reader are reported by the command", "[app][command]") {
    const Folder folder;
    folder.mustRun("-quiet -scatter count=50 box=-1,-1,-1,1,1,1 -write p.vdb");
    std::string bytes = bytesOf(folder / "p.vdb");
    bytes[bytes.size() - 9] = static_cast<char>(bytes[bytes.size() - 9] ^ 1);
    test::store(folder / "p.vdb", bytes);
    folder.mustFail("-read p.vdb", {"'p.vdb' is damaged", "its content does not match its checksum"});
}

TEST_CASE("isolated reading: a damaged model never ends the command by a signal", "[app]") {
    const Folder folder;
    const std::string whole = bytesOf(test::sourceDir() + "/scenes/walker.glb");
    std::mt19937 random(5);
    int refused = 0;
    for (int n = 0; n < 40; ++n) {
        std::string bytes = whole;
        // In the JSON chunk, which comes first: half of the damages change a digit, half any byte.
        for (int hits = 0; hits < 3;) {
            const size_t at = 20 + random() % 4000;
            const bool digit = bytes[at] >= '0' && bytes[at] <= '9';
            if (n % 2 == 0 && !digit) continue;
            bytes[at] = static_cast<char>(n % 2 == 0 ? '0' + random() % 10 : random() % 256);
            ++hits;
        }
        test::store(folder / "d.glb", bytes);
        const test::Outcome outcome = folder.shell("\"$curlew\" -quiet -read d.glb");
        CAPTURE(n, outcome.err);
        CHECK((outcome.status == 0 || outcome.status == 1));
        if (outcome.status == 1) CHECK_THAT(outcome.err, Catch::ContainsSubstring("d.glb"));
        refused += outcome.status;
    }
    CHECK(refused > 0);
}

TEST_CASE("isolated reading: a reader that hangs ends with the command", "[app][command]") {
    const Folder folder;
    folder.mustRun("-quiet -scatter count=50 box=-1,-1,-1,1,1,1 -write p.vdb");
    reader(folder, "echo $$ > pid\nexec sleep 1000");
    const test::Outcome outcome = folder.shell(
        "CURLEW_READER=./reader \"$curlew\" -quiet -read p.vdb & p=$!\n"
        "while [ ! -s pid ]; do sleep 0.01; done\nkill -INT $p\nwait $p");
    CHECK(outcome.status != 0);
    CHECK_THAT(outcome.err, Catch::ContainsSubstring("interrupted"));
    CHECK(folder.shell("kill -0 $(cat pid)").status != 0);
}
