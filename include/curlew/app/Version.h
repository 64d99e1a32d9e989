// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace curlew::app {

extern const char* const kVersion;   ///< "0.2.0"
extern const char* const kCommit;    ///< "1f3b5c7d90", "1f3b5c7d90-dirty", or "unknown" if not built in a checkout.
extern const char* const kLibraries; ///< Those it was built with: "OpenVDB 10.0.1, oneTBB 2021.8.0, …".

/// "curlew 0.2.0 (1f3b5c7d90, AVX2)": the version, the commit and the instruction set in use.
std::string versionLine();

} // namespace curlew::app
