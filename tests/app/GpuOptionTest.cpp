// SPDX-License-Identifier: Apache-2.0
#include "curlew/picture/ImageFile.h"
#include "curlew/picture/Warp.h"
#include "support/Command.h"
#include "support/Samples.h"

#include <fmt/format.h>

using namespace curlew;
using namespace curlew::test;
using Catch::ContainsSubstring;

namespace {

const std::string kFlow = "-sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn speed=1 ";
const std::string kPlane = "-noise type=gradient dimensions=2 frequency=7 -dfvn box=0,0,0,1.7778,1,1 ";

/// Returns whether there is no GPU, not even in software, and warns of it.
bool skippedWithoutGpu(const Folder& folder) {
    const Outcome outcome = folder.run("-device list");
    if (outcome.status != 0) WARN("skipped: " << outcome.err);
    return outcome.status != 0;
}

/// The number of lines whose first three numbers are all within `tolerance` of those in the other file.
size_t linesAlike(const fs::path& a, const fs::path& b, double tolerance) {
    std::ifstream left(a), right(b);
    size_t alike = 0;
    for (std::string one, other; std::getline(left, one) && std::getline(right, other);) {
        std::istringstream x(one), y(other);
        bool same = true;
        for (int axis = 0; axis < 3; ++axis) {
            double u = 0, v = 0;
            char comma = 0;
            same = same && (x >> u >> comma) && (y >> v >> comma) && std::abs(u - v) <= tolerance;
        }
        alike += same;
    }
    return alike;
}

} // namespace

TEST_CASE("device: actions compute on a GPU what they compute on the processor", "[app][command]") {
    const Folder folder;
    if (skippedWithoutGpu(folder)) return;
    const auto onGpu = [&](const std::string& action, const std::string& command) {
        CHECK_THAT(folder.mustRun(command).err, ContainsSubstring(action + ": on GPU '"));
    };
    const std::string points = kFlow + "-scatter count=500 -advect duration=0.5 ";
    folder.mustRun(points + "-write a.csv");
    onGpu("advect", points + "device=gpu -write b.csv");
    CHECK(linesAlike(folder / "a.csv", folder / "b.csv", 1e-4) > 480);

    onGpu("velocity", kFlow + "-velocity dim=24 device=gpu -flow -slice width=80 -write b.exr");
    folder.mustRun(kFlow + "-velocity dim=24 -flow -slice width=80 -write a.exr");
    CHECK(differenceOf(readExr(folder / "a.exr"), readExr(folder / "b.exr")).largest < 1e-4);

    const std::string masked = kFlow + "-velocity dim=12 -velocity mask=0 ";
    folder.mustRun(masked + "-flow -slice width=40 -write m.exr");
    onGpu("velocity", masked + "device=gpu -flow -slice width=40 -write n.exr");
    CHECK(differenceOf(readExr(folder / "m.exr"), readExr(folder / "n.exr")).largest < 1e-4);

    folder.mustRun(kFlow + "-lic width=100 show=none drawWall=0 -write c.exr");
    onGpu("lic", kFlow + "-lic width=100 show=none drawWall=0 device=gpu -write d.exr");
    CHECK(differenceOf(readExr(folder / "c.exr"), readExr(folder / "d.exr")).rms < 2e-3);

    folder.mustRun(kPlane + "-warp pattern=waves width=100 duration=0.1 -write e.exr");
    onGpu("warp", kPlane + "-warp pattern=waves width=100 duration=0.1 device=gpu -write f.exr");
    CHECK(differenceOf(readExr(folder / "e.exr"), readExr(folder / "f.exr")).rms < 1e-2);
}

TEST_CASE("device: what a GPU cannot do is an error, or done by the processor", "[app][command]") {
    const Folder folder;
    if (skippedWithoutGpu(folder)) return;
    const std::string points = kFlow + "-scatter count=20 -advect duration=0.1 ";
    const std::string moving =
        "-scatter count=20 box=-0.2,-0.2,-0.2,0.2,0.2,0.2 -frames 1-2 -sphere "
        "-noise frequency=2 translate={T},0,0 -noise frequency=2 seed=1 -bound -dfvn -advect ";
    struct Case {
        std::string command, why;
    };
    for (const auto& [command, why] :
         {Case{kFlow + "-velocity dim=8 staggered=1 ", "a staggered grid needs potentials in double"},
          Case{points + "pathlines=1 ", "pathlines are made on the processor only"},
          Case{points + "reproject=newton ", "a GPU corrects all potentials at once"},
          Case{moving, "points follow a flow that changes with time on the processor only"}}) {
        CAPTURE(command);
        folder.mustFail(command + "device=gpu", {why, "use device=cpu, or device=auto"});
        CHECK_THAT(folder.mustRun(command + "device=auto").err, ContainsSubstring("on the processor: " + why));
    }
    const std::string noise4 = "-noise type=simplex dimensions=4 seed=";
    folder.mustFail(noise4 + "1 " + noise4 + "2 " + noise4 + "3 -dfvn -scatter count=9 -advect duration=0.1 device=gpu",
                    {"device=gpu needs points in 3D"});
    folder.mustFail(points + "loop=1 device=gpu", {"device"});
}

TEST_CASE("device: a software device is taken if it is chosen, but not by auto alone", "[app][command]") {
    const Folder folder;
    if (skippedWithoutGpu(folder)) return;
    const std::string list = folder.mustRun("-device list").out;
    CHECK_THAT(list, ContainsSubstring("0  "));
    if (list.find("1  ") == std::string::npos && list.find("computes on the processor") != std::string::npos)
        CHECK_THAT(folder.mustRun(kFlow + "-velocity dim=8 device=auto").err, ContainsSubstring("is no GPU"));
    CHECK_THAT(folder.mustRun("-device 0 " + kFlow + "-velocity dim=8 device=auto").err,
               ContainsSubstring("velocity: on GPU '"));
    folder.mustFail("-device 99", {"-device", "there is no GPU number 99"});
    for (const std::string word : {"x", "-1", "1.5"})
        folder.mustFail("-device " + word, {"-device", "must be 'list' or the number of a GPU"});
}

TEST_CASE("device: full memory is one line and leaves no file", "[app][command]") {
    const Folder folder;
    if (kSanitized || skippedWithoutGpu(folder)) return; // sanitizers reserve terabytes of addresses
    const std::string points =
        "-noise -noise seed=1 -dfvn -scatter count=3e5 box=-1,-1,-1,1,1,1 -advect duration=0.01 ";
    // From limits with which the GPU cannot be opened to one that suffices.
    size_t failed = 0;
    for (const int megabytes : {400, 600, 800, 1000, 4000}) {
        CAPTURE(megabytes);
        const std::string limit = fmt::format("ulimit -v {}; curlew -threads 2 -quiet ", 1000 * megabytes);
        const Outcome gpu = folder.shell(limit + points + "device=gpu -write a.npy");
        CAPTURE(gpu.err);
        CHECK((gpu.status == 0 || gpu.status == 1));
        if (gpu.status == 0) {
            fs::remove(folder / "a.npy");
            continue;
        }
        ++failed;
        CHECK_THAT(gpu.err, Catch::StartsWith("curlew: ") && Catch::EndsWith("\n") && !ContainsSubstring("vkAllocate"));
        CHECK(std::count(gpu.err.begin(), gpu.err.end(), '\n') == 1);
        CHECK(folder.names() == std::set<std::string>{});
    }
    CHECK(failed > 0);
}

TEST_CASE("device: without a driver, gpu is an error and auto is the processor", "[app][command]") {
    const Folder folder;
    if (skippedWithoutGpu(folder)) return;
    ::setenv("VK_DRIVER_FILES", "/nonexistent.json", 1);
    ::setenv("VK_ICD_FILENAMES", "/nonexistent.json", 1); // the name that older loaders know
    folder.mustFail(kFlow + "-velocity dim=8 device=gpu", {"-velocity", "driver"});
    folder.mustFail("-device list", {"-device", "driver"});
    CHECK_THAT(folder.mustRun(kFlow + "-velocity dim=8 device=auto").err,
               ContainsSubstring("velocity: on the processor: "));
    ::unsetenv("VK_DRIVER_FILES");
    ::unsetenv("VK_ICD_FILENAMES");
}
