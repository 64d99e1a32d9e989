// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>

namespace curlew {

// NOLINTBEGIN(modernize-avoid-c-arrays): a std::vector would clear what is overwritten anyway
template <class T>
using UninitializedArray = std::unique_ptr<T[]>;
/// Returns an array of arbitrary values. The system provides memory for those that are written.
template <class T>
UninitializedArray<T> uninitializedArray(size_t count) {
    return std::make_unique_for_overwrite<T[]>(count);
}
// NOLINTEND(modernize-avoid-c-arrays)

} // namespace curlew
