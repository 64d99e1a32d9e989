// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Isolated.h"
#include "support/Catch.h"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>

using namespace curlew;

namespace {

/// Sends the limits of the reader process.
void sendLimits(const std::filesystem::path&, PartWriter& parts) {
    rlimit seconds{};
    ::getrlimit(RLIMIT_CPU, &seconds);
    parts.array(std::vector<uint64_t>{seconds.rlim_cur, seconds.rlim_max});
}

IsolatedReader readerOf(const std::string&) { return sendLimits; }

} // namespace

TEST_CASE("runIsolatedReader: the limit of processor time leaves time to report that it is reached", "[base]") {
    rlimit before{};
    REQUIRE(::getrlimit(RLIMIT_CPU, &before) == 0);
    if (before.rlim_max != RLIM_INFINITY) return;
    std::array<int, 2> ends{};
    REQUIRE(::pipe(ends.data()) == 0);
    const pid_t child = ::fork();
    if (child == 0) {
        ::dup2(ends[1], 3);
        ::_exit(
            runIsolatedReader({"--read-isolated", "limits", "", std::to_string(uint64_t{1} << 46), "77"}, readerOf));
    }
    ::close(ends[1]);
    std::array<uint64_t, 6> words{}; // a header, the array and the last header
    size_t bytes = 0;
    for (ssize_t done = 1; done > 0 && bytes < sizeof words; bytes += static_cast<size_t>(done))
        done = ::read(ends[0], reinterpret_cast<char*>(words.data()) + bytes, sizeof words - bytes);
    ::close(ends[0]);
    int status = 0;
    REQUIRE(::waitpid(child, &status, 0) == child);
    CHECK(status == 0);
    REQUIRE(words[1] == 2 * sizeof(uint64_t));
    CHECK(words[2] == 77); // at this limit the system sends SIGXCPU, at the next one SIGKILL
    CHECK(words[3] > 77);
}
