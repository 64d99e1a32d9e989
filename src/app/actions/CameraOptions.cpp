// SPDX-License-Identifier: Apache-2.0
#include "CameraOptions.h"

#include "Actions.h"

namespace curlew::app {

using namespace options;

std::vector<Option> cameraOptions() {
    const CameraOptions o;
    Option fov = positive("fov", fmt::format("{}", o.fieldOfView), "degrees",
                          "field of view along the longer edge of the picture");
    fov.upper = 170;
    return {
        vector("from", fmt::format("{}", fmt::join(o.from.c, ",")), "",
               "direction from the subject to the camera, which is placed so that the whole subject is visible"),
        vector("up", fmt::format("{}", fmt::join(o.up.c, ",")), "", "up vector of the camera"),
        vector("eye", "", "world units", "camera position (default: along from=, far enough to see the whole subject)"),
        formerly({"target"},
                 vector("aim", "", "world units", "point that the camera looks at (default: centre of the subject)")),
        fov,
        integer("width", fmt::format("{}", o.width), 1, 32768, "picture width in pixels"),
        integer("height", fmt::format("{}", o.height), 1, 32768, "picture height in pixels")};
}

Option viewBoxOption(const std::string& fallback) {
    return box("viewBox", "region that the camera sees (default: " + fallback + ")");
}

CameraOptions viewpointOf(const Arguments& a) {
    if (a.given("aim") && !a.given("eye"))
        throw ValueError("aim= needs eye=; give both, or neither to see the whole subject");
    return {.from = a.vector("from"),
            .up = a.vector("up"),
            .fieldOfView = a.real("fov"),
            .width = a.integer<int>("width"),
            .height = a.integer<int>("height")};
}

Camera cameraOf(const Arguments& a, const Box& subject) {
    const CameraOptions o = viewpointOf(a);
    if (!a.given("eye")) return Camera::around(subject, o);
    if (!a.given("aim") && !subject.finite()) throw ValueError("the subject is infinite; give aim=");
    const Vec3d target = a.given("aim") ? a.vector("aim") : subject.center();
    return {a.vector("eye"), target, o.up, o.fieldOfView, o.width, o.height};
}

} // namespace curlew::app
