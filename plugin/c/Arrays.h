// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew.h"
#include "curlew/base/Error.h"

#include <cstddef>
#include <cstring>

namespace curlew::c {

/// The kind of numbers in an array.
enum class Numbers { floats, integers };

/// Throws ValueError, naming the array, if it is invalid or does not have items with these components and numbers.
void checkArray(const curlew_array& array, const char* name, int components, Numbers numbers);
/// Checks a buffer in the same way. It must also have `count` items that do not overlap.
void checkBuffer(const curlew_buffer& buffer, const char* name, int64_t count, int components, Numbers numbers);

/// Returns the number of bytes from one item to the next.
ptrdiff_t strideOf(const curlew_array& array);
ptrdiff_t strideOf(const curlew_buffer& buffer);

template <class T>
T loadAs(const void* from) {
    T value;
    std::memcpy(&value, from, sizeof value);
    return value;
}
template <class T>
void storeAs(T value, void* to) {
    std::memcpy(to, &value, sizeof value);
}

/// Reads a number from an array of floats, which must have been checked.
inline double realAt(const curlew_array& array, ptrdiff_t stride, size_t item, size_t component) {
    const auto* from = static_cast<const char*>(array.data) + static_cast<ptrdiff_t>(item) * stride;
    return array.type == CURLEW_FLOAT32 ? static_cast<double>(loadAs<float>(from + component * sizeof(float)))
                                        : loadAs<double>(from + component * sizeof(double));
}
/// Reads a number from an array of integers.
inline int64_t integerAt(const curlew_array& array, ptrdiff_t stride, size_t item, size_t component) {
    const auto* from = static_cast<const char*>(array.data) + static_cast<ptrdiff_t>(item) * stride;
    return array.type == CURLEW_INT32 ? loadAs<int32_t>(from + component * sizeof(int32_t))
                                      : loadAs<int64_t>(from + component * sizeof(int64_t));
}
/// Writes a number to a buffer of floats.
inline void putReal(double value, const curlew_buffer& buffer, ptrdiff_t stride, size_t item, size_t component) {
    auto* to = static_cast<char*>(buffer.data) + static_cast<ptrdiff_t>(item) * stride;
    if (buffer.type == CURLEW_FLOAT32)
        storeAs(static_cast<float>(value), to + component * sizeof(float));
    else
        storeAs(value, to + component * sizeof(double));
}

/// Writes a number to a buffer of integers.
inline void putInteger(int64_t value, const curlew_buffer& buffer, ptrdiff_t stride, size_t item, size_t component) {
    auto* to = static_cast<char*>(buffer.data) + static_cast<ptrdiff_t>(item) * stride;
    if (buffer.type == CURLEW_INT32)
        storeAs(static_cast<int32_t>(value), to + component * sizeof(int32_t));
    else
        storeAs(value, to + component * sizeof(int64_t));
}

} // namespace curlew::c
