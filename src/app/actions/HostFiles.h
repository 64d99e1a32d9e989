// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "ReadFiles.h"
#include "curlew/app/registry/Options.h"
#include "curlew/app/run/Context.h"
#include "curlew/vdb/GridTypes.h"
#include "curlew/vdb/HostConversion.h"

#include <openvdb/MetaMap.h>

namespace curlew::app {

/// The options of -write that say for which host a file is meant.
std::vector<Option> hostOptions();

/// Throws ValueError if host options have no effect or exclude each other.
void checkHostOptions(const Arguments& a);

/// The name of the point attribute that holds the velocity.
std::string pointVelocityOf(const Arguments& a);

/// Return the objects to write in the host's world. An object that does not change is not copied.
std::vector<std::shared_ptr<const openvdb::GridBase>> gridsForFile(const Context& c, const Arguments& a);
/// Returns a grid as it will be in the file, without its voxels; three grids if its components are split.
std::vector<std::shared_ptr<const openvdb::GridBase>> headersForFile(const Context& c, const Arguments& a,
                                                                     const openvdb::GridBase& grid);
MeshPointer meshForFile(const Context& c, const Arguments& a);
std::shared_ptr<const Points> pointsForFile(const Context& c, const Arguments& a);
std::shared_ptr<const Curves> curvesForFile(const Context& c, const Arguments& a);

/// The metadata of a .vdb: the creator, the frame and the frame rate if there are frames, and the host's conventions if
/// target= is given.
openvdb::MetaMap metadataOf(const Context& c, const Arguments& a);

// Writers of the formats that hosts take.
void writeNumpyFile(const Context& c, const Arguments& a, const std::string& file);
void writeFgaFile(const Context& c, const Arguments& a, const std::string& file);
void writeVfFile(const Context& c, const Arguments& a, const std::string& file);
void writeNanoFile(const Context& c, const Arguments& a, const std::string& file);
void writeUsdFile(const Context& c, const Arguments& a, const std::string& file);
void writeBgeoFile(const Context& c, const Arguments& a, const std::string& file);

/// Returns whether a .usda still collects frames: it is written in the last one.
bool collectsFrames(const Context& c, const Arguments& a, const std::string& file);

} // namespace curlew::app
