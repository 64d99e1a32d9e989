// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Csv.h"
#include "curlew/base/Error.h"
#include "support/Files.h"

#include <cmath>

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;

TEST_CASE("readCsv: reads column names and finite numbers row by row", "[base]") {
    const ScratchFolder folder;
    const CsvTable table = readCsv(store(folder / "a.csv", "x,y\r\n1,-2.5\r\n\r\n  \n+.5,1e3\n3,4"), CsvCells::finite);
    CHECK(table.names == std::vector<std::string>{"x", "y"});
    CHECK(table.values == std::vector<double>{1, -2.5, 0.5, 1000, 3, 4});
    CHECK(readCsv(store(folder / "b.csv", "x,y\n"), CsvCells::finite).values.empty());
}

TEST_CASE("readCsv: optional cells may be empty or quoted or padded with spaces or not finite", "[base]") {
    const ScratchFolder folder;
    const CsvTable table =
        readCsv(store(folder / "a.csv", "\nr, \"our rdf\" ,\n0 ,\"1\",2.5\n,inf,nan\n"), CsvCells::optional);
    CHECK(table.names == std::vector<std::string>{"r", "our rdf", ""});
    REQUIRE(table.values.size() == 6);
    CHECK(std::vector<double>(table.values.begin(), table.values.begin() + 3) == std::vector<double>{0, 1, 2.5});
    CHECK(std::isnan(table.values[3]));
    CHECK(std::isinf(table.values[4]));
    CHECK(std::isnan(table.values[5]));
}

TEST_CASE("readCsv: errors name the file and the line", "[base]") {
    struct Case {
        std::string content;
        CsvCells cells;
        std::string says;
    };
    const auto c = GENERATE(
        Case{"", CsvCells::finite, "empty"}, Case{"\n \n", CsvCells::optional, "blank"},
        Case{"x\n1\n2,3\n", CsvCells::finite, "line 3: 2 cells, but the header has 1"},
        Case{"x,y\n1\n", CsvCells::optional, "line 2: 1 cells, but the header has 2"},
        Case{"x\n nan\n", CsvCells::finite, "line 2: ' nan' is not a finite number"},
        Case{"x\ninf\n", CsvCells::finite, "'inf'"}, Case{"x\n 1\n", CsvCells::finite, "' 1'"},
        Case{"x,y\n1,\n", CsvCells::finite, "''"}, Case{"x\n1e999\n", CsvCells::optional, "'1e999' is not a number"},
        Case{"x\n+-1\n", CsvCells::optional, "'+-1'"}, Case{"x\n1\n\n2z\n", CsvCells::optional, "line 4: '2z'"});
    CAPTURE(c.content);
    const ScratchFolder folder;
    const auto path = store(folder / "bad.csv", c.content);
    CHECK_THROWS_AS(readCsv(path, c.cells), FileError);
    CHECK_THROWS_WITH(readCsv(path, c.cells), ContainsSubstring("bad.csv") && ContainsSubstring(c.says));
}

TEST_CASE("readCsv: the caller sees the column names before the first row is read", "[base]") {
    const ScratchFolder folder;
    const auto refuse = [](const std::vector<std::string>& names) { throw FileError("has " + names.at(0)); };
    CHECK_THROWS_WITH(readCsv(store(folder / "a.csv", "x;y\nno number\n"), CsvCells::finite, refuse), "has x;y");
}

TEST_CASE("readCsv: a missing file or a folder is refused", "[base]") {
    const ScratchFolder folder;
    CHECK_THROWS_WITH(readCsv(folder / "none.csv", CsvCells::finite),
                      ContainsSubstring("none.csv") && ContainsSubstring("no such file"));
    CHECK_THROWS_WITH(readCsv(folder.path, CsvCells::finite), ContainsSubstring("folder"));
}
