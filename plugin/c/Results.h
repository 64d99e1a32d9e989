// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew.h"
#include "curlew/app/run/Session.h"

namespace curlew::c {

/// Numbers in memory; consecutive ones are `step` numbers apart.
struct Column {
    std::variant<const float*, const double*, const int32_t*, const int64_t*, const uint64_t*, const uint32_t*,
                 const uint8_t*>
        data;
    size_t step = 1;
};

/// A named array of an object: `count` items, with one column per component.
struct NamedArray {
    std::string name;
    size_t count = 0;
    std::vector<Column> columns = {};
    std::shared_ptr<const void> owner = {}; ///< Owns the numbers if they are not part of the object.

    curlew_type type() const;
};

std::vector<NamedArray> arraysOf(const Points& particles);
std::vector<NamedArray> arraysOf(const app::AnyPositions& positions);
std::vector<NamedArray> arraysOf(const Curves& curves);
std::vector<NamedArray> arraysOf(const Mesh& mesh);
std::vector<NamedArray> arraysOf(const Image& image);

/// Copies the array to the buffer. Throws ValueError if the buffer does not fit.
void copy(const NamedArray& array, const curlew_buffer& buffer);

} // namespace curlew::c
