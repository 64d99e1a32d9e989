// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace curlew {

/// The axes of a host's world.
enum class HostAxes {
    yUp,           ///< Right-handed, Y up, as in glTF.
    zUp,           ///< Right-handed, Z up.
    zUpLeftHanded, ///< Left-handed, Z up.
    yUpLeftHanded, ///< Left-handed, Y up.
};

/// The conventions of a host program for the files that it reads. Velocities are per second for every host;
/// HostOptions::velocityScale makes them velocities per frame.
struct HostProfile {
    std::string_view name;
    std::string_view pointVelocity;        ///< Name of the point attribute that holds the velocity.
    std::string_view gridVelocity;         ///< Name of the velocity grid.
    std::string_view otherVelocities = {}; ///< Other names of velocity grids that it finds, separated by commas.
    bool staggered = false;     ///< Reads the class GRID_STAGGERED; otherwise velocities belong at voxel centres.
    bool fogVectors = false;    ///< Requires vector grids to be of the class GRID_FOG_VOLUME.
    bool wholeVolumes = false;  ///< Takes one file per volume: velocities belong beside the density.
    bool refusesPoints = false; ///< Does not read point grids.
    std::string_view componentSuffix = {}; ///< What the names of split components have between the name and x, y, z;
                                           ///< "" if the host takes no components.
    HostAxes axes = HostAxes::yUp;
    double unitsPerMetre = 1;
    bool readsVdb = true;         ///< Whether it reads .vdb at all.
    std::string_view source = {}; ///< Where these facts come from; docs/hosts/ has the details.
};

/// The supported hosts, the default first.
inline constexpr std::array kHostProfiles{
    HostProfile{.name = "houdini",
                .pointVelocity = "v",
                .gridVelocity = "vel",
                .otherVelocities = "v,velocity",
                .staggered = true,
                .componentSuffix = ".",
                .source = "openvdb/tools/VelocityFields.h and the source of the VDB Advect Points SOP"},
    HostProfile{.name = "blender",
                .pointVelocity = "velocity",
                .gridVelocity = "velocity",
                .otherVelocities = "vel,v",
                .refusesPoints = true,
                .componentSuffix = "_",
                .axes = HostAxes::zUp,
                .source = "blender/blenkernel/intern/volume.cc; tried with Blender 3.4.1"},
    HostProfile{.name = "arnold",
                .pointVelocity = "v",
                .gridVelocity = "vel",
                .otherVelocities = "v",
                .wholeVolumes = true,
                .componentSuffix = ".",
                .source = "Arnold User Guide, Volume: velocity_grids, velocity_fps; source of arnold-usd"},
    HostProfile{.name = "karma",
                .pointVelocity = "v",
                .gridVelocity = "vel",
                .wholeVolumes = true,
                .source = "openusd.org, usdVol: OpenVDBAsset; Houdini documentation, Karma"},
    HostProfile{.name = "renderman",
                .pointVelocity = "v",
                .gridVelocity = "vel",
                .fogVectors = true,
                .source = "rmanwiki.pixar.com, OpenVDB Implicit Field Plugin"},
    HostProfile{.name = "redshift",
                .pointVelocity = "v",
                .gridVelocity = "velocity",
                .componentSuffix = ".",
                .source = "help.maxon.net/r3d, Volume Object: velocity channels"},
    HostProfile{.name = "unreal",
                .pointVelocity = "velocity",
                .gridVelocity = "velocity",
                .axes = HostAxes::zUpLeftHanded,
                .unitsPerMetre = 100,
                .source = "Unreal Engine, VectorFieldFactory.cpp (.fga) and the axes of its glTF exporter"},
    HostProfile{.name = "unity",
                .pointVelocity = "velocity",
                .gridVelocity = "velocity",
                .refusesPoints = true,
                .axes = HostAxes::yUpLeftHanded,
                .readsVdb = false,
                .source = "github.com/peeweek/VectorFieldFile (.vf): Y up, left-handed"},
};

inline std::vector<std::string> hostNames() {
    std::vector<std::string> names;
    names.reserve(kHostProfiles.size());
    for (const HostProfile& host : kHostProfiles) names.emplace_back(host.name);
    return names;
}

} // namespace curlew
