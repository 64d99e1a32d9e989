// SPDX-License-Identifier: Apache-2.0
#include "PictureValidation.h"

#include "curlew/base/Error.h"
#include "curlew/base/Memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <string>
#include <vector>

namespace curlew {

namespace {

namespace fs = std::filesystem;

/// Maximum compression ratio of deflate: 258 bytes in two bits at best (zlib's technical notes).
constexpr double kDeflate = 1032;

void checkClaim(const fs::path& path, double pixelBytes, double ratio, double fileBytes) {
    if (pixelBytes > ratio * fileBytes)
        throw FileError(fmt::format(
            "cannot read '{}': it is damaged: its header claims more pixels than the file can hold", path.string()));
}

void requirePicture(const fs::path& path, double bytes) {
    requireMemory(bytes, fmt::format("the picture '{}'", path.string()), "make it smaller");
}

/// The attribute types of fixed size, and that size.
const std::map<std::string_view, uint32_t>& fixedSizes() {
    static const std::map<std::string_view, uint32_t> kSizes{{"box2f", 16},
                                                             {"box2i", 16},
                                                             {"chromaticities", 32},
                                                             {"compression", 1},
                                                             {"deepImageState", 1},
                                                             {"double", 8},
                                                             {"envmap", 1},
                                                             {"float", 4},
                                                             {"int", 4},
                                                             {"keycode", 28},
                                                             {"lineOrder", 1},
                                                             {"m33d", 72},
                                                             {"m33f", 36},
                                                             {"m44d", 128},
                                                             {"m44f", 64},
                                                             {"rational", 8},
                                                             {"tiledesc", 9},
                                                             {"timecode", 8},
                                                             {"v2d", 16},
                                                             {"v2f", 8},
                                                             {"v2i", 8},
                                                             {"v3d", 24},
                                                             {"v3f", 12},
                                                             {"v3i", 12}};
    return kSizes;
}

/// Properties of a compression: lines per chunk, and maximum compression ratio.
struct Compression {
    int64_t lines;
    double ratio;
};
/// In the order of their numbers in the format: none, RLE, ZIPS, ZIP, PIZ (Huffman codes of runs of 255), PXR24 (24 of
/// 32 bits), B44, B44A (3 bytes for a block of 32), DWAA, DWAB (runs of runs).
constexpr std::array<Compression, 10> kCompressions{{{1, 1},
                                                     {1, 64},
                                                     {1, kDeflate},
                                                     {16, kDeflate},
                                                     {32, kDeflate},
                                                     {16, 4.0 / 3 * kDeflate},
                                                     {32, 11},
                                                     {32, 11},
                                                     {32, 64 * kDeflate},
                                                     {256, 64 * kDeflate}}};

class ExrValidation {
  public:
    ExrValidation(std::istream& in, const fs::path& path) : mIn(in), mPath(path) {
        mIn.seekg(0, std::ios::end);
        mSize = mIn.tellg();
        mIn.seekg(0);
    }

    void check() {
        constexpr uint32_t parts = 0x1000;
        read<uint32_t>(); // magic number
        const bool multiple = (read<uint32_t>() & parts) != 0;
        checkHeader(); // the first part is the one read
        checkPixels();
        while (multiple && checkHeader()) {
        }
    }

  private:
    [[noreturn]] void damaged() const {
        throw FileError(fmt::format("cannot read '{}': its header is damaged", mPath.string()));
    }

    template <class T>
    T read() {
        T value{};
        if (!mIn.read(reinterpret_cast<char*>(&value), sizeof value)) damaged();
        return value;
    }

    void skip(int64_t bytes) {
        if (bytes < 0 || bytes > mSize - mIn.tellg()) damaged();
        mIn.seekg(bytes, std::ios::cur);
    }

    std::string readName() {
        constexpr size_t longest = 255;
        std::string name;
        while (const char c = read<char>()) {
            name += c;
            if (name.size() > longest) damaged();
        }
        return name;
    }

    /// Returns false for the empty header that ends the list.
    bool checkHeader() {
        for (bool any = false;; any = true) {
            const std::string name = readName();
            if (name.empty()) return any;
            const std::string type = readName();
            const auto size = read<int32_t>();
            if (size < 0 || size > mSize - mIn.tellg()) damaged();
            const std::streamoff end = mIn.tellg() + std::streamoff(size);
            checkValue(name, type, size);
            mIn.seekg(end);
        }
    }

    void checkValue(const std::string& name, const std::string& type, int64_t size) {
        const std::streamoff end = mIn.tellg() + std::streamoff(size);
        if (const auto fixed = fixedSizes().find(type); fixed != fixedSizes().end() && fixed->second != size) damaged();
        if (type == "preview") {
            const int64_t width = read<uint32_t>(), height = read<uint32_t>();
            if (width != 0 && height > (size - 8) / 4 / width) damaged();
            if (8 + 4 * width * height != size) damaged();
        } else if (type == "stringvector") {
            while (mIn.tellg() < end) skip(read<int32_t>());
            if (mIn.tellg() != end) damaged();
        } else if (type == "chlist") {
            checkChannels(end);
        } else if (type == "floatvector") {
            if (size % 4 != 0) damaged();
        } else if (name == "dataWindow" && type == "box2i") {
            for (int64_t& corner : mWindow) corner = read<int32_t>();
        } else if (name == "compression" && type == "compression") {
            mCompression = read<uint8_t>();
        } else if (name == "tiles" && type == "tiledesc") {
            for (int64_t& length : mTile) length = read<uint32_t>();
        }
    }

    void checkChannels(std::streamoff end) {
        constexpr std::array<int64_t, 3> bytes{4, 2, 4}; // uint, half, float
        while (!readName().empty()) {
            const auto type = read<uint32_t>();
            skip(4);
            const auto x = read<int32_t>(), y = read<int32_t>();
            if (type >= bytes.size() || x < 1 || y < 1) damaged();
            mPixelBytes += bytes[type];
            ++mChannels;
        }
        if (mIn.tellg() != end) damaged();
    }

    void checkPixels() {
        const int64_t width = mWindow[2] - mWindow[0] + 1, height = mWindow[3] - mWindow[1] + 1;
        if (width < 1 || height < 1 || mCompression >= kCompressions.size()) damaged();
        if (width > std::numeric_limits<int32_t>::max() || height > std::numeric_limits<int32_t>::max()) damaged();
        const Compression& compression = kCompressions[mCompression];
        const bool tiled = mTile[0] > 0 && mTile[1] > 0;
        const auto pieces = [](int64_t length, int64_t piece) { return (length + piece - 1) / piece; };
        const double chunks = tiled ? double(pieces(width, mTile[0])) * double(pieces(height, mTile[1]))
                                    : double(pieces(height, compression.lines));
        const double pixels = double(width) * double(height);
        checkClaim(mPath, chunks * sizeof(int64_t), 1, double(mSize)); // the table of their offsets
        checkClaim(mPath, pixels * double(mPixelBytes), compression.ratio, double(mSize));
        requirePicture(mPath, pixels * double(mChannels) * sizeof(float));
    }

    std::istream& mIn;
    const fs::path& mPath;
    std::streamoff mSize = 0;
    std::array<int64_t, 4> mWindow{0, 0, -1, -1}; ///< Minimum x and y, maximum x and y.
    std::array<int64_t, 2> mTile{};
    uint8_t mCompression = 0;
    int64_t mPixelBytes = 0, mChannels = 0;
};

uint32_t bigEndian(std::string_view bytes, size_t at) {
    uint32_t value = 0;
    for (size_t k = at; k < at + 4; ++k) value = value << 8 | static_cast<unsigned char>(bytes[k]);
    return value;
}

} // namespace

void validatePng(std::string_view bytes, const fs::path& path) {
    constexpr size_t width = 16, height = 20, depth = 24, color = 25; // offsets in the file
    if (bytes.size() <= color) throw FileError(fmt::format("cannot read '{}': it is cut off", path.string()));
    // By colour type: grey, unused, RGB, palette, grey and alpha, unused, RGBA.
    constexpr std::array<double, 7> channels{1, 1, 3, 1, 2, 1, 4};
    const auto type = std::min<size_t>(static_cast<unsigned char>(bytes[color]), channels.size() - 1);
    const double bits = channels[type] * static_cast<unsigned char>(bytes[depth]);
    const double pixels = double(bigEndian(bytes, width)) * double(bigEndian(bytes, height));
    checkClaim(path, pixels * bits / 8, kDeflate, double(bytes.size()));
    constexpr double decoded = 3 * sizeof(char) + 3 * sizeof(float);
    requirePicture(path, pixels * decoded);
}

void validateExr(std::istream& in, const fs::path& path) { ExrValidation(in, path).check(); }

} // namespace curlew
