// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Parallel.h"
#include "curlew/base/Random.h"
#include "curlew/vdb/BgeoFile.h"
#include "curlew/vdb/CurveFile.h"
#include "curlew/vdb/NumpyFile.h"
#include "curlew/vdb/PointFile.h"
#include "curlew/vdb/UsdFile.h"
#include "curlew/vdb/VdbFile.h"
#include "support/HostObjects.h"

#include <openvdb/tools/Dense.h>

#include <atomic>
#include <functional>
#include <memory>

using namespace curlew;
using namespace curlew::test;

namespace {

using Cancelled = std::function<bool()>;
using Write = std::function<void(const Cancelled& cancelled)>;

/// Returns how often a writer asks whether it is cancelled.
size_t asks(const Write& write) {
    std::atomic<size_t> asked = 0;
    write([&] {
        ++asked;
        return false;
    });
    return asked;
}

/// Checks that a writer asks at least `least` times, and that it stops each time and leaves the earlier file alone.
void checkCancelled(const std::string& name, size_t least,
                    const std::function<void(const std::filesystem::path& path, const Cancelled& cancelled)>& writeTo) {
    CAPTURE(name);
    const ScratchFolder folder;
    const Write write = [&](const Cancelled& cancelled) { writeTo(folder / name, cancelled); };
    const size_t all = asks(write);
    CHECK(all >= least);
    store(folder / name, "old");
    for (const size_t last : {size_t{1}, all / 2, all - all / 10}) {
        std::atomic<size_t> asked = 0;
        CHECK_THROWS_AS(write([&] { return ++asked == last; }), Interrupted);
        CHECK(bytesOf(folder / name) == "old");
        CHECK(folder.files() == 1);
    }
}

constexpr size_t kCount = 100000;
/// Every ask covers at most this many points in one array or in all of them.
constexpr size_t kMostPoints = 10000;

/// A velocity in a cube of n³ voxels that does not shrink.
openvdb::Vec3SGrid::Ptr noisyGrid(int n) {
    openvdb::initialize();
    openvdb::tools::Dense<openvdb::Vec3s> dense(openvdb::CoordBBox(openvdb::Coord(0), openvdb::Coord(n - 1)));
    for (size_t k = 0; k < dense.valueCount(); ++k)
        for (int axis = 0; axis < 3; ++axis)
            dense.data()[k][axis] = static_cast<float>(randomUniform(1, k, static_cast<uint64_t>(axis)));
    auto grid = openvdb::Vec3SGrid::create();
    openvdb::tools::copyFromDense(dense, *grid, openvdb::Vec3s(0));
    return grid;
}

} // namespace

TEST_CASE("files of points: writing can be cancelled at any time", "[vdb]") {
    const auto points = std::make_shared<const Points>(particlesWithEverything(kCount));
    constexpr size_t least = kCount / kMostPoints;
    checkCancelled("a.ply", least, [&](const auto& path, const auto& c) { writePly(path, *points, c); });
    checkCancelled("a.csv", least, [&](const auto& path, const auto& c) { writeCsv(path, *points, c); });
    checkCancelled("a.bgeo", least, [&](const auto& path, const auto& c) { writeBgeo(path, *points, c); });
    for (const std::string name : {"a.npy", "a.npz"})
        checkCancelled(name, least, [&](const auto& path, const auto& c) {
            writeNumpy(path, *points, {}, {.report = {}, .cancelled = c});
        });
    checkCancelled("a.usda", 8 * least, [&](const auto& path, const auto& c) { // positions, velocities, ids, age, …
        writeUsda(path, std::vector<UsdSample<Points>>{{1, points}}, {}, c);
    });
}

TEST_CASE("files of curves: writing can be cancelled at any time", "[vdb]") {
    const auto curves = std::make_shared<const Curves>(curvesOfSizes(std::vector<size_t>(kCount / 100, 100)));
    constexpr size_t least = kCount / kMostPoints;
    checkCancelled("a.ply", least, [&](const auto& path, const auto& c) { writePly(path, *curves, c); });
    checkCancelled("a.obj", 2 * least, [&](const auto& path, const auto& c) { writeObj(path, *curves, c); });
    checkCancelled("a.csv", least, [&](const auto& path, const auto& c) { writeCsv(path, *curves, c); });
    checkCancelled("a.bgeo", least, [&](const auto& path, const auto& c) { writeBgeo(path, *curves, c); });
    for (const std::string name : {"a.npy", "a.npz"})
        checkCancelled(name, least, [&](const auto& path, const auto& c) {
            writeNumpy(path, *curves, {}, {.report = {}, .cancelled = c});
        });
    checkCancelled("a.usda", 4 * least, [&](const auto& path, const auto& c) { // positions, velocities, f, g
        writeUsda(path, std::vector<UsdSample<Curves>>{{1, curves}}, {}, c);
    });
}

TEST_CASE("pointGrid: can be cancelled in every step", "[vdb]") {
    const ThreadLimit one(1); // each thread counts its own points
    const Points points = particlesWithEverything(kCount);
    const auto convert = [&](double voxelSize) {
        return asks(
            [&](const Cancelled& c) { pointGrid(points, {.voxelSize = voxelSize}, {.report = {}, .cancelled = c}); });
    };
    // Twice the positions, then v, id, age, life, fade, f and g.
    const size_t given = convert(1);
    CHECK(given >= 9 * kCount / (2 * kMostPoints));
    CHECK(convert(0) >= given + kCount / kMostPoints); // the sort that chooses a voxel size
    for (size_t last = 1; last < given; last += given / 3) {
        size_t asked = 0;
        CHECK_THROWS_AS(
            pointGrid(points, {.voxelSize = 1}, {.report = {}, .cancelled = [&] { return ++asked == last; }}),
            Interrupted);
    }
    const Curves curves = curvesOfSizes(std::vector<size_t>(kCount / 100, 100));
    CHECK(asks([&](const Cancelled& c) { pointGrid(curves, {.voxelSize = 1}, {.report = {}, .cancelled = c}); }) >=
          6 * kCount / (2 * kMostPoints) + 5); // the same without age, life and fade, then five attributes of curves
}

TEST_CASE("VdbFile: writing asks for every few leaves, however long they take to compress", "[vdb]") {
    constexpr int kLeaves = 8;
    const auto grid = noisyGrid(8 * kLeaves);
    const Codec codec = GENERATE(Codec::none, Codec::zip, Codec::blosc);
    checkCancelled("a.vdb", kLeaves * kLeaves * kLeaves / 16,
                   [&](const auto& path, const auto& c) { writeVdb(path, {grid}, {}, {.codec = codec}, c); });
}
