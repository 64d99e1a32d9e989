// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Sanitizer.h"
#include "support/Catch.h"

#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <limits>

using namespace curlew;
namespace fs = std::filesystem;

namespace {

/// Control group files as the kernel provides them, in a temporary folder.
struct Groups {
    fs::path root = fs::temp_directory_path() / ("curlew-groups-" + std::to_string(::getpid()));
    Groups() {
        fs::remove_all(root);
        fs::create_directories(root);
    }
    ~Groups() { fs::remove_all(root); }
    Groups(const Groups&) = delete;
    Groups& operator=(const Groups&) = delete;

    void store(const std::string& file, const std::string& text) const {
        fs::create_directories((root / file).parent_path());
        std::ofstream(root / file) << text;
    }
    size_t left(const std::string& ownGroups) const {
        store("cgroup", ownGroups);
        return controlGroupMemory(root / "cgroup", root);
    }
};

constexpr size_t kUnlimited = std::numeric_limits<size_t>::max();

} // namespace

TEST_CASE("controlGroupMemory: the tightest limit of all nested groups applies", "[base]") {
    const Groups groups;
    CHECK(groups.left("0::/\n") == kUnlimited);
    groups.store("slurm/job/step/memory.max", "max\n");
    groups.store("slurm/job/step/memory.current", "300\n");
    groups.store("slurm/job/memory.max", "1000\n");
    groups.store("slurm/job/memory.current", "400\n");
    groups.store("slurm/memory.max", "5000\n");
    groups.store("slurm/memory.current", "4500\n");
    CHECK(groups.left("0::/slurm/job/step\n") == 500);
    groups.store("slurm/memory.stat", "anon 4100\ninactive_file 400\nactive_file 7\n"); // reclaimable
    CHECK(groups.left("0::/slurm/job/step\n") == 600);
    groups.store("slurm/job/memory.current", "1200\n"); // above its limit
    CHECK(groups.left("0::/slurm/job/step\n") == 0);
    CHECK(groups.left("0::/elsewhere\n") == kUnlimited);
}

TEST_CASE("controlGroupMemory: reads version 1 groups and containers named by their host path", "[base]") {
    const Groups groups;
    groups.store("memory/docker/memory.limit_in_bytes", "2000\n");
    groups.store("memory/docker/memory.usage_in_bytes", "1500\n");
    groups.store("memory/docker/memory.stat", "cache 900\ntotal_inactive_file 100\n");
    CHECK(groups.left("5:cpu,cpuacct:/docker\n4:hugetlb,memory:/docker\n0::/\n") == 600);
    CHECK(groups.left("5:cpu:/docker\n") == kUnlimited);
    groups.store("memory/memory.limit_in_bytes", "9000\n");
    groups.store("memory/memory.usage_in_bytes", "1000\n");
    CHECK(groups.left("4:memory:/docker/of-the-host\n") == 600);
    CHECK(groups.left("4:memory:/of-the-host\n") == 8000);
}

TEST_CASE("controlGroupMemory: a missing or malformed group list means no limit", "[base]") {
    const Groups groups;
    CHECK(controlGroupMemory(groups.root / "missing", groups.root) == kUnlimited);
    CHECK(groups.left("\n:\nmemory\n0::\n") == kUnlimited);
}

TEST_CASE("availableMemory: an address space limit counts and requireMemory refuses more than remains", "[base]") {
    if (kAddressSanitizer) {
        WARN("skipped: AddressSanitizer needs more address space");
        return;
    }
    rlimit before{};
    REQUIRE(::getrlimit(RLIMIT_AS, &before) == 0);
    const size_t without = availableMemory();
    const rlimit tight{rlim_t{1} << 20, before.rlim_max}; // less than this program uses already
    REQUIRE(::setrlimit(RLIMIT_AS, &tight) == 0);
    rlimit kept{};
    ::getrlimit(RLIMIT_AS, &kept);
    const size_t with = availableMemory();
    ::setrlimit(RLIMIT_AS, &before);
    if (kept.rlim_cur != tight.rlim_cur) {
        WARN("skipped: qemu-user does not limit the address space");
        return;
    }
    CHECK(without > size_t{1} << 20);
    CHECK(with == 0);
    CHECK_NOTHROW(requireMemory(1e6, "a thing", "make it smaller"));
    CHECK_THROWS_WITH(requireMemory(1e18, "a thing", "make it smaller"),
                      Catch::StartsWith("a thing would need about") && Catch::EndsWith("make it smaller"));
    CHECK_THROWS_AS(requireMemory(std::numeric_limits<double>::quiet_NaN(), "", ""), ResourceError);
}
