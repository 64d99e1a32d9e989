// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace curlew::test {

/// Whether the tests run with AddressSanitizer, which needs terabytes of address space.
#if defined(__SANITIZE_ADDRESS__) // GCC
constexpr bool kAddressSanitizer = true;
#elif defined(__has_feature) // Clang
constexpr bool kAddressSanitizer = __has_feature(address_sanitizer);
#else
constexpr bool kAddressSanitizer = false;
#endif

} // namespace curlew::test
