// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Curves.h"

#include <vector>

namespace curlew {

/// Throws ValueError if the arrays of the curves differ in length.
void checkArrays(const Curves& curves);

/// Throws ValueError if an id or the index of a vertex does not fit in 32 bits.
void checkIds(const Curves& curves);

/// Returns the name of Curves::along in files: length or time.
const char* alongName(const Curves& curves);

/// Returns the curve of each vertex.
std::vector<size_t> owners(const Curves& curves);

} // namespace curlew
