#include "Actions.h"
#include "curlew/base/Simd.h"

namespace curlew::app {

const Registry& registry() {
    static const Registry all = [] {
        Registry actions;
        for (auto* group :
             {&fileActions,    &shapeActions,  &noiseActions,    &fieldActions,    &wallActions,    &flowActions,
              &windActions,    &carryActions,  &gridActions,     &spectrumActions, &pointActions,   &emitActions,
              &jitterActions,  &curveActions,  &levelSetActions, &imageActions,    &surfaceActions, &splatActions,
              &pictureActions, &reportActions, &programActions})
            for (auto& action : group()) actions.push_back(std::move(action));
        return actions;
    }();
    return all;
}

std::string versionText() {
    return fmt::format("curlew {} (OpenVDB {}, {})\n", CURLEW_VERSION, openvdb::getLibraryVersionString(),
                       nameOf(activeSimd()));
}

} // namespace curlew::app
