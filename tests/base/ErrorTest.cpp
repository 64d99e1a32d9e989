// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/Error.h"
#include "support/Catch.h"

using namespace curlew;

TEST_CASE("Error: every exception of the library derives from it and keeps its message", "[base]") {
    CHECK_THROWS_AS(throw ValueError("v"), Error);
    CHECK_THROWS_AS(throw FileError("f"), Error);
    CHECK_THROWS_AS(throw ResourceError("r"), Error);
    CHECK_THROWS_AS(throw Interrupted(), Error);
    CHECK_THROWS_WITH(throw ValueError("width -1 must be positive"), "width -1 must be positive");
    CHECK_THROWS_WITH(throw Interrupted(), "interrupted");
}
