// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Error.h"

#include <fmt/format.h>
#include <openvdb/Exceptions.h>

#include <string>

namespace curlew::app {

/// Calls `work`, and prefixes the message of a thrown exception with the context. An openvdb::Exception becomes a
/// ValueError.
template <class Work>
decltype(auto) inContextOf(const std::string& context, const Work& work) {
    const auto located = [&](const std::exception& e) { return fmt::format("{}: {}", context, e.what()); };
    try {
        return work();
    } catch (const ValueError& e) {
        throw ValueError(located(e));
    } catch (const FileError& e) {
        throw FileError(located(e));
    } catch (const ResourceError& e) {
        throw ResourceError(located(e));
    } catch (const openvdb::Exception& e) {
        throw ValueError(located(e));
    }
}

} // namespace curlew::app
