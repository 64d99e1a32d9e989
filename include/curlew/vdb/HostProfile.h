// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace curlew {

/// The conventions of a host program for the files that it reads.
struct HostProfile {
    std::string_view name;
    std::string_view pointVelocity; ///< Name of the point attribute that holds the velocity.
};

/// The supported hosts, the default first.
inline constexpr std::array kHostProfiles{
    HostProfile{.name = "houdini", .pointVelocity = "v"},
    HostProfile{.name = "blender", .pointVelocity = "velocity"},
};

inline std::vector<std::string> hostNames() {
    std::vector<std::string> names;
    for (const HostProfile& host : kHostProfiles) names.emplace_back(host.name);
    return names;
}

} // namespace curlew
