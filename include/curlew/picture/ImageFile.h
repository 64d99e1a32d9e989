// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/picture/ColorMap.h"
#include "curlew/picture/Image.h"

#include <filesystem>

namespace curlew {

// Files are written completely or not at all. The same image gives the same bytes: no date, host or user is stored.
// Every function throws FileError, with the path, if a file cannot be written or read. Reading also throws FileError if
// the header claims more than the file can hold, and ResourceError if the picture does not fit into memory. All throw
// Interrupted on cancellation.

/// Writes the displayed form of an image (displayed), 8 bits per channel: display values are clamped to [0, 1], NaN
/// becomes kNoValueColor. Throws ValueError like displayed(), and if the image is too large for PNG.
void writePng(const std::filesystem::path& path, const Image& image, const ColorScale& scale = {},
              const std::function<bool()>& cancelled = {});

/// Reads any PNG as display values R, G, B in [0, 1]. Transparent pixels are composited over black.
Image readPng(const std::filesystem::path& path, const Monitor& monitor = {});

struct ExrOptions {
    /// 16 bits per value, except for the depth channel Z; finite values beyond 65504 are clamped to it.
    bool half = false;
};

/// Writes scan lines of 32-bit floats, ZIP-compressed, channels by their names. If R, G and B all exist, they become
/// linear light with Rec. 709 primaries (linearFromDisplay), as the format specifies. Other channels keep every bit,
/// NaN too. Throws ValueError if the image is invalid (checkImage).
void writeExr(const std::filesystem::path& path, const Image& image, const ExrOptions& options = {},
              const std::function<bool()>& cancelled = {});

/// Reads the data window of the (first) flat part of an OpenEXR file. Half and integer channels are converted to float.
/// The channels R, G, B, A come first, then the others by name; R, G, B are display values. Throws FileError if a
/// channel is subsampled.
Image readExr(const std::filesystem::path& path, const Monitor& monitor = {});

} // namespace curlew
