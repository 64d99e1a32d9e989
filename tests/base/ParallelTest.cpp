// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Parallel.h"
#include "curlew/base/Random.h"
#include "support/Catch.h"

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <limits>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

using namespace curlew;

namespace {

using Chunks = std::set<std::pair<size_t, size_t>>;

Chunks chunksOf(size_t count, size_t grain) {
    Chunks chunks;
    std::mutex mutex;
    parallelFor(count, grain, [&](size_t begin, size_t end) {
        const std::lock_guard lock(mutex);
        chunks.emplace(begin, end);
    });
    return chunks;
}

} // namespace

TEST_CASE("parallelFor: covers every index exactly once in chunks no larger than the grain", "[base]") {
    const size_t count = GENERATE(size_t{0}, size_t{1}, size_t{63}, size_t{64}, size_t{65}, size_t{10007});
    const size_t grain =
        GENERATE(size_t{0}, size_t{1}, size_t{7}, size_t{64}, size_t{20000}, std::numeric_limits<size_t>::max());
    CAPTURE(count, grain);
    std::vector<std::atomic<int>> visits(count);
    std::atomic<size_t> longest = 0;
    parallelFor(count, grain, [&](size_t begin, size_t end) {
        for (size_t k = begin; k < end; ++k) ++visits[k];
        for (size_t seen = longest; end - begin > seen && !longest.compare_exchange_weak(seen, end - begin);) {
        }
    });
    CHECK(std::all_of(visits.begin(), visits.end(), [](const auto& n) { return n == 1; }));
    CHECK(longest <= std::max<size_t>(grain, 1));
}

TEST_CASE("parallelFor: chunks do not depend on the number of threads", "[base]") {
    Chunks one, two;
    {
        const ThreadLimit limit(1);
        one = chunksOf(1001, 10);
    }
    {
        const ThreadLimit limit(2);
        two = chunksOf(1001, 10);
    }
    CHECK(one == two);
    CHECK(one == chunksOf(1001, 10));
    CHECK(one.size() == 101);
}

TEST_CASE("ThreadLimit: a limit of one keeps the loop on the calling thread", "[base]") {
    const auto threads = [] {
        std::set<std::thread::id> ids;
        std::mutex mutex;
        parallelFor(200, 1, [&](size_t, size_t) {
            const std::lock_guard lock(mutex);
            ids.insert(std::this_thread::get_id());
        });
        return ids;
    };
    const ThreadLimit limit(1);
    CHECK(threads() == std::set{std::this_thread::get_id()});
    const ThreadLimit wider(0); // cannot exceed the enclosing limit
    CHECK(threads().size() == 1);
}

TEST_CASE("parallelFor: an exception in the body reaches the caller unchanged", "[base]") {
    struct Odd {
        size_t where;
    };
    const auto loop = [](size_t bad) {
        parallelFor(1000, 10, [&](size_t begin, size_t end) {
            if (begin <= bad && bad < end) throw Odd{begin};
        });
    };
    for (const size_t bad : {size_t{0}, size_t{555}, size_t{999}}) {
        CAPTURE(bad);
        try {
            loop(bad);
            FAIL("no exception");
        } catch (const Odd& odd) {
            CHECK(odd.where == bad / 10 * 10);
        }
    }
    CHECK_NOTHROW(loop(1000));
}

TEST_CASE("parallelFor and parallelSum: cancellation ends the loop early with Interrupted", "[base]") {
    const ThreadLimit limit(1);
    size_t calls = 0;
    const Monitor monitor{.report = {}, .cancelled = [&] { return calls >= 3; }};
    CHECK_THROWS_AS(parallelFor(
                        100, 1, [&](size_t, size_t) { ++calls; }, monitor),
                    Interrupted);
    CHECK(calls == 3);
    CHECK_THROWS_AS(parallelSum(
                        100, 1, [&](size_t, size_t) { return 1.0; }, monitor),
                    Interrupted);
}

TEST_CASE("parallelFor: progress reports increase to one and never overlap", "[base]") {
    std::vector<double> reports;
    std::atomic<int> inside = 0;
    bool together = false;
    const Monitor monitor{.report =
                              [&](double fraction) {
                                  together |= ++inside > 1;
                                  reports.push_back(fraction);
                                  --inside;
                              },
                          .cancelled = {}};
    parallelFor(
        1000, 3, [](size_t, size_t) {}, monitor);
    CHECK_FALSE(together);
    CHECK(reports.size() == 334);
    CHECK(std::is_sorted(reports.begin(), reports.end()));
    CHECK(reports.back() == 1);
}

TEST_CASE("isolated: work that waits for other threads takes no chunk of the loop around it", "[base]") {
    // More threads than processors, so that some take parts of the inner loops.
    tbb::global_control threads(tbb::global_control::max_allowed_parallelism, 8);
    tbb::task_arena arena(8);
    thread_local bool waiting = false;
    std::atomic<int> taken = 0;
    const auto nested = [&] {
        parallelFor(20000, 1, [&](size_t, size_t) {
            taken += waiting ? 1 : 0;
            waiting = true;
            isolated([] {
                parallelFor(16, 1, [](size_t begin, size_t) {
                    for (volatile size_t k = 0; k < 2000 * (begin % 3);) k = k + 1; // other threads are still busy
                });
            });
            waiting = false;
        });
    };
    for (int run = 0; run < 8; ++run) arena.execute(nested); // without isolated(), half of the runs take one
    CHECK(taken == 0);
}

TEST_CASE("parallelSum: gives the same bits for any number of threads", "[base]") {
    // Terms with very different magnitudes and signs: sums in different orders differ in bits.
    const auto term = [](size_t k) { return (randomUniform(3, k) - 0.5) * std::exp2(60 * randomUniform(3, k, 1)); };
    const auto sum = [&](int threads) {
        const ThreadLimit limit(threads);
        return parallelSum(100000, 64, [&](size_t begin, size_t end) {
            double s = 0;
            for (size_t k = begin; k < end; ++k) s += term(k);
            return s;
        });
    };
    double reversed = 0;
    for (size_t k = 100000; k-- > 0;) reversed += term(k);
    const double one = sum(1);
    CHECK(std::bit_cast<uint64_t>(one) != std::bit_cast<uint64_t>(reversed)); // confirms that the order matters
    for (int run = 0; run < 10; ++run) CHECK(std::bit_cast<uint64_t>(sum(2)) == std::bit_cast<uint64_t>(one));
    const double all = parallelSum(1000, 7, [](size_t begin, size_t end) {
        return static_cast<double>((end * (end - 1) - begin * (begin - 1)) / 2); // whole numbers: exact
    });
    CHECK(all == 499500);
    CHECK(parallelSum(0, 7, [](size_t, size_t) { return 1.0; }) == 0);
}

TEST_CASE("Background: tasks run in order and wait returns after the last", "[base]") {
    for (const int threads : {1, 2}) {
        const ThreadLimit limit(threads);
        std::vector<int> done;
        {
            Background background;
            for (int k = 0; k < 5; ++k) background.run([&done, k] { done.push_back(k); });
            background.wait();
            CHECK(done == std::vector<int>{0, 1, 2, 3, 4});
            background.run([&done] { done.push_back(5); });
        }
        CHECK(done.size() == 6); // the destructor waits, too
    }
}
