// SPDX-License-Identifier: Apache-2.0
#include "PointValidation.h"

#include "curlew/vdb/Openvdb.h"

#include <openvdb/io/io.h>
#include <openvdb/points/PointDataGrid.h>
#include <openvdb/version.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <vector>

namespace curlew {

namespace {

using openvdb::points::AttributeArray;

/// Bytes per value of each attribute.
using Descriptor = std::vector<uint64_t>;

/// One attribute of one leaf.
struct PointArray {
    uint64_t bytes = 0;  ///< Bytes in memory, or in its pages.
    uint64_t packed = 0; ///< Bytes in the file if it is not in pages, without the byte that says whether it is
                         ///< compressed.
    bool uniform = false, paged = false;
};

struct Page {
    uint64_t packed = 0, bytes = 0;
    bool isPacked = false;
};

class PointValidation {
  public:
    PointValidation(VdbCursor& cursor, uint64_t leaves) : mCursor(cursor), mLeaves(leaves) {}

    PointSizes check() {
        const auto passes = mCursor.read<uint16_t>();
        if (mLeaves == 0) return mSizes;
        if (passes < 4 || passes % 2 != 0) mCursor.damaged();
        mAttributes = (passes - 4u) / 2;
        if (mLeaves > uint64_t(mCursor.left()) / (kVoxelBytes + kAttributeBytes * mAttributes)) mCursor.damaged();
        mCursor.skip(mLeaves * sizeof(uint16_t)); // sizes of the voxel buffers
        mArrays.resize(mLeaves * mAttributes);
        mHas.resize(mLeaves);
        checkArrays();
        mPages.resize(mAttributes);
        for (size_t k = 0; k < mAttributes; ++k) readPages(k);
        for (uint64_t leaf = 0; leaf < mLeaves; ++leaf) checkVoxels();
        for (size_t k = 0; k < mAttributes; ++k) checkBuffers(k);
        return mSizes;
    }

  private:
    /// Minimum size in the file of a leaf and of one of its attributes.
    static constexpr uint64_t kVoxelBytes = 64 + 4, kAttributeBytes = 14;

    /// Reads the names, types, groups and metadata of the attributes.
    std::shared_ptr<const Descriptor> readDescriptor() {
        const auto count = mCursor.read<uint64_t>();
        if (count > mAttributes) mCursor.damaged();
        auto sizes = std::make_shared<Descriptor>();
        for (uint64_t k = 0; k < count; ++k) {
            const std::string value = mCursor.readString(), codec = mCursor.readString();
            if (!AttributeArray::isRegistered({value, codec})) mCursor.damaged();
            sizes->push_back(AttributeArray::create({value, codec}, 1)->storageTypeSize());
        }
        std::vector<bool> named(count);
        for (uint64_t k = 0; k < count; ++k) {
            mCursor.readString();
            const auto place = mCursor.read<uint64_t>();
            if (place >= count || named[place]) mCursor.damaged();
            named[place] = true;
        }
        const auto groups = mCursor.read<uint64_t>();
        if (groups > 8 * count) mCursor.damaged(); // groups are bits in arrays of bytes
        for (uint64_t k = 0; k < groups; ++k) {
            mCursor.readString();
            if (mCursor.read<uint64_t>() >= 8 * count) mCursor.damaged();
        }
        mCursor.checkMetadata();
        return sizes;
    }

    /// Reads the descriptor of a leaf, which may apply to all leaves that follow.
    void nextDescriptor() {
        if (mShared) return;
        const auto flags = mCursor.read<uint8_t>();
        if (flags > 3) mCursor.damaged();
        mDescriptor = readDescriptor();
        mShared = (flags & 1) != 0;
        if (flags & 2) mCursor.skip(mCursor.read<uint64_t>());
    }

    /// First pass over the leaves: which attributes each has, and their sizes.
    void checkArrays() {
        size_t most = 0;
        for (uint64_t leaf = 0; leaf < mLeaves; ++leaf) {
            nextDescriptor();
            mHas[leaf] = mDescriptor->size();
            most = std::max(most, mDescriptor->size());
            uint32_t points = 0;
            for (size_t k = 0; k < mDescriptor->size(); ++k) {
                const uint32_t count = readArray((*mDescriptor)[k], mArrays[leaf * mAttributes + k]);
                if (k > 0 && count != points) mCursor.damaged();
                points = count;
            }
            mSizes.points += points;
        }
        if (most != mAttributes) mCursor.damaged();
    }

    /// Reads the header of an array. Returns its number of points.
    uint32_t readArray(uint64_t valueBytes, PointArray& array) {
        constexpr uint64_t ownBytes = sizeof(int16_t) + sizeof(uint32_t); // included in `bytes`
        constexpr uint8_t strided = 1, uniform = 2, inPages = 8, flagsKnown = 0x1f, storageKnown = 0x0f;
        const auto bytes = mCursor.read<uint64_t>();
        const auto flags = mCursor.read<uint8_t>(), storage = mCursor.read<uint8_t>();
        const auto count = mCursor.read<uint32_t>();
        const uint64_t stride = (storage & strided) ? mCursor.read<uint32_t>() : 1;
        const bool constant = (flags & AttributeArray::CONSTANTSTRIDE) != 0;
        const uint64_t values = constant ? count * stride : stride;
        const bool counts = values >= count && values <= std::numeric_limits<uint32_t>::max() && stride > 0;
        if (bytes <= ownBytes || flags > flagsKnown || storage > storageKnown || !counts) mCursor.damaged();
        array = {.packed = bytes - ownBytes, .uniform = (storage & uniform) != 0, .paged = (storage & inPages) != 0};
        array.bytes = (array.uniform ? 1 : values) * valueBytes;
        if (array.bytes == 0 || ((array.paged || array.uniform) && array.packed != array.bytes)) mCursor.damaged();
        mSizes.bytes += double(array.bytes) + kArrayMemory;
        return count;
    }

    const PointArray* arrayOf(uint64_t leaf, size_t attribute) const {
        return attribute < mHas[leaf] ? &mArrays[leaf * mAttributes + attribute] : nullptr;
    }

    /// Reads the page headers of an attribute. Its arrays fill the pages one after another.
    void readPages(size_t attribute) {
        uint64_t left = 0; // bytes left in the last page
        for (uint64_t leaf = 0; leaf < mLeaves; ++leaf) {
            const PointArray* array = arrayOf(leaf, attribute);
            if (!array || !array->paged) continue;
            if (left == 0) left = readPage(attribute);
            if (array->bytes > left) mCursor.damaged();
            left -= array->bytes;
        }
        if (left != 0) mCursor.damaged();
    }

    uint64_t readPage(size_t attribute) {
        const int64_t packed = mCursor.read<int32_t>();
        const int64_t bytes = packed > 0 ? mCursor.read<int32_t>() : -packed;
        if (bytes <= 0 || bytes > std::numeric_limits<int32_t>::max()) mCursor.damaged();
        mPages[attribute].push_back({uint64_t(packed > 0 ? packed : bytes), uint64_t(bytes), packed > 0});
        return uint64_t(bytes);
    }

    /// Checks the mask of a leaf and the buffer that holds where the points of each voxel end.
    void checkVoxels() {
        constexpr uint16_t notPacked = std::numeric_limits<uint16_t>::max();
        constexpr uint64_t bytes = 512 * sizeof(uint32_t);
        mCursor.skip(64);
        const auto packed = mCursor.read<uint16_t>();
        if (packed == notPacked)
            mCursor.skip(bytes);
        else
            mCursor.skipBlosc(packed, bytes);
        mSizes.bytes += kLeafMemory;
    }

    /// Checks the values of an attribute: each page where its first array would be, and each array that is not in a
    /// page.
    void checkBuffers(size_t attribute) {
        auto page = mPages[attribute].begin();
        uint64_t left = 0;
        for (uint64_t leaf = 0; leaf < mLeaves; ++leaf) {
            const PointArray* array = arrayOf(leaf, attribute);
            if (!array) continue;
            if (!array->paged) {
                checkArray(*array);
                continue;
            }
            if (left == 0) {
                if (page->isPacked)
                    mCursor.skipBlosc(page->packed, page->bytes, /*padded=*/true);
                else
                    mCursor.skip(page->bytes);
                left = (page++)->bytes;
            }
            left -= array->bytes;
        }
    }

    void checkArray(const PointArray& array) {
        const bool packed = !array.uniform && mCursor.read<uint8_t>() == 1;
        if (packed) return mCursor.skipBlosc(array.packed, array.bytes, /*padded=*/true);
        if (array.packed != array.bytes) mCursor.damaged();
        mCursor.skip(array.bytes);
    }

    /// Memory that OpenVDB needs for an array and a leaf besides their values: the objects and the allocator's
    /// overhead.
    static constexpr double kArrayMemory = 150, kLeafMemory = 2500;

    VdbCursor& mCursor;
    uint64_t mLeaves;
    size_t mAttributes = 0; ///< Maximum number of attributes per leaf.
    std::shared_ptr<const Descriptor> mDescriptor;
    bool mShared = false;                  ///< The descriptor applies to all leaves that follow.
    std::vector<size_t> mHas;              ///< Number of attributes of each leaf.
    std::vector<PointArray> mArrays;       ///< mAttributes entries per leaf.
    std::vector<std::vector<Page>> mPages; ///< Pages of each attribute.
    PointSizes mSizes;
};

} // namespace

PointSizes validatePoints(VdbCursor& cursor, uint64_t leaves, uint32_t version) {
    if (version < openvdb::OPENVDB_FILE_VERSION_MULTIPASS_IO) cursor.damaged();
    return PointValidation(cursor, leaves).check();
}

} // namespace curlew
