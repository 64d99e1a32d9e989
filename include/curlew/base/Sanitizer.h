// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace curlew {

/// Whether this is compiled with AddressSanitizer, which needs terabytes of address space, or with ThreadSanitizer.
#if defined(__has_feature) // Clang
inline constexpr bool kAddressSanitizer = __has_feature(address_sanitizer);
inline constexpr bool kThreadSanitizer = __has_feature(thread_sanitizer);
#else // GCC
#if defined(__SANITIZE_ADDRESS__)
inline constexpr bool kAddressSanitizer = true;
#else
inline constexpr bool kAddressSanitizer = false;
#endif
#if defined(__SANITIZE_THREAD__)
inline constexpr bool kThreadSanitizer = true;
#else
inline constexpr bool kThreadSanitizer = false;
#endif
#endif

} // namespace curlew
