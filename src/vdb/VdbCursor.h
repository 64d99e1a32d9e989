// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <istream>
#include <optional>
#include <string>

namespace curlew {

/// A read position in an untrusted .vdb file. Throws a FileError that names the file if a size would lead outside the
/// file. A read past the end throws the stream's own exception.
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

    /// Skips a Blosc buffer of `packed` bytes, which must unpack to `unpacked` bytes. If `padded`, OpenVDB may have
    /// padded a small buffer to 128 bytes.
    void skipBlosc(uint64_t packed, uint64_t unpacked, bool padded = false);

    /// Checks a list of metadata. OpenVDB trusts the stored size of each value but, except for text, reads as many
    /// bytes as the type has. Returns the value of the text entry `wanted`, if there is one.
    std::optional<std::string> checkMetadata(const std::string& wanted = {});
    /// Checks a transform by reading it. Checks frustums first, since they contain the type of another map.
    void checkTransform();

  private:
    void checkDelayedLoad(uint64_t size);

    std::istream& mIn;
    const std::filesystem::path& mPath;
    std::streamoff mSize = 0;
};

} // namespace curlew
