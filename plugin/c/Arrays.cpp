// SPDX-License-Identifier: Apache-2.0
#include "Arrays.h"

#include <fmt/format.h>

#include <cstdlib>

namespace curlew::c {

namespace {

bool isFloat(int32_t type) { return type == CURLEW_FLOAT32 || type == CURLEW_FLOAT64; }
bool isInteger(int32_t type) { return type == CURLEW_INT32 || type == CURLEW_INT64; }
ptrdiff_t sizeOf(int32_t type) { return type == CURLEW_FLOAT32 || type == CURLEW_INT32 ? 4 : 8; }

template <class Array>
ptrdiff_t strideOfAny(const Array& array) {
    return array.stride == 0 ? array.components * sizeOf(array.type) : static_cast<ptrdiff_t>(array.stride);
}

template <class Array>
void checkAny(const Array& array, const char* name, int components, Numbers numbers) {
    if (!isFloat(array.type) && !isInteger(array.type))
        throw ValueError(fmt::format("{} has the unknown type {}", name, array.type));
    if (numbers == Numbers::floats ? !isFloat(array.type) : !isInteger(array.type))
        throw ValueError(
            fmt::format("{} must be {}", name, numbers == Numbers::floats ? "float32 or float64" : "int32 or int64"));
    if (array.components != components)
        throw ValueError(fmt::format("{} must have {} component{}, not {}", name, components,
                                     components == 1 ? "" : "s", array.components));
    if (array.count < 0 || array.count > int64_t{1} << 48)
        throw ValueError(fmt::format("{} cannot have {} items", name, array.count));
    if (array.count > 0 && !array.data) throw ValueError(fmt::format("{} has no data", name));
}

} // namespace

void checkArray(const curlew_array& array, const char* name, int components, Numbers numbers) {
    checkAny(array, name, components, numbers);
}

void checkBuffer(const curlew_buffer& buffer, const char* name, int64_t count, int components, Numbers numbers) {
    checkAny(buffer, name, components, numbers);
    if (buffer.count != count)
        throw ValueError(fmt::format("{} must have {} items, not {}", name, count, buffer.count));
    if (std::abs(strideOf(buffer)) < components * sizeOf(buffer.type))
        throw ValueError(fmt::format("{} has overlapping items: its stride is {}", name, buffer.stride));
}

ptrdiff_t strideOf(const curlew_array& array) { return strideOfAny(array); }
ptrdiff_t strideOf(const curlew_buffer& buffer) { return strideOfAny(buffer); }

} // namespace curlew::c
