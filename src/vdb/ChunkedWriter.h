// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Parallel.h"

#include <algorithm>
#include <array>
#include <bit>
#include <ostream>
#include <string>

namespace curlew {

/// Calls `format(begin, end, text)` on all threads to append the records [begin, end) to a text, and writes the texts
/// in order. At most 64 texts exist at a time. A stream that can be cancelled (writeAtomically) is so after each of
/// them.
template <class Format>
void writeChunks(std::ostream& out, size_t count, const Format& format) {
    constexpr size_t kChunks = 64, kGrain = 1024;
    std::array<std::string, kChunks> chunks;
    for (size_t first = 0; first < count; first += kChunks * kGrain) {
        const size_t size = std::min(count - first, kChunks * kGrain);
        parallelFor(size, kGrain, [&](size_t begin, size_t end) {
            std::string& chunk = chunks[begin / kGrain];
            chunk.clear();
            format(first + begin, first + end, chunk);
        });
        for (size_t n = 0; n * kGrain < size; ++n)
            out.write(chunks[n].data(), static_cast<std::streamsize>(chunks[n].size()));
    }
}

/// Appends a value to a binary record in little-endian order.
template <class T>
void appendBytes(std::string& bytes, T value) {
    static_assert(std::endian::native == std::endian::little, "values are written as they are in memory");
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

} // namespace curlew
