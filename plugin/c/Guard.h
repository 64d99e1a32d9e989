// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew.h"
#include "curlew/app/run/Session.h"

namespace curlew::c {

/// Stores the exception being handled and its location, for curlew_error_message() and the functions next to it.
curlew_status remember(const app::SourceLocation& location) noexcept;

/// Initializes the library at the first call. Throws ValueError if the processor cannot run it.
void prepareLibrary();

/// Runs the work of an interface function and turns exceptions into a status. An error is reported at `location`, read
/// at the time of the failure.
template <class Work>
curlew_status guarded(const Work& work, const app::SourceLocation& location = {}) noexcept {
    try {
        prepareLibrary();
        work();
        return CURLEW_OK;
    } catch (...) {
        return remember(location);
    }
}

/// Throws ValueError if a required pointer is NULL.
template <class T>
T& required(T* pointer, const char* what) {
    if (!pointer) throw ValueError(fmt::format("{} is NULL", what));
    return *pointer;
}

} // namespace curlew::c
