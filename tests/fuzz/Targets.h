// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace curlew::fuzz {

/// A reader that takes any bytes. Returns whether it has read them; an Error is its way to refuse them. Everything else
/// (another exception, a signal, what a sanitizer finds) is a fault.
struct Target {
    const char* name;
    bool (*read)(std::string_view bytes);
};

/// All readers of files, and of text from users.
const std::vector<Target>& targets();

/// Small inputs that the reader accepts.
std::vector<std::string> seeds(const std::string& target);

} // namespace curlew::fuzz
