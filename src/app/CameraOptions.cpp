#include "CameraOptions.h"

#include "Options.h"
#include "curlew/base/Error.h"

namespace curlew::app {

using namespace options;

std::vector<Option> cameraOptions() {
    Option fov = positive("fov", "35", "degrees", "that the longer edge of the picture spans");
    fov.upper = 170;
    return {vector("from", "0.6,0.45,1", "", "the direction from the subject to the camera, which sees all of it"),
            vector("up", "0,1,0", "", "what is upwards in the picture"),
            vector("eye", "", "world units", "where the camera is (default: as far away as it has to be)"),
            vector("target", "", "world units", "what it looks at (default: the middle of the subject)"),
            fov,
            integer("width", "960", 1, 32768, "pixels across"),
            integer("height", "720", 1, 32768, "pixels down")};
}

Camera cameraOf(const Arguments& a, const Box& subject) {
    const auto width = static_cast<int>(a.integer("width")), height = static_cast<int>(a.integer("height"));
    if (a.given("eye")) {
        if (!a.given("target") && !subject.finite()) throw ValueError("the subject is infinite; give target=");
        return {a.vector("eye"), a.given("target") ? a.vector("target") : subject.center(),
                a.vector("up"),  a.real("fov"),
                width,           height};
    }
    if (a.given("target")) throw ValueError("target= needs eye=; without them, the camera sees all of the subject");
    return Camera::around(subject, a.vector("from"), a.vector("up"), a.real("fov"), width, height);
}

} // namespace curlew::app
