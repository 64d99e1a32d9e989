// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew.h"
#include "curlew/app/run/Session.h"

namespace curlew::c {

/// Remembers the exception that is being handled, for curlew_error_message() and its siblings, and what it was about.
curlew_status remember(const app::SourceLocation& location) noexcept;

/// Throws ValueError where the processor cannot run this library; what has to be there once is there afterwards.
void prepareLibrary();

/// Does the work of a function of the interface, which no exception leaves. What fails in it is about the location as
/// it is then.
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

/// Throws ValueError where a pointer that has to point somewhere does not.
template <class T>
T& required(T* pointer, const char* what) {
    if (!pointer) throw ValueError(fmt::format("{} is NULL", what));
    return *pointer;
}

} // namespace curlew::c
