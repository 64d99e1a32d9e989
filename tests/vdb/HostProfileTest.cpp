// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/HostProfile.h"
#include "curlew/vdb/PointFile.h"
#include "support/Catch.h"

using namespace curlew;

TEST_CASE("HostProfile: points keep their velocity under the attribute name of each host", "[vdb]") {
    Points particles;
    particles.x = {1}, particles.y = {2}, particles.z = {3}, particles.id = {0};
    particles.vx = {4}, particles.vy = {5}, particles.vz = {6};
    for (const HostProfile& host : kHostProfiles) {
        CAPTURE(host.name);
        PointGridOptions options;
        options.velocity = host.pointVelocity;
        const auto grid = pointGrid(particles, options);
        CHECK(grid->tree().cbeginLeaf()->hasAttribute(std::string(host.pointVelocity)));
        const Points read = pointsOf(*grid);
        REQUIRE(read.hasVelocity());
        CHECK(read.vy[0] == 5);
    }
}
