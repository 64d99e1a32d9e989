// SPDX-License-Identifier: Apache-2.0
#include "CameraOptions.h"

#include "Actions.h"

namespace curlew::app {

using namespace options;

std::vector<Option> cameraOptions() {
    const CameraOptions o;
    Option fov =
        positive("fov", fmt::format("{}", o.fieldOfView), "degrees", "that the longer edge of the picture spans");
    fov.upper = 170;
    return {vector("from", fmt::format("{}", fmt::join(o.from.c, ",")), "",
                   "the direction from the subject to the camera, which sees all of it"),
            vector("up", fmt::format("{}", fmt::join(o.up.c, ",")), "", "what is upwards in the picture"),
            vector("eye", "", "world units", "where the camera is (default: as far away as it has to be)"),
            vector("target", "", "world units", "what it looks at (default: the middle of the subject)"),
            fov,
            integer("width", fmt::format("{}", o.width), 1, 32768, "pixels across"),
            integer("height", fmt::format("{}", o.height), 1, 32768, "pixels down")};
}

CameraOptions viewpointOf(const Arguments& a) {
    if (a.given("target") && !a.given("eye"))
        throw ValueError("target= needs eye=; without them, the camera sees all of the subject");
    return {.from = a.vector("from"),
            .up = a.vector("up"),
            .fieldOfView = a.real("fov"),
            .width = a.integer<int>("width"),
            .height = a.integer<int>("height")};
}

Camera cameraOf(const Arguments& a, const Box& subject) {
    const CameraOptions o = viewpointOf(a);
    if (!a.given("eye")) return Camera::around(subject, o);
    if (!a.given("target") && !subject.finite()) throw ValueError("the subject is infinite; give target=");
    const Vec3d target = a.given("target") ? a.vector("target") : subject.center();
    return {a.vector("eye"), target, o.up, o.fieldOfView, o.width, o.height};
}

} // namespace curlew::app
