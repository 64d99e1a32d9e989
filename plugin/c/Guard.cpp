// SPDX-License-Identifier: Apache-2.0
#include "Guard.h"

#include "curlew/base/Parallel.h"
#include "curlew/base/Simd.h"
#include "curlew/vdb/Openvdb.h"

#include <filesystem>
#include <new>

namespace curlew::c {

namespace {

struct LastError {
    curlew_status status = CURLEW_OK;
    std::string message;
    app::SourceLocation location;
};
thread_local LastError lastError;

void keep(curlew_status status, const char* message, const app::SourceLocation& location) noexcept {
    lastError.status = status;
    try {
        lastError.location = location;
        lastError.message = message;
    } catch (...) { // no memory even for this
        lastError.message.clear();
        lastError.location = {};
    }
}

} // namespace

curlew_status remember(const app::SourceLocation& location) noexcept {
    try {
        throw;
    } catch (const Interrupted&) {
        keep(CURLEW_CANCELLED, "cancelled; unfinished files have been removed", location);
    } catch (const FileError& e) {
        keep(CURLEW_FILE_ERROR, e.what(), location);
    } catch (const ResourceError& e) {
        keep(CURLEW_RESOURCE_ERROR, e.what(), location);
    } catch (const ValueError& e) {
        keep(CURLEW_VALUE_ERROR, e.what(), location);
    } catch (const std::filesystem::filesystem_error& e) {
        keep(CURLEW_FILE_ERROR, e.what(), location);
    } catch (const openvdb::IoError& e) {
        keep(CURLEW_FILE_ERROR, e.what(), location);
    } catch (const openvdb::Exception& e) {
        keep(CURLEW_VALUE_ERROR, e.what(), location);
    } catch (const std::bad_alloc&) {
        keep(CURLEW_OUT_OF_MEMORY, "out of memory; use larger voxels, or fewer points", location);
    } catch (const std::exception& e) {
        keep(CURLEW_INTERNAL_ERROR, e.what(), location);
    } catch (...) {
        keep(CURLEW_INTERNAL_ERROR, "an unknown exception", location);
    }
    return lastError.status;
}

void prepareLibrary() {
    static const bool prepared = [] {
#if defined(__x86_64__)
        if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma"))
            throw ValueError("this processor lacks AVX2 and FMA, which this build needs");
#endif
        activeSimd(); // reports an invalid CURLEW_SIMD before any work
        startTbb();
        openvdb::initialize();
        return true;
    }();
    static_cast<void>(prepared);
}

} // namespace curlew::c

extern "C" {

curlew_status curlew_error_status(void) { return curlew::c::lastError.status; }
const char* curlew_error_message(void) {
    const auto& last = curlew::c::lastError;
    return last.status != CURLEW_OK && last.message.empty() ? "out of memory" : last.message.c_str();
}
int32_t curlew_error_line(void) { return curlew::c::lastError.location.line; }
const char* curlew_error_action(void) { return curlew::c::lastError.location.action.c_str(); }
const char* curlew_error_node(void) { return curlew::c::lastError.location.node.c_str(); }
}
