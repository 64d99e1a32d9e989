// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace curlew {

// The constant parts of the page that shows a flow (curlew/shader/FlowPage.h).

extern const std::string_view kPageHead;      ///< The document until the data, with the styles.
extern const std::string_view kPageShared;    ///< Functions of programs, in GLSL that can be translated.
extern const std::string_view kPagePrograms;  ///< GLSL, in script elements with ids.
extern const std::string_view kPageParticles; ///< JavaScript: data, places, and particles in a loop.
extern const std::string_view kPageWebGl;     ///< JavaScript: steps and drawing with WebGL 2.
extern const std::string_view kPageWebGpu;    ///< WGSL in script elements, and JavaScript: the same with WebGPU.
extern const std::string_view kPageView;      ///< JavaScript: camera, frames and controls.

} // namespace curlew
