#include "curlew/app/Session.h"
#include "curlew/field/Algebra.h"

#include <catch2/catch.hpp>
#include <openvdb/tools/LevelSetSphere.h>

using namespace curlew;
using namespace curlew::app;
using Catch::Matchers::Contains;

namespace {

Console& silent() {
    static Console console(nullptr);
    console.setVerbosity(Verbosity::quiet);
    return console;
}

openvdb::FloatGrid::Ptr ball(float halfWidth = 3) {
    return openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(1, openvdb::Vec3f(0), 0.1f, halfWidth);
}

FieldObject shape(double radius) {
    const Sdf sdf = sphereSdf(radius);
    return {sdf.distance, "sphere", sdf, {}};
}

} // namespace

TEST_CASE("the newest object of a stack has age 0", "[app]") {
    Stack<int> stack("thing");
    CHECK(stack.empty());
    CHECK_THROWS_WITH(stack.at(), "there is no thing yet");
    CHECK_THROWS_AS(stack.take(), ValueError);
    for (int k = 0; k < 4; ++k) stack.push(k, 10 + static_cast<uint64_t>(k));
    CHECK(stack.at() == 3);
    CHECK(stack.at(3) == 0);
    CHECK(stack.entry(1).made == 12);
    CHECK(stack.take(1) == 2); // the others move up
    CHECK(stack.size() == 3);
    CHECK(stack.at(1) == 1);
    CHECK_THROWS_WITH(stack.at(3), Contains("thing of age 3") && Contains("are 3"));
    stack.at() = 7;
    CHECK(stack.take() == 7);
    CHECK(stack.take() == 1);
    CHECK_THROWS_WITH(stack.at(1), Contains("is 1"));
}

TEST_CASE("a session finds the newest of a kind among others", "[app]") {
    Session session(silent());
    CHECK_FALSE(session.hasParticles());
    CHECK_FALSE(session.velocity());
    CHECK_FALSE(session.newestLevelSet());
    CHECK_FALSE(session.newestField(true));
    CHECK_THROWS_WITH(session.particles(), Contains("-scatter"));
    CHECK_THROWS_WITH(session.newestSdf(0), Contains("no shape or level set"));

    Particles one, two;
    one.x = {1};
    two.x = {1, 2};
    session.geometry.push(one, session.now());
    session.geometry.push(two, session.now());
    session.geometry.push(std::make_shared<const Mesh>(), session.now());
    CHECK(session.hasParticles());
    CHECK(session.particles().size() == 2);
    CHECK(session.particles(1).size() == 1);
    CHECK_THROWS_AS(session.particles(2), ValueError);

    const auto velocity = openvdb::Vec3SGrid::create();
    session.grids.push({velocity, nullptr}, session.now());
    session.grids.push({ball(), nullptr}, session.now());
    session.grids.push({openvdb::FloatGrid::create(), nullptr}, session.now());
    CHECK(session.velocity() == velocity);
    CHECK(session.newestLevelSet() == 1);

    session.fields.push(shape(1), session.now());
    session.fields.push({constantField(1), "constant", {}, {}}, session.now());
    session.fields.push(shape(2), session.now());
    CHECK(session.newestField(true) == 0);
    CHECK(session.newestField(false) == 1);
}

TEST_CASE("of a shape and a level set, the one made last is the wall", "[app]") {
    Session session(silent());
    const Vec3d origin{};
    session.grids.push({ball(10), nullptr}, session.now());
    CHECK(std::abs(session.newestSdf(0).distance.at<0>({{0.9, 0, 0}}).value + 0.1) < 1e-3);
    session.fields.push(shape(3), session.now());
    CHECK(session.newestSdf(0).distance.at<0>(origin).value == -3);
    session.grids.push({ball(10), nullptr}, session.now());
    CHECK(std::abs(session.newestSdf(0).distance.at<0>({{0.9, 0, 0}}).value + 0.1) < 1e-3);
}

TEST_CASE("a level set's band is widened where it does not reach, once", "[app]") {
    Session session(silent());
    session.grids.push({ball(3), nullptr}, session.now());
    const auto narrow = session.grids.at().grid;
    // Within the spline's support of the surface nothing has to be done.
    session.levelSetSdf(0, 0);
    CHECK(session.grids.at().grid == narrow);
    const Sdf sdf = session.levelSetSdf(0, 0.5);
    CHECK(sdf.reach >= 0.5 - 1e-6);
    const auto wide = session.grids.at().grid;
    CHECK(wide != narrow);
    CHECK(session.grids.size() == 1);
    session.levelSetSdf(0, 0.4);
    CHECK(session.grids.at().grid == wide);
    CHECK_THROWS_AS(session.levelSetSdf(1, 0), ValueError);
    session.grids.push({openvdb::Vec3SGrid::create(), nullptr}, session.now());
    CHECK_THROWS_WITH(session.levelSetSdf(0, 0), Contains("vec3s"));
}

TEST_CASE("the session's moments and time go forward", "[app]") {
    Session session(silent());
    const uint64_t first = session.now();
    CHECK(session.now() > first);
    CHECK(first > 0); // 0 stands for never
    const double seconds = session.seconds();
    CHECK(seconds >= 0);
    CHECK(session.seconds() >= seconds);
}
