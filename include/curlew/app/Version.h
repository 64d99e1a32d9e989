// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace curlew::app {

extern const char* const kVersion;   ///< "0.2.0"
extern const char* const kCommit;    ///< "1f3b5c7d90", "1f3b5c7d90-dirty", or "unknown" outside of a Git checkout.
extern const char* const kLibraries; ///< The libraries that it was built with: "OpenVDB 10.0.1, oneTBB 2021.8.0, …".

/// Returns the version, the commit and the instruction set in use: "curlew 0.2.0 (1f3b5c7d90, AVX2)".
std::string versionLine();

} // namespace curlew::app
