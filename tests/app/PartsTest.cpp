// SPDX-License-Identifier: Apache-2.0
// Points that are made in parts (EvaluatorParts.cpp).
#include "support/Catch.h"
#include "support/Command.h"
#include "support/SessionCommand.h"

#include <fmt/format.h>

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::ContainsSubstring;
using test::bytesOf;
using test::Folder;
using test::linesOf;
using test::Scenes;

namespace {

/// Returns the lines of a .csv without its header.
std::vector<std::string> rowsOf(const std::filesystem::path& csv) {
    std::vector<std::string> rows = linesOf(bytesOf(csv));
    REQUIRE(rows.size() > 1);
    rows.erase(rows.begin());
    return rows;
}

} // namespace

TEST_CASE("parts: together hold the same points as one piece, with and without frames", "[app][command]") {
    const Folder folder;
    const std::string flow = "-sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn speed=1 ";
    folder.mustRun(flow + "-scatter count=1001 -frames 1-3 -advect -write 'whole.$F.csv'");
    folder.mustRun(flow + "-scatter count=1001 part=each/4 -frames 1-3 -advect -write '$P.$F.csv'");
    for (const int frame : {1, 2, 3}) {
        std::vector<std::string> rows;
        for (const size_t part : {1, 2, 3, 4}) {
            const auto here = rowsOf(folder / fmt::format("{}.{}.csv", part, frame));
            CHECK(here.size() == (part == 1 ? 251 : 250));
            rows.insert(rows.end(), here.begin(), here.end());
        }
        CHECK(rows == rowsOf(folder / fmt::format("whole.{}.csv", frame)));
    }
    folder.mustRun(flow + "-scatter count=1001 -advect duration=0.1 -write whole.csv");
    folder.mustRun(flow + "-scatter count=1001 part=each/2 -advect duration=0.1 -write 'part$P3.csv'");
    std::vector<std::string> rows = rowsOf(folder / "part001.csv");
    for (const auto& row : rowsOf(folder / "part002.csv")) rows.push_back(row);
    CHECK(rows == rowsOf(folder / "whole.csv"));
    folder.mustRun(flow + "-scatter count=1001 part=2/2 -advect duration=0.1 -write one.csv");
    CHECK(bytesOf(folder / "one.csv") == bytesOf(folder / "part002.csv"));
}

TEST_CASE("parts: points of four dimensions, too, are those of one piece", "[app][command]") {
    const Folder folder;
    folder.mustRun("-scatter count=11 dimensions=4 box=0,0,0,1,1,1 -write whole.csv");
    folder.mustRun("-scatter count=11 dimensions=4 box=0,0,0,1,1,1 part=each/2 -write '$P.csv'");
    std::vector<std::string> rows = rowsOf(folder / "1.csv");
    for (const auto& row : rowsOf(folder / "2.csv")) rows.push_back(row);
    CHECK(rows == rowsOf(folder / "whole.csv"));
}

TEST_CASE("parts: only what depends on a part is done for each part", "[app]") {
    size_t once = 0;
    std::vector<size_t> counts;
    std::vector<double> parts, noises;
    Scenes scenes([&](Context& c) {
        if (c.has("points")) {
            counts.push_back(c.points("points").particles.size());
            parts.push_back(c.moment().part);
        } else {
            ++once;
        }
    });
    const Session& session = scenes.run("noise seed=1\nhere\nscatter count=10 part=each/3 box=0,0,0,1,1,1\nhere");
    CHECK(once == 1);
    CHECK(counts == std::vector<size_t>{4, 3, 3});
    CHECK(parts == std::vector<double>{1, 2, 3});
    CHECK(test::pointsOf(session).id.front() == 7); // the objects of the last part remain
    CHECK(std::ranges::count(session.evaluated(), "noise") == 1);
}

TEST_CASE("parts: an expression with P changes from part to part, also in a flow", "[app][command]") {
    const Folder folder;
    folder.mustRun(
        "-noise seed={P} -noise seed=9 -dfvn speed=1 -scatter count=20 part=each/2 -advect duration=0.1 -write "
        "'$P.csv'");
    folder.mustRun(
        "-noise seed=2 -noise seed=9 -dfvn speed=1 -scatter count=20 part=each/2 -advect duration=0.1 -write "
        "'same.$P.csv'");
    CHECK(bytesOf(folder / "2.csv") == bytesOf(folder / "same.2.csv"));
    CHECK(bytesOf(folder / "1.csv") != bytesOf(folder / "same.1.csv"));
}

TEST_CASE("parts: one part alone has its number in file names and expressions", "[app][command]") {
    const Folder folder;
    const std::string flow = "-noise seed={P} -noise seed=9 -dfvn speed=1 -scatter count=21 ";
    folder.mustRun(flow + "part=each/3 -frames 1-2 -advect -write 'each.$P.$F.csv'");
    folder.mustRun(flow + "part=2/3 -frames 1-2 -advect -write 'one.$P.$F.csv'");
    CHECK(bytesOf(folder / "one.2.2.csv") == bytesOf(folder / "each.2.2.csv"));
    folder.mustRun("-scatter count=21 part=3/3 box=0,0,0,1,1,1 -write '$P2.csv'");
    CHECK(rowsOf(folder / "03.csv").size() == 7);
    // Points that are not in parts are the same beside any part.
    const std::string whole = "-scatter count=4 box=0,0,0,1,1,1 -write ",
                      part = " -scatter count=9 box=0,0,0,1,1,1 part=";
    folder.mustRun(whole + "a.csv" + part + "3/3 -write 'p.$P.csv'");
    folder.mustRun(whole + "b.csv");
    CHECK(bytesOf(folder / "a.csv") == bytesOf(folder / "b.csv"));
}

TEST_CASE("parts: a session evaluates again what depends on the part", "[app]") {
    Scenes scenes;
    const std::string program = "noise seed={P} as=n\nscatter count=10 box=0,0,0,1,1,1 part=";
    scenes.runAnew(program + "1/2");
    CHECK(scenes.runAnew(program + "2/2").evaluated() == std::vector<std::string>{"n", "scatter"});
    CHECK(scenes.runAnew(program + "2/2").evaluated().empty());
}

TEST_CASE("parts: the report has the figures of each part", "[app][command]") {
    const Folder folder;
    folder.mustRun(
        "-noise -noise seed=1 -dfvn speed=1 -scatter count=30 part=each/3 -advect duration=0.1 -report run.json");
    const auto report = test::jsonOf(folder / "run.json");
    REQUIRE(report["parts"].size() == 3);
    const size_t substeps = report["parts"][0]["advect"]["substeps"];
    for (const auto& part : report["parts"]) {
        CHECK(part["advect"]["points"] == 10);
        CHECK(part["advect"]["substeps"] < 1.5 * static_cast<double>(substeps)); // no sum over the parts
    }
}

TEST_CASE("parts: what is impossible is said before any part is made", "[app]") {
    Scenes scenes;
    const std::string points = "scatter count=10 part=each/3 box=0,0,0,1,1,1\n";
    CHECK_THAT(scenes.complaint(points + "write a.csv"),
               ContainsSubstring("'a.csv' is written for part 1") && ContainsSubstring("'a.$P3.csv'"));
    CHECK_THAT(scenes.complaint(points + "frames 1-2\npush\nwrite a.$F.csv"), ContainsSubstring("put the part"));
    CHECK_THAT(scenes.complaint(points + "frames 1-2\npush\nwrite a.$P.csv"), ContainsSubstring("put the frame"));
    CHECK_THAT(scenes.complaint(points + "frames 1-2\npush\nwrite a.usda"), ContainsSubstring("put the part"));
    CHECK_THAT(scenes.complaint(points + "scatter count=10 part=each/4 box=0,0,0,1,1,1"),
               ContainsSubstring("part=each/4") && ContainsSubstring("part=each/3"));
    CHECK_THAT(scenes.complaint("scatter count=10 part=1/3 box=0,0,0,1,1,1\nscatter count=10 part=2/3 box=0,0,0,1,1,1"),
               ContainsSubstring("part=2/3") && ContainsSubstring("part=1/3"));
    CHECK_THAT(scenes.complaint("scatter count=10 part=4/3 box=0,0,0,1,1,1"), ContainsSubstring("part=4/3"));
    CHECK_THAT(scenes.complaint("scatter count=2 part=each/3 box=0,0,0,1,1,1"), ContainsSubstring("in 3 parts"));
    CHECK_THAT(scenes.complaint(points + "frames 1-2 checkpoint=c\npush"), ContainsSubstring("checkpoint="));
}
