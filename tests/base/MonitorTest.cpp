// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Monitor.h"
#include "support/Catch.h"

using namespace curlew;

TEST_CASE("Monitor: check throws only after cancellation", "[base]") {
    bool stop = false;
    const Monitor monitor{.report = {}, .cancelled = [&] { return stop; }};
    CHECK_NOTHROW(Monitor{}.check());
    CHECK_NOTHROW(monitor.check());
    stop = true;
    CHECK_THROWS_AS(monitor.check(), Interrupted);
}
