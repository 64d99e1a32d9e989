// SPDX-License-Identifier: Apache-2.0
#include "support/Catch.h"
#include "support/ProbeCommand.h"
#include "support/Variable.h"

#include <fmt/format.h>

#include <map>

using namespace curlew;
using test::Folder;
using test::store;
using test::Variable;

// All instruction sets give the same bytes. A process chooses its instruction set once, so these tests run the command
// and compare its files.

namespace {

bool runsWith(const Folder& folder, const std::string& simd) {
    const Variable choice("CURLEW_SIMD", simd);
    return folder.run("-list").status == 0;
}

/// Returns the instruction sets of this processor other than scalar, which is the reference.
const std::vector<std::string>& otherThanScalar() {
    static const std::vector<std::string> kOthers = [] {
        std::vector<std::string> others;
        const Folder folder;
        for (const std::string simd : {"avx2", "avx512"})
            if (runsWith(folder, simd))
                others.push_back(simd);
            else
                WARN("skipped: this processor has no " << simd);
        return others;
    }();
    return kOthers;
}

using Files = std::map<std::string, std::string>;

/// Returns the bytes of all files that the command writes. `inputs` are files for it to read.
Files written(const std::string& simd, const std::string& arguments, const Files& inputs) {
    const Variable choice("CURLEW_SIMD", simd);
    const Folder folder;
    for (const auto& [name, bytes] : inputs) store(folder / name, bytes);
    folder.mustRun("-quiet " + arguments);
    Files files;
    for (const auto& name : folder.names())
        if (!inputs.contains(name)) files[name] = test::bytesOf(folder / name);
    return files;
}

void requireSameBytes(const std::string& arguments, const Files& inputs = {}) {
    CAPTURE(arguments);
    const Files expected = written("scalar", arguments, inputs);
    REQUIRE(!expected.empty());
    for (const auto& simd : otherThanScalar()) {
        const Files files = written(simd, arguments, inputs);
        REQUIRE(files.size() == expected.size());
        for (const auto& [name, bytes] : expected) {
            CAPTURE(simd, name);
            REQUIRE(bytes.size() > 200); // not only a header
            REQUIRE((files.contains(name) &&
                     files.at(name) == bytes)); // extra parentheses: a failure must not print megabytes
        }
    }
}

/// Writes the velocities of the newest flow at voxel centres and on faces.
std::string grids(const std::string& job, int dim) {
    return job + fmt::format(
                     " -velocity dim={0} -write centres.vdb -velocity dim={0} staggered=1 potentials=1 "
                     "-write grid=0,1,2 faces.vdb",
                     dim);
}

/// Two noises with these options, followed by the action that makes a flow of them.
std::string pair(const std::string& options, const std::string& flow) {
    return fmt::format("-noise seed=1 {0} -noise seed=2 {0} {1}", options, flow);
}

/// An octahedron centred at the origin.
const Files kMesh{{"mesh.obj",
                   "v 1 0 0\nv -1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nv 0 0 -1\nf 1 3 5\nf 3 2 5\nf 2 4 5\nf 4 1 5\n"
                   "f 3 1 6\nf 2 3 6\nf 4 2 6\nf 1 4 6\n"}};
const std::string kLevelSet = "-read mesh.obj -mesh2ls dim=24 ";

/// Positions for -probe: random ones, near and far, that fill more than one batch; and lattice vertices, midpoints and
/// zeros of either sign, where functions have corners and comparisons have ties.
template <int N>
std::string positions() {
    std::string text = test::coordinateHeader(N);
    const auto add = [&](const Vec<double, N>& p) {
        for (int i = 0; i < N; ++i) text += fmt::format("{}{:.17g}", i ? "," : "\n", p[i]);
    };
    for (const double half : {3.0, 1e6})
        for (const auto& p : test::randomPoints(test::cube<N>(half), 75, 1)) add(p);
    for (const auto& p : test::randomPoints(test::cube<N>(3), 50, 2)) {
        auto halves = p;
        for (double& x : halves.c) x = std::nearbyint(2 * x) / 2;
        add(halves);
    }
    return text + "\n";
}

/// Compares the values and first and second derivatives of each N-dimensional noise at the positions.
template <int N>
void requireSameProbes(const std::vector<std::string>& noises) {
    std::string job;
    for (size_t k = 0; k < noises.size(); ++k) {
        job += fmt::format("-noise dimensions={} seed=3 frequency=1.3 {} ", N, noises[k]);
        for (const auto& [precision, highest] : {std::pair("float", 1), std::pair("double", 2)})
            for (int order = 0; order <= highest; ++order)
                job += fmt::format("-probe in.csv {0}_{1}_{2}.csv precision={1} order={2} ", k, precision, order);
    }
    requireSameBytes(job, {{"in.csv", positions<N>()}});
}

} // namespace

TEST_CASE("CURLEW_SIMD: an unknown or missing instruction set is refused before any work", "[app][command]") {
    const Folder folder;
    const auto mustFailWith = [&](const std::string& simd, const std::string& says) {
        const Variable choice("CURLEW_SIMD", simd);
        folder.mustFail("-noise -slice width=8 -write a.png", {"CURLEW_SIMD=" + simd, says});
        folder.mustFail("-version", {"CURLEW_SIMD=" + simd, says});
    };
    for (const std::string simd : {"foo", "AVX2", "avx", " "}) mustFailWith(simd, "unknown");
    for (const std::string simd : {"avx2", "avx512"})
        if (!runsWith(folder, simd)) mustFailWith(simd, "does not support");
    CHECK(runsWith(folder, "scalar"));
    CHECK(runsWith(folder, "")); // an empty value counts as unset
#if defined(__x86_64__)
    CHECK(runsWith(folder, "avx512") == (__builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq")));
#endif
}

TEST_CASE("instruction sets: velocity grids without walls have the same bytes", "[app][command]") {
    const std::string options =
        GENERATE("type=psrd", "type=psrd period=4,2,5 octaves=2", "type=psrd period=3,6,3 grid=perlin alpha=0.7",
                 "type=psrd billow=0.1 octaves=2", "type=value period=4", "type=perlin", "type=simplex",
                 "type=gradient period=4", "type=sine waves=5", "type=psrd octaves=2 warp=0.2");
    requireSameBytes(grids(pair(options, "-dfvn"), 12));
}

TEST_CASE("instruction sets: flows of every kind have the same bytes", "[app][command]") {
    const std::string noises = pair("", "");
    const std::string job = GENERATE_COPY(
        noises + "-dfvn -reshape maxSpeed=0.5", "-torus -noise frequency=2 -surface", noises + "-sum -noise -dfvn",
        noises + "-product -noise -dfvn", noises + "-displace -noise -dfvn", noises + "-max smoothing=0.3 -noise -dfvn",
        "-noise rotate=10,20,30 translate=1 -transform scale=1.5 rotate=5 -noise -dfvn");
    requireSameBytes(grids(job, 12));
}

TEST_CASE("instruction sets: sums and normalised flows and slices have the same bytes", "[app][command]") {
    requireSameBytes("-noise -curl shift=10 -updraft -superpose -velocity dim=12 -write sum.vdb");
    requireSameBytes(pair("", "-dfvn uniformSpeed=1 speed=0.5 -velocity dim=12 -write unit.vdb"));
    requireSameBytes("-noise dimensions=2 octaves=3 -dfvn -slice width=40 -write slice.exr");
}

TEST_CASE("instruction sets: pictures of points and streamlines have the same bytes", "[app][command]") {
    requireSameBytes(pair("",
                          "-dfvn -scatter count=50 -splat width=64 -write points.exr"
                          " -trace maxLength=0.5 -splat width=64 -write lines.exr"));
}

TEST_CASE("instruction sets: velocity grids within shapes have the same bytes", "[app][command]") {
    const std::string shape = GENERATE("-sphere", "-box rotate=10,20,30", "-torus", "-capsule", "-cylinder",
                                       "-gyroid wavelength=1.5", "-sphere -box translate=0.5 -union smoothing=0.2",
                                       "-box -sphere radius=0.7 -difference smoothing=0.1");
    requireSameBytes(grids(shape + " " + pair("octaves=3 frequency=2", "-bound layer=0.3 -dfvn speed=1"), 16));
}

TEST_CASE("instruction sets: velocity grids within a mesh have the same bytes", "[app][command]") {
    const std::string how =
        GENERATE("-bound layer=0.2 -dfvn speed=1", "-bound layer=0.2 side=both -dfvn", "-blend layer=0.2 -dfvn");
    requireSameBytes(grids(kLevelSet + pair("frequency=2", how), 20), kMesh);
}

TEST_CASE("instruction sets: a layer of several bands has the same bytes", "[app][command]") {
    const std::string flow =
        "-read mesh.obj -mesh2ls dim=60 " + pair("", "-bound layer=0.8 side=outside -dfvn speed=1");
    requireSameBytes(grids(flow, 24) + " -scatter count=100 -advect duration=0.4 -write p.ply", kMesh);
}

TEST_CASE("instruction sets: points have the same bytes", "[app][command]") {
    const std::string flow =
        GENERATE("-sphere " + pair("octaves=2", "-bound layer=0.3 -dfvn speed=1"),
                 kLevelSet + pair("frequency=2", "-bound layer=0.3 -dfvn speed=1"), pair("type=value", "-dfvn"),
                 pair("type=sine waves=3", "-dfvn uniformSpeed=1"), "-torus -noise frequency=2 -surface speed=1");
    std::string job = flow + " -scatter count=100 seed=3 -write start.ply ";
    for (const std::string scheme : {"euler", "midpoint", "rk4"})
        for (const std::string reproject : {"newton", "gauss-newton", "none"})
            job += fmt::format("-advect duration=0.4 steps=3 scheme={0} reproject={1} -write {0}_{1}.ply ", scheme,
                               reproject);
    job += "-advect duration=0.4 -write adaptive.ply -advect duration=0.4 accuracy=1e-3 -write coarse.ply ";
    requireSameBytes(job, kMesh);
}

TEST_CASE("instruction sets: a sequence has the same bytes", "[app][command]") {
    requireSameBytes(
        "-scatter count=100 box=-1,-1,-1,1,1,1 -frames 1-3 checkpoint=run -noise frequency=2 alpha='{2*pi*T}' -noise "
        "seed=1 -dfvn speed=1 -sphere translate='{sin(T)},0,0' -emit rate=2000 life=0.1 spread=1 -advect duration=0.1 "
        "steps=2 "
        "-kill -write 'p.$F.csv'");
}

TEST_CASE("instruction sets: noises have the same values and derivatives", "[app][command]") {
    requireSameProbes<1>({"type=value", "type=value period=3", "type=perlin octaves=3", "type=sine"});
    requireSameProbes<2>({"type=psrd", "type=psrd period=3,4 alpha=1", "type=value", "type=perlin octaves=2",
                          "type=gradient", "type=gradient period=4", "type=simplex", "type=sine waves=3"});
    requireSameProbes<3>(
        {"type=psrd octaves=3", "type=psrd lattice=perlin", "type=psrd rotation=fast alpha=0.5 period=4",
         "type=psrd lattice=perlin period=3", "type=value", "type=value period=2,3,5 octaves=2", "type=perlin",
         "type=perlin gradients=reference period=4", "type=gradient", "type=gradient octaves=2 billow=0.1",
         "type=simplex", "type=simplex power=3", "type=simplex kernel=corners", "type=sine", "type=sine period=4"});
    requireSameProbes<4>({"type=simplex octaves=2", "type=sine"});
    requireSameProbes<5>({"type=simplex", "type=sine"});
    requireSameProbes<6>({"type=simplex", "type=simplex kernel=corners", "type=sine"});
    requireSameProbes<7>({"type=simplex", "type=simplex kernel=published", "type=sine waves=2"});
}
