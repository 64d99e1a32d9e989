// SPDX-License-Identifier: Apache-2.0
#include "Actions.h"

namespace curlew::app {

const Registry& registry() {
    static const Registry all = [] {
        Registry actions;
        for (auto* group : {&fileActions,    &shapeActions,  &noiseActions,   &fieldActions,    &sampledActions,
                            &meshActions,    &wallActions,   &flowActions,    &windActions,     &gridFlowActions,
                            &railActions,    &carryActions,  &gridActions,    &spectrumActions, &pointActions,
                            &emitActions,    &jitterActions, &curveActions,   &levelSetActions, &imageActions,
                            &surfaceActions, &splatActions,  &pictureActions, &reportActions,   &programActions})
            for (auto& action : group()) actions.push_back(std::move(action));
        return actions;
    }();
    return all;
}

} // namespace curlew::app
