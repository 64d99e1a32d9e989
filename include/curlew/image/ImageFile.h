#pragma once

#include "curlew/image/ColorMap.h"
#include "curlew/image/Image.h"

#include <filesystem>

namespace curlew {

// Files are written whole or not at all, and the same image gives the same bytes: no date, host or user goes in.
// Every function throws FileError, naming the path, where a file cannot be written or read.

/// Writes what one sees of an image (displayed), 8 bits per channel: display values are clamped to [0, 1], NaN becomes
/// kNoValueColor. Throws ValueError as displayed() does, and for an image that is too large for PNG.
void writePng(const std::filesystem::path& path, const Image& image, const ColorScale& scale = {});

/// Reads any PNG as display values R, G, B in [0, 1]; what is transparent is put on black.
Image readPng(const std::filesystem::path& path);

/// Writes 32-bit float scan lines, ZIP-compressed, channels by their names; every bit of a value is kept, NaN too.
/// Throws ValueError for an image that is not whole (checkImage).
void writeExr(const std::filesystem::path& path, const Image& image);

/// Reads the data window of the (first) flat part of an OpenEXR file. Half and integer channels are converted to float.
/// Channels come as R, G, B, A first, then by name. Subsampled channels are refused (FileError).
Image readExr(const std::filesystem::path& path);

} // namespace curlew
