#pragma once

#include "curlew/app/registry/Registry.h"

namespace curlew::app {

/// All actions of Curlew, in the order in which help lists them.
const Registry& registry();

/// "curlew 0.1.0 (OpenVDB 10.0.1, AVX2)" and a line break.
std::string versionText();

} // namespace curlew::app
