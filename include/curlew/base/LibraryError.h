// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <string>

namespace curlew {

/// Returns the message of an exception. If it is TBB's because a thread cannot be started, says what to do.
std::string messageOf(const std::exception& error);

} // namespace curlew
