// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <istream>
#include <string_view>

namespace curlew {

/// Checks that a PNG of `bytes` can hold the pixels that its header claims: deflate packs at most 1032 bytes into one.
/// Throws FileError if it cannot, ResourceError if the picture does not fit the memory. The header must be whole.
void validatePng(std::string_view bytes, const std::filesystem::path& path);

/// Checks the header of an OpenEXR file before OpenEXR 3.1 reads it, because it trusts the sizes in it: those of every
/// attribute, the table of chunks, and the claimed pixels against the most that the file's compression can pack.
/// Throws FileError if they do not fit the file, ResourceError if the picture does not fit the memory. Leaves the
/// stream anywhere.
void validateExr(std::istream& in, const std::filesystem::path& path);

} // namespace curlew
