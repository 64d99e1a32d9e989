#pragma once

#include "curlew/base/Parallel.h"

#include <algorithm>
#include <array>
#include <ostream>
#include <string>

namespace curlew {

/// Lets `format(begin, end, text)` append the records [begin, end) to a text, on all threads, and writes the pieces in
/// order. Only a few of them exist at a time.
template <class Format>
void writeChunks(std::ostream& out, size_t count, const Format& format) {
    constexpr size_t kPieces = 64, kGrain = 4096;
    std::array<std::string, kPieces> pieces;
    for (size_t first = 0; first < count; first += kPieces * kGrain) {
        const size_t size = std::min(count - first, kPieces * kGrain);
        parallelFor(size, kGrain, [&](size_t begin, size_t end) {
            std::string& piece = pieces[begin / kGrain];
            piece.clear();
            format(first + begin, first + end, piece);
        });
        for (size_t n = 0; n * kGrain < size; ++n)
            out.write(pieces[n].data(), static_cast<std::streamsize>(pieces[n].size()));
    }
}

} // namespace curlew
