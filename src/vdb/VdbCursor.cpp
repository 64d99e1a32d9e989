// SPDX-License-Identifier: Apache-2.0
#include "VdbCursor.h"

#include "curlew/base/Error.h"
#include "curlew/vdb/Openvdb.h"

#include <blosc.h>
#include <fmt/format.h>
#include <openvdb/Metadata.h>
#include <openvdb/math/Transform.h>

#include <array>
#include <limits>

namespace curlew {

VdbCursor::VdbCursor(std::istream& in, const std::filesystem::path& path) : mIn(in), mPath(path) {
    in.seekg(0, std::ios::end);
    mSize = in.tellg();
    in.seekg(0);
}

void VdbCursor::damaged() const {
    throw FileError(fmt::format("'{}' is cut short or damaged; write or copy it again", mPath.string()));
}

std::string VdbCursor::readString() {
    const auto length = read<uint32_t>();
    if (length > left()) damaged();
    std::string text(length, '\0');
    mIn.read(text.data(), length);
    return text;
}

void VdbCursor::skipBlosc(uint64_t packed, uint64_t unpacked, bool padded) {
    constexpr uint64_t paddedSize = 128; // openvdb::compression::BLOSC_PAD_BYTES
    if (packed < BLOSC_MIN_HEADER_LENGTH) damaged();
    const auto header = read<std::array<char, BLOSC_MIN_HEADER_LENGTH>>();
    size_t size = 0;
    if (blosc_cbuffer_validate(header.data(), packed, &size) != 0) damaged();
    if (size != unpacked && !(padded && size == paddedSize && unpacked <= paddedSize)) damaged();
    skip(packed - header.size());
}

std::optional<std::string> VdbCursor::checkMetadata(const std::string& wanted) {
    std::optional<std::string> found;
    for (auto count = read<uint32_t>(); count > 0; --count) {
        const std::string name = readString(), type = readString();
        const std::streamoff value = position();
        if (name == wanted && type == "string") found = readString();
        seek(value);
        const auto size = read<uint32_t>();
        const std::streamoff begin = position();
        if (size > left()) damaged();
        if (type == "__delayedload")
            checkDelayedLoad(size);
        else if (type != "string" && openvdb::Metadata::isRegisteredType(type) &&
                 openvdb::Metadata::createMetadata(type)->size() != size)
            damaged();
        seek(begin);
        skip(size);
    }
    return found;
}

/// Checks the metadata for delayed loading, the size of each leaf in the file: two arrays of `count` values, each
/// compressed with Blosc if the byte count before it is not 0.
void VdbCursor::checkDelayedLoad(uint64_t size) {
    if (size == 0) return;
    const std::streamoff end = position() + std::streamoff(size);
    const auto count = read<uint32_t>();
    if (count > size_t(mSize) / 64) damaged(); // each leaf has a mask of 64 bytes
    for (const uint64_t bytes : {sizeof(int8_t), sizeof(int64_t)}) {
        const auto packed = read<uint32_t>();
        const bool absent = bytes == sizeof(int64_t) && packed == std::numeric_limits<uint32_t>::max();
        if (absent) continue;
        if (packed > 0)
            skipBlosc(packed, count * bytes, /*padded=*/true);
        else
            skip(count * bytes);
    }
    if (position() > end) damaged();
}

void VdbCursor::checkTransform() {
    const std::streamoff begin = position();
    const std::string frustum = openvdb::math::NonlinearFrustumMap::mapType();
    if (readString() == frustum) {
        skip(8 * sizeof(double)); // box, taper, depth
        if (readString() == frustum) damaged();
    }
    seek(begin);
    openvdb::math::Transform().read(mIn);
}

} // namespace curlew
