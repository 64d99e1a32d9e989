// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/Version.h"

#include "curlew/base/Simd.h"

#include <fmt/format.h>

namespace curlew::app {

std::string versionLine() { return fmt::format("curlew {} ({}, {})", kVersion, kCommit, nameOf(activeSimd())); }

} // namespace curlew::app
