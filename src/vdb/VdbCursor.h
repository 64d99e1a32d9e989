// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <istream>
#include <optional>
#include <string>

namespace curlew {

/// A place in a .vdb file that is not trusted. Everything that would lead out of the file throws a FileError that names
/// it; a read past the end throws what the stream throws.
class VdbCursor {
  public:
    VdbCursor(std::istream& in, const std::filesystem::path& path);

    [[noreturn]] void damaged() const;
    const std::filesystem::path& path() const { return mPath; }
    std::istream& stream() { return mIn; }

    std::streamoff size() const { return mSize; }
    std::streamoff position() const { return mIn.tellg(); }
    std::streamoff left() const { return mSize - position(); }

    template <typename T>
    T read() {
        T value;
        mIn.read(reinterpret_cast<char*>(&value), sizeof value);
        return value;
    }
    void skip(uint64_t bytes) {
        if (bytes > uint64_t(left())) damaged();
        mIn.seekg(std::streamoff(bytes), std::ios::cur);
    }
    void seek(std::streamoff position) { mIn.seekg(position); }
    std::string readString();

    /// Skips a Blosc buffer of `packed` bytes, which must unpack to `unpacked`; where `padded`, OpenVDB may have filled
    /// a small one up to 128 bytes.
    void skipBlosc(uint64_t packed, uint64_t unpacked, bool padded = false);

    /// Checks a list of metadata: OpenVDB trusts the size of each value, but for text it reads what the type takes.
    /// Returns the value of the text entry `name`, if there is one.
    std::optional<std::string> checkMetadata(const std::string& name = {});
    /// Checks a transform by reading it: frustums first, which hold the type of another map.
    void checkTransform();

  private:
    void checkDelayedLoad(uint64_t size);

    std::istream& mIn;
    const std::filesystem::path& mPath;
    std::streamoff mSize = 0;
};

} // namespace curlew
