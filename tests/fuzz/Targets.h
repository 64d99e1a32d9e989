// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace curlew::fuzz {

/// A reader of arbitrary bytes. `read` returns false if the reader refuses them by throwing an Error. Anything else
/// (another exception, a signal, a finding of a sanitizer) is a bug.
struct Target {
    const char* name;
    bool (*read)(std::string_view bytes);
};

/// Returns the readers of files and of text from users.
const std::vector<Target>& targets();

/// Returns small inputs that the reader accepts.
std::vector<std::string> seeds(const std::string& target);

} // namespace curlew::fuzz
