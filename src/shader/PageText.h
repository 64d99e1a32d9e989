// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace curlew {

// The constant parts of the page that shows a flow (curlew/shader/FlowPage.h).

extern const std::string_view kPageHead;      ///< The document until the data, with the styles.
extern const std::string_view kPagePrograms;  ///< GLSL, in script elements with ids.
extern const std::string_view kPageParticles; ///< JavaScript: programs, buffers and the steps of the particles.
extern const std::string_view kPageView;      ///< JavaScript: camera, drawing and controls.

} // namespace curlew
