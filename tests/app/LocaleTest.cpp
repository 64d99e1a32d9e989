// SPDX-License-Identifier: Apache-2.0
// Applications such as Blender and Houdini may set a global locale, which groups digits and has a decimal comma.

#include "support/Catch.h"
#include "support/Command.h"
#include "support/Places.h"
#include "support/SessionCommand.h"

#include <locale>

using namespace curlew;
using test::bytesOf;
using test::Folder;

namespace {

namespace fs = std::filesystem;

struct German : std::numpunct<char> {
    char do_thousands_sep() const override { return '.'; }
    char do_decimal_point() const override { return ','; }
    std::string do_grouping() const override { return "\3"; }
};

/// Sets the global locale during its lifetime.
struct InLocale {
    explicit InLocale(const std::locale& locale) : before(std::locale::global(locale)) {}
    ~InLocale() { std::locale::global(before); }
    InLocale(const InLocale&) = delete;
    InLocale& operator=(const InLocale&) = delete;
    std::locale before;
};

/// Writes files of every format with more than a thousand points, faces and vertices, and reads some of them back.
void writeAll(const std::string& folder) {
    const auto file = [&](const std::string& name) { return "\"" + folder + "/" + name + "\""; };
    test::Scenes scenes;
    scenes.run(
        "noise frequency=2.5\nnoise frequency=2.5 seed=1\ndfvn speed=1.5\nscatter count=1500\nadvect duration=0.125 "
        "steps=2\nwrite " +
        file("a.ply") + " " + file("a.csv") + " " + file("a.usda") + " " + file("a.bgeo") + " " + file("a.npz") +
        "\nvelocity dim=12\nwrite " + file("a.vdb") + " " + file("a.fga"));
    scenes.run("read \"" + test::sourceDir() + "/scenes/spot.obj\"\nmesh2ls dim=40\nls2mesh adaptivity=0\nwrite " +
               file("a.obj") + " " + file("b.ply"));
    scenes.run("noise\nslice width=40\nwrite " + file("a.png"));
    scenes.run("read " + file("a.csv") + "\nread " + file("a.ply") + "\nread " + file("a.obj") + "\nmesh2ls dim=12");
}

} // namespace

TEST_CASE("files: their bytes do not depend on the global C++ locale of the host", "[app]") {
    const Folder folder;
    fs::create_directories(folder / "classic");
    fs::create_directories(folder / "german");
    writeAll((folder / "classic").string());
    {
        const InLocale german(std::locale(std::locale::classic(), new German));
        std::ostringstream grouped;
        grouped << 12345.5;
        REQUIRE(grouped.str() == "12.345,5"); // the locale is in force
        writeAll((folder / "german").string());
    }
    CHECK(folder.names().size() > 20);
    for (const std::string& name : folder.names())
        if (name.starts_with("classic/")) {
            CAPTURE(name);
            CHECK((bytesOf(folder / name) == bytesOf(folder / ("german/" + name.substr(8)))));
        }
}
