// SPDX-License-Identifier: Apache-2.0
// Tests each reader with its seeds, with inputs that once broke it, and with random damage to both.

#include "Targets.h"
#include "support/Catch.h"
#include "support/Files.h"
#include "support/Places.h"

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <random>

using namespace curlew;
using fuzz::Target;

namespace {

std::vector<std::string> inputs(const Target& target) {
    std::vector<std::string> all = fuzz::seeds(target.name);
    const std::filesystem::path found = std::filesystem::path(test::sourceDir()) / "tests/fuzz/found" / target.name;
    if (std::filesystem::is_directory(found))
        for (const auto& entry : std::filesystem::directory_iterator(found)) all.push_back(test::bytesOf(entry.path()));
    return all;
}

std::string damaged(std::string bytes, std::mt19937& random) {
    for (auto hits = 1 + random() % 3; hits > 0 && !bytes.empty(); --hits) {
        const size_t at = random() % bytes.size(), length = 1 + random() % std::min<size_t>(bytes.size() - at, 16);
        const uint32_t number = uint32_t(random()) >> random() % 32;
        switch (random() % 6) {
            case 0:
                bytes[at] ^= static_cast<char>(1 << random() % 8);
                break;
            case 1:
                bytes.insert(at, length, static_cast<char>(random()));
                break;
            case 2:
                bytes.erase(at, length);
                break;
            case 3:
                bytes.insert(random() % bytes.size(), bytes.substr(at, length));
                break;
            case 4:
                if (bytes.size() - at >= sizeof number) std::memcpy(&bytes[at], &number, sizeof number);
                break;
            default:
                bytes.resize(at);
        }
    }
    return bytes;
}

} // namespace

TEST_CASE("fuzz readers: every reader accepts its seeds", "[fuzz]") {
    for (const Target& target : fuzz::targets())
        for (const std::string& seed : fuzz::seeds(target.name)) {
            CAPTURE(target.name, seed.size());
            CHECK(target.read(seed));
        }
}

TEST_CASE("fuzz readers: corrupted inputs are read or refused without other exceptions", "[fuzz]") {
    for (const Target& target : fuzz::targets()) {
        std::mt19937 random(11);
        const auto all = inputs(target);
        int refused = 0;
        for (int n = 0; n < 200; ++n) {
            CAPTURE(target.name, n);
            bool read = false;
            CHECK_NOTHROW(read = target.read(damaged(all[random() % all.size()], random)));
            refused += read ? 0 : 1;
        }
        CHECK(refused > 0);
    }
}

// Not run by default. Tests each reader for CURLEW_FUZZ_SECONDS with inputs that ignore its code coverage.
TEST_CASE("fuzz readers: random corruption for CURLEW_FUZZ_SECONDS per reader", "[.][fuzz]") {
    const char* given = std::getenv("CURLEW_FUZZ_SECONDS");
    const std::chrono::duration<double> each(given ? std::atof(given) : 1);
    for (const Target& target : fuzz::targets()) {
        std::mt19937 random(std::random_device{}());
        auto pool = inputs(target);
        const auto begin = std::chrono::steady_clock::now();
        size_t executions = 0, taken = 0;
        for (; std::chrono::steady_clock::now() - begin < each; ++executions) {
            const std::string input = damaged(pool[random() % pool.size()], random);
            if (!target.read(input)) continue;
            ++taken;
            if (pool.size() < 2000) pool.push_back(input);
        }
        std::cout << target.name << ": " << executions << " executions, " << taken << " read\n" << std::flush;
    }
}
