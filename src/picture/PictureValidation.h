// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <istream>
#include <string_view>

namespace curlew {

/// Checks that a PNG of `bytes` can hold the pixels that its header claims: deflate compresses at most 1032 bytes into
/// one. Throws FileError if it cannot, ResourceError if the picture does not fit into memory. The header must be
/// complete.
void validatePng(std::string_view bytes, const std::filesystem::path& path);

/// Checks the header of an OpenEXR file before OpenEXR 3.1 reads it, because OpenEXR trusts the sizes in the header.
/// Checks the size of every attribute, the table of chunks, and the claimed pixels against the maximum that the file's
/// compression can pack. Throws FileError if they do not fit the file, ResourceError if the picture does not fit into
/// memory. Leaves the stream at an unspecified position.
void validateExr(std::istream& in, const std::filesystem::path& path);

} // namespace curlew
