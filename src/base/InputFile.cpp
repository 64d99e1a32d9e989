// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/InputFile.h"

#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <vector>

namespace curlew {

std::ifstream openToRead(const std::filesystem::path& path) {
    const auto fail = [&](const std::string& why) {
        return FileError(fmt::format("cannot read '{}': {}", path.string(), why));
    };
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(path, error);
    if (path == "-") throw fail("only -read reads the standard input; give a file");
    if (!std::filesystem::exists(status)) throw fail("there is no such file; check the name");
    if (std::filesystem::is_directory(status)) throw fail("it is a folder; give a file in it");
    if (!std::filesystem::is_regular_file(status)) throw fail("it is not a regular file; copy it to one");
    errno = 0;
    std::ifstream in(path, std::ios::binary);
    if (!in) throw fail(fmt::format("{}; check its permissions", std::strerror(errno)));
    if (in.peek() == std::ifstream::traits_type::eof()) throw fail("it is empty; write or copy it again");
    in.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
    return in;
}

Digest digestOf(const std::filesystem::path& path) {
    std::ifstream in = openToRead(path);
    in.exceptions(std::ios::goodbit);
    DigestBuilder content;
    std::vector<char> block(size_t(1) << 18);
    while (in.read(block.data(), std::streamsize(block.size())) || in.gcount() > 0)
        content.addBytes(block.data(), size_t(in.gcount()));
    if (in.bad()) throw FileError(fmt::format("cannot read '{}': the disk or network failed", path.string()));
    return content.digest();
}

} // namespace curlew
