// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/picture/ColorMap.h"
#include "curlew/picture/Image.h"

#include <filesystem>

namespace curlew {

// Files are written whole or not at all, and the same image gives the same bytes: no date, host or user goes in.
// Every function throws FileError, naming the path, where a file cannot be written or read; those that read, if its
// header claims more than the file can hold, too, and ResourceError if the picture does not fit the memory. All throw
// Interrupted once the caller says so.

/// Writes what one sees of an image (displayed), 8 bits per channel: display values are clamped to [0, 1], NaN becomes
/// kNoValueColor. Throws ValueError as displayed() does, and for an image that is too large for PNG.
void writePng(const std::filesystem::path& path, const Image& image, const ColorScale& scale = {},
              const std::function<bool()>& cancelled = {});

/// Reads any PNG as display values R, G, B in [0, 1]; what is transparent is put on black.
Image readPng(const std::filesystem::path& path, const Monitor& monitor = {});

struct ExrOptions {
    bool half = false; ///< 16 bits a value, but for the channel Z, the depth; finite values beyond 65504 become that.
};

/// Writes scan lines of 32-bit floats, ZIP-compressed, channels by their names. R, G and B, where all three are there,
/// become linear light of Rec. 709's primaries (linearFromDisplay), as the format has it; of other channels every bit
/// is kept, NaN too. Throws ValueError for an image that is not whole (checkImage).
void writeExr(const std::filesystem::path& path, const Image& image, const ExrOptions& options = {});

/// Reads the data window of the (first) flat part of an OpenEXR file. Half and integer channels are converted to float.
/// Channels come as R, G, B, A first, then by name; R, G, B as display values. Subsampled channels are refused
/// (FileError).
Image readExr(const std::filesystem::path& path, const Monitor& monitor = {});

} // namespace curlew
