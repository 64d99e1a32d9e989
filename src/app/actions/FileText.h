// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/run/Context.h"

namespace curlew::app {

/// Describes what -write has written to a file, and its size: "5,000 points (P v id), 240.1 KiB".
std::string describedFile(const Context& c, const Arguments& a, const std::string& file);

} // namespace curlew::app
