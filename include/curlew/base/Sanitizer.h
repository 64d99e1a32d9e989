// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace curlew {

/// Whether this is compiled with AddressSanitizer, which needs terabytes of address space.
#if defined(__SANITIZE_ADDRESS__) // GCC
inline constexpr bool kAddressSanitizer = true;
#elif defined(__has_feature) // Clang
inline constexpr bool kAddressSanitizer = __has_feature(address_sanitizer);
#else
inline constexpr bool kAddressSanitizer = false;
#endif

} // namespace curlew
