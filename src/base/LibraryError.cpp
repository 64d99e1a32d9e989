// SPDX-License-Identifier: Apache-2.0
#include "curlew/base/LibraryError.h"

#include <fmt/format.h>

#include <string_view>

namespace curlew {

std::string messageOf(const std::exception& error) {
    const std::string_view message = error.what();
    if (!message.starts_with("pthread_create")) return std::string(message);
    return fmt::format("cannot start a thread ({}); raise the limit of processes (ulimit -u), or work with one thread",
                       message);
}

} // namespace curlew
