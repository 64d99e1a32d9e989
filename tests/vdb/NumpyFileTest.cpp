// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Parallel.h"
#include "curlew/vdb/NumpyFile.h"
#include "curlew/vdb/Openvdb.h"
#include "support/HostObjects.h"

#include <set>

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;
using Folder = ScratchFolder;

namespace {

std::vector<openvdb::GridBase::ConstPtr> grids() {
    auto density = openvdb::FloatGrid::create();
    density->setName("density");
    density->tree().setValue({1, 2, 3}, 0.5f);
    return {rampGrid(), density};
}

/// A member of a ZIP archive by its entry in the directory.
struct Member {
    std::string name;
    bool utf8;
};

std::vector<Member> membersOf(const std::string& zip) {
    std::vector<Member> members;
    for (size_t at = zip.find("PK\1\2"); at != std::string::npos; at = zip.find("PK\1\2", at + 1))
        members.push_back(
            {zip.substr(at + 46, littleAt<uint16_t>(zip, at + 28)), (littleAt<uint16_t>(zip, at + 8) & 1 << 11) != 0});
    return members;
}

} // namespace

TEST_CASE("NumpyFile: NumPy reads all attributes of particles", "[vdb]") {
    const Folder folder;
    const Points p = particlesWithEverything(5);
    writeNumpy(folder / "a.npz", p, {.time = FrameTime{.frame = 7, .fps = 25}});
    writeNumpy(folder / "z.npz", p, {.deflate = true});
    writeNumpy(folder / "a.npy", p);
    const std::string printed = pythonWith("numpy", folder.path, R"(
import numpy as np
a, z, y = np.load("a.npz"), np.load("z.npz"), np.load("a.npy")
print(sorted(a.files))
for name in z.files:
    assert np.array_equal(a[name], z[name]) and np.array_equal(a[name], y[name]), name
    assert a[name].dtype == y.dtype[name].base, name
print(a["P"].dtype, a["P"].shape, a["v"].dtype, a["id"].dtype, a["f"].dtype, y.dtype.names)
print(a["P"][3].tolist(), a["v"][3].tolist(), a["id"].tolist(), a["life"].tolist(), float(a["frame"]), float(a["fps"]))
)");
    if (printed.empty()) {
        WARN("skipped: NumPy is not installed");
        return;
    }
    CHECK(printed ==
          "['P', 'age', 'f', 'fade', 'fps', 'frame', 'g', 'id', 'life', 'v']\n"
          "float64 (5, 3) float32 int64 float64 ('P', 'v', 'id', 'age', 'life', 'fade', 'f', 'g')\n"
          "[3.0, 1.5, -3.0] [1.0, 3.0, -2.0] [5, 8, 11, 14, 17] [inf, 2.0, inf, 2.0, inf] 7.0 25.0\n");
}

TEST_CASE("NumpyFile: NumPy reads curves by their starts", "[vdb]") {
    const Folder folder;
    writeNumpy(folder / "a.npz", curvesOfSizes({4, 3, 0, 1}));
    writeNumpy(folder / "a.npy", curvesOfSizes({4, 3, 0, 1}));
    const std::string printed = pythonWith("numpy", folder.path, R"(
import numpy as np
a, y = np.load("a.npz"), np.load("a.npy")
print(a["start"].tolist(), a["id"].tolist(), a["closed"].tolist(), a["closed"].dtype, a["P"].shape)
print(y["curve"].tolist(), y["closed"].tolist(), a["length"].tolist())
)");
    if (printed.empty()) {
        WARN("skipped: NumPy is not installed");
        return;
    }
    CHECK(printed ==
          "[0, 4, 7, 7, 8] [100, 99, 98, 97] [False, True, False, True] bool (8, 3)\n"
          "[0, 0, 0, 0, 1, 1, 1, 3] [False, False, False, False, True, True, True, True] "
          "[0.0, 0.25, 0.5, 0.75, 0.0, 0.25, 0.5, 0.0]\n");
}

TEST_CASE("NumpyFile: a grid is a dense box with its transform", "[vdb]") {
    const Folder folder;
    writeNumpy(folder / "a.npz", grids());
    writeNumpy(folder / "a.npy", {rampGrid()});
    const std::string printed = pythonWith("numpy", folder.path, R"(
import numpy as np
a, y = np.load("a.npz"), np.load("a.npy")
print(sorted(a.files), a["vel"].shape, a["vel"].dtype, np.array_equal(a["vel"], y))
print(a["vel"][2, 1, 3].tolist(), (a["vel_transform"] @ [2, 1, 3, 1]).tolist(), bool(a["vel_staggered"]))
print(a["density"].tolist(), a["density_transform"][:3, 3].tolist())
)");
    if (printed.empty()) {
        WARN("skipped: NumPy is not installed");
        return;
    }
    CHECK(printed ==
          "['density', 'density_transform', 'vel', 'vel_staggered', 'vel_transform'] (3, 4, 5, 3) float32 True\n"
          "[1.0, 3.0, 100.0] [0.5, 1.5, 5.0, 1.0] False\n"
          "[[[0.5]]] [1.0, 2.0, 3.0]\n");
}

TEST_CASE("NumpyFile: bytes do not depend on the number of threads or the time of day", "[vdb]") {
    const Folder folder;
    const Points p = particlesWithEverything(10000);
    for (const char* ending : {".npz", ".npy"}) {
        writeNumpy(folder / (std::string("a") + ending), p);
        const ThreadLimit one(1);
        writeNumpy(folder / (std::string("b") + ending), p);
        CHECK((bytesOf(folder / (std::string("a") + ending)) == bytesOf(folder / (std::string("b") + ending))));
    }
}

TEST_CASE("NumpyFile: refuses values and grids that cannot be written", "[vdb]") {
    const Folder folder;
    Points p = particlesWithEverything(3);
    p.vy[1] = std::numeric_limits<float>::quiet_NaN();
    CHECK_THAT(messageOf([&] { writeNumpy(folder / "a.npz", p); }), ContainsSubstring("point 1 has a velocity"));
    CHECK_THAT(messageOf([&] { writeNumpy(folder / "a.txt", particlesWithEverything(1)); }),
               ContainsSubstring(".npy or .npz"));
    CHECK_THAT(messageOf([&] { writeNumpy(folder / "a.npz", {openvdb::FloatGrid::create()}); }),
               ContainsSubstring("no active voxels"));
    CHECK_THAT(messageOf([&] { writeNumpy(folder / "a.npz", {openvdb::BoolGrid::create(true)}); }),
               ContainsSubstring("of type bool"));
    auto huge = openvdb::FloatGrid::create();
    huge->tree().setValue({0, 0, 0}, 1);
    huge->tree().setValue({1 << 20, 1 << 20, 1 << 20}, 1);
    CHECK_THAT(messageOf([&] { writeNumpy(folder / "a.npz", {huge}); }),
               ContainsSubstring("1048577 x 1048577 x 1048577"));
    auto bad = rampGrid();
    bad->tree().setValue({0, 2, 7}, openvdb::Vec3s(0, std::numeric_limits<float>::infinity(), 0));
    CHECK_THAT(messageOf([&] { writeNumpy(folder / "a.npz", {bad}); }), ContainsSubstring("not finite at voxel 0,2,7"));
    CHECK_THAT(messageOf([&] { writeNumpy(folder / "a.npy", grids()); }), ContainsSubstring("one grid"));
    CHECK(folder.files() == 0);
}

TEST_CASE("NumpyFile: the members of an archive have different names", "[vdb]") {
    const Folder folder;
    for (const auto& names : {std::vector<std::string>{"v", "v_transform", "v_staggered", "v"},
                              std::vector<std::string>{"v_staggered", "v_transform", "v", "fps"}}) {
        std::vector<openvdb::GridBase::ConstPtr> all;
        for (const std::string& name : names) all.push_back(rampGrid(name));
        writeNumpy(folder / "a.npz", all, {.time = FrameTime{.frame = 7, .fps = 25}});
        std::set<std::string> found;
        for (const Member& member : membersOf(bytesOf(folder / "a.npz"))) CHECK(found.insert(member.name).second);
        CHECK(found.size() == 3 * names.size() + 2);
        CHECK(found.contains(names[0] + ".npy"));
    }
}

TEST_CASE("NumpyFile: names with letters beyond ASCII are marked as UTF-8", "[vdb]") {
    const Folder folder;
    writeNumpy(folder / "a.npz", {rampGrid("vel"), rampGrid("wei\xc3\x9f")});
    for (const Member& member : membersOf(bytesOf(folder / "a.npz"))) {
        CAPTURE(member.name);
        CHECK(member.utf8 == (member.name.find('\xc3') != std::string::npos));
    }
}
