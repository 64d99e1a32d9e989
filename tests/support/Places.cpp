// SPDX-License-Identifier: Apache-2.0
#include "support/Places.h"

namespace curlew::test {

std::string sourceDir() { return CURLEW_SOURCE_DIR; }

std::string dataDir() { return sourceDir() + "/tests/data"; }

std::string command() { return CURLEW_COMMAND; }

} // namespace curlew::test
