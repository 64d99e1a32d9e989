// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/registry/InContext.h"
#include "support/Catch.h"

using namespace curlew;
using namespace curlew::app;

TEST_CASE("inContextOf: prepends the context to an error and keeps its type", "[app]") {
    CHECK(inContextOf("-noise", [] { return 7; }) == 7);
    const auto run = [](const auto& work) { inContextOf("-noise", work); };
    CHECK_THROWS_AS(run([] { throw ValueError("why"); }), ValueError);
    CHECK_THROWS_AS(run([] { throw FileError("why"); }), FileError);
    CHECK_THROWS_AS(run([] { throw ResourceError("why"); }), ResourceError);
    CHECK_THROWS_AS(run([] { throw Interrupted(); }), Interrupted);
    CHECK_THROWS_WITH(run([] { throw ValueError("why"); }), "-noise: why");
    CHECK_THROWS_WITH(run([] { throw FileError("why"); }), "-noise: why");
    CHECK_THROWS_WITH(run([] { throw ResourceError("why"); }), "-noise: why");
    // Exceptions of OpenVDB get the context, too.
    CHECK_THROWS_AS(run([] { OPENVDB_THROW(openvdb::IoError, "why"); }), ValueError);
    CHECK_THROWS_WITH(run([] { OPENVDB_THROW(openvdb::IoError, "why"); }),
                      Catch::StartsWith("-noise: ") && Catch::ContainsSubstring("why"));
    CHECK_THROWS_WITH(inContextOf("a.txt:3", [&] { run([] { throw ValueError("why"); }); }), "a.txt:3: -noise: why");
}
