// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Error.h"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

namespace curlew {

/// Converts a big-endian value.
template <class T>
T bigAt(const char* bytes) {
    std::array<char, sizeof(T)> value{};
    for (size_t k = 0; k < sizeof(T); ++k) value[sizeof(T) - 1 - k] = bytes[k];
    return std::bit_cast<T>(value);
}

/// Reads the big-endian values of a .bgeo one after the other. Functions that read or skip throw FileError at the end
/// of the file.
class BgeoInput {
  public:
    /// `path` must outlive this.
    explicit BgeoInput(const std::filesystem::path& path);

    size_t position() const { return mEnd - (mWindow.size() - mNext); }
    size_t left() const { return mSize - position(); }

    /// Returns the next bytes, which are valid until the next call.
    std::string_view bytes(size_t count) {
        if (count > mWindow.size() - mNext) refill(count);
        mNext += count;
        return std::string_view(mWindow).substr(mNext - count, count);
    }
    /// Copies the next bytes, which may be many.
    void copy(char* to, size_t count);
    void skip(size_t count) {
        if (count <= mWindow.size() - mNext)
            mNext += count;
        else
            skipFar(count);
    }
    void moveTo(size_t position);

    template <class T>
    T read() {
        return bigAt<T>(bytes(sizeof(T)).data());
    }
    /// Reads a number that must not be negative.
    size_t count();
    /// Reads a text after its length: 16 bits, or 32 bits after -1.
    std::string text();

    FileError error(std::string_view what) const;
    FileError cutShort() const { return error("it is cut short or damaged; write or copy it again"); }

  private:
    void refill(size_t count);
    void skipFar(size_t count);
    void readTo(char* to, size_t count);

    const std::filesystem::path& mPath;
    std::ifstream mIn;
    size_t mSize = 0;
    std::string mWindow;
    size_t mNext = 0; ///< Index in the window.
    size_t mEnd = 0;  ///< Position in the file after the window.
};

} // namespace curlew
