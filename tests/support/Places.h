// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

/// Where things are on the machine that runs the tests. In a source file of its own, so that no other file's
/// compile command holds a path: compiler caches then serve every checkout.
namespace curlew::test {

/// The root of the sources.
std::string sourceDir();

/// tests/data.
std::string dataDir();

/// The built program curlew.
std::string command();

} // namespace curlew::test
