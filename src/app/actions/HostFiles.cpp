// SPDX-License-Identifier: Apache-2.0
#include "HostFiles.h"

#include "curlew/app/registry/Expression.h"
#include "curlew/app/registry/Text.h"
#include "curlew/base/LocalFile.h"
#include "curlew/vdb/BgeoFile.h"
#include "curlew/vdb/CurveFile.h"
#include "curlew/vdb/NanoFile.h"
#include "curlew/vdb/NumpyFile.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/ScalarGrids.h"
#include "curlew/vdb/UsdFile.h"
#include "curlew/vdb/VectorFieldFile.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace curlew::app {

namespace {

using namespace options;

HostOptions optionsOf(const Context& c, const Arguments& a) {
    HostOptions options{.host = a.given("target") ? &kHostProfiles.at(a.choice("target")) : nullptr,
                        .up = a.choice<UpAxis>("upAxis"),
                        .split = a.flag("split")};
    if (a.text("per") == "frame") {
        if (!c.clock()) throw ValueError("per=frame needs -frames, which sets the frame rate; or use per=second");
        options.velocityScale = 1 / c.clock()->fps;
    }
    return options;
}

/// Returns whether points and curves stay as they are.
bool keepsGeometry(const HostOptions& options) {
    return options.velocityScale == 1 && (!options.host || axesFor(*options.host, options.up).identity());
}

std::optional<FrameTime> timeOf(const Context& c) {
    if (!c.clock()) return {};
    return FrameTime{.frame = static_cast<double>(c.clock()->frame), .fps = c.clock()->fps};
}

void requireOne(const Context& c, const std::string& file) {
    if (c.count("what") != 1)
        throw ValueError(
            fmt::format("'{}' can hold one object, not {}; write one file for each", file, c.count("what")));
}

/// Returns the only grid to write.
openvdb::GridBase::ConstPtr gridForFile(const Context& c, const Arguments& a, const std::string& file) {
    requireOne(c, file);
    const auto grids = gridsForFile(c, a);
    if (grids.size() != 1) throw ValueError(fmt::format("'{}' cannot hold components; leave out split=1", file));
    return grids.front();
}

std::string describe(const openvdb::Vec3d& v) { return fmt::format("{:.6g},{:.6g},{:.6g}", v[0], v[1], v[2]); }

/// Says where the box of a vector field is, since the format does not, or only the user can place it.
void sayBox(const Context& c, const std::string& file, const FieldBox& box) {
    c.info(fmt::format("{}: {} x {} x {} vectors; centre {}, size {}{}", file, box.size[0], box.size[1], box.size[2],
                       describe(0.5 * (box.lower + box.upper)), describe(box.upper - box.lower),
                       box.resampled ? "; resampled, because the format has fewer voxels or other axes" : ""));
}

// ---- USD

UsdOptions usdOptionsOf(const Context& c, const Arguments& a) {
    UsdOptions options;
    if (a.given("target")) {
        const HostProfile& host = kHostProfiles.at(a.choice("target"));
        options.zUp = host.axes == HostAxes::zUp || host.axes == HostAxes::zUpLeftHanded;
        options.metresPerUnit = 1 / host.unitsPerMetre;
    }
    if (!c.clock()) return options;
    const FramePlan plan = framePlanOf(*c.graph().frameRange);
    options.fps = plan.fps;
    options.first = plan.first, options.last = plan.last;
    return options;
}

/// Returns whether every frame writes a file of this name.
bool isWholeSequence(const Context& c, const Arguments& a, const std::string& file) {
    if (!c.clock()) return false;
    for (size_t k = 0; k < a.words().size(); ++k)
        if (a.words()[k] == file) return !variablesOf(a.writtenWords()[k]).time;
    return false;
}

/// Adds the geometry of this frame to those of earlier frames. Returns all of them in the last frame, otherwise none.
template <class Geometry>
std::vector<UsdSample<Geometry>> samplesOf(const Context& c, const Arguments& a, const std::string& file,
                                           std::shared_ptr<const Geometry> geometry) {
    using Samples = std::map<std::string, std::vector<UsdSample<Geometry>>>;
    const double frame = c.clock() ? static_cast<double>(c.clock()->frame) : 1;
    if (!isWholeSequence(c, a, file)) return {{frame, std::move(geometry)}};
    const FramePlan plan = framePlanOf(*c.graph().frameRange);
    if (!c.memory().object) c.memory().object = std::make_shared<Samples>();
    std::vector<UsdSample<Geometry>>& samples = (*std::static_pointer_cast<Samples>(c.memory().object))[file];
    if (plan.parts > 1 || (samples.empty() && c.clock()->frame != plan.frames().front()))
        throw ValueError(
            fmt::format("'{}' holds all frames, so one run has to make them all, without part= and -resume; or write a "
                        "file for each "
                        "frame, as 'name.$F4.usda'",
                        file));
    samples.push_back({frame, std::move(geometry)});
    if (collectsFrames(c, a, file)) return {};
    return std::move(samples);
}

/// Returns the .vdb files that the same -write makes, for all frames.
std::vector<UsdAsset> assetsOf(const Context& c, const Arguments& a, const std::string& file) {
    for (size_t k = 0; k < a.words().size(); ++k) {
        if (endingOf(a.words()[k]) != ".vdb") continue;
        if (!c.clock()) return {{1, a.words()[k]}};
        const FramePlan plan = framePlanOf(*c.graph().frameRange);
        std::vector<UsdAsset> assets;
        if (!isWholeSequence(c, a, file)) return {{static_cast<double>(c.clock()->frame), a.words()[k]}};
        for (int frame = plan.first; frame <= plan.last; frame += plan.by) {
            Moment moment = plan.clock(frame).moment();
            moment.part = c.moment().part;
            assets.push_back({static_cast<double>(frame), expanded(a.writtenWords()[k], moment)});
        }
        return assets;
    }
    throw ValueError(
        fmt::format("'{}' does not hold grids but refers to a .vdb; write both with one -write: -write "
                    "'smoke.$F4.vdb' smoke.usda",
                    file));
}

void writeUsdVolume(const Context& c, const Arguments& a, const std::string& file) {
    std::vector<openvdb::GridBase::ConstPtr> grids;
    for (openvdb::GridBase::ConstPtr& grid : gridsForFile(c, a)) {
        if (grid->isType<openvdb::points::PointDataGrid>()) { // not a field of a volume
            if (!c.clock() || c.clock()->duration == 0)
                c.warn(
                    fmt::format("'{}' has no points or curves, since it refers to the grids in the .vdb; write them "
                                "to a .usda of their own",
                                file));
            continue;
        }
        openvdb::MetaMap metadata(static_cast<const openvdb::MetaMap&>(*grid));
        if (a.flag("half")) metadata.insertMeta(openvdb::GridBase::META_SAVE_HALF_FLOAT, openvdb::BoolMetadata(true));
        grids.push_back(grid->copyGridReplacingMetadata(metadata));
    }
    writeUsda(file, grids, assetsOf(c, a, file), usdOptionsOf(c, a), c.console().cancelFunction());
}

template <class Geometry>
void writeUsdGeometry(const Context& c, const Arguments& a, const std::string& file,
                      std::shared_ptr<const Geometry> geometry) {
    requireOne(c, file);
    const auto samples = samplesOf<Geometry>(c, a, file, std::move(geometry));
    if (!samples.empty()) writeUsda(file, samples, usdOptionsOf(c, a), c.console().cancelFunction());
}

bool anyGrid(const Context& c) {
    for (size_t k = 0; k < c.count("what"); ++k)
        if (std::holds_alternative<GridValue>(c.value("what", k))) return true;
    return false;
}

} // namespace

std::vector<Option> hostOptions() {
    return {choice("target", hostNames(),
                   "application that the files are for: sets the names and classes of velocities, and converts meshes, "
                   "points, curves and grids to its axes and units (not in .obj); see docs/hosts. Without target=, "
                   "names are Houdini's and nothing is converted"),
            choice("upAxis", kUpAxisNames, "with target=: up axis of the scene, converted to that of the host"),
            choice("per", {"second", "frame"}, "unit of time of velocities in the files; frame: needs -frames"),
            flag("split", "0", "1: write vector grids as three grids of their components")};
}

void checkHostOptions(const Arguments& a) {
    if (a.given("upAxis") && !a.given("target"))
        throw ValueError("upAxis= needs target=, which chooses the axes of the file");
    for (const std::string& file : a.words()) {
        const std::string ending = a.given("format") ? fmt::format(".{}", a.text("format")) : endingOf(file);
        if (a.given("target") && ending == ".vdb" && !kHostProfiles.at(a.choice("target")).readsVdb)
            throw ValueError(fmt::format("{} does not read .vdb; write .vf or .fga", a.text("target")));
        if (a.text("per") == "frame" && ending == ".usda")
            throw ValueError("velocities in USD are per second; leave out per=frame");
    }
}

std::string pointVelocityOf(const Arguments& a) {
    return std::string(kHostProfiles.at(a.choice("target")).pointVelocity);
}

std::vector<openvdb::GridBase::ConstPtr> gridsForFile(const Context& c, const Arguments& a) {
    const HostOptions options = optionsOf(c, a);
    const Monitor monitor{.report = {}, .cancelled = c.console().cancelFunction()};
    PointGridOptions pointOptions{.velocity = pointVelocityOf(a)};
    std::vector<openvdb::GridBase::ConstPtr> grids;
    for (size_t k = 0; k < c.count("what"); ++k) {
        switch (curlew::app::kindOf(c.value("what", k))) {
            case Kind::points: {
                const Points& particles = c.points("what", k).particles;
                grids.push_back(
                    pointGrid(keepsGeometry(options) ? particles : forHost(particles, options), pointOptions, monitor));
                break;
            }
            case Kind::curves: {
                PointGridOptions curveOptions = pointOptions;
                curveOptions.name = "curves";
                const CurvesPointer curves = c.curves("what", k);
                grids.push_back(
                    pointGrid(keepsGeometry(options) ? *curves : forHost(*curves, options), curveOptions, monitor));
                break;
            }
            default:
                for (openvdb::GridBase::ConstPtr& grid : forHost(c.grid("what", k).grid, options))
                    grids.push_back(std::move(grid));
        }
    }
    return grids;
}

std::vector<openvdb::GridBase::ConstPtr> headersForFile(const Context& c, const Arguments& a,
                                                        const openvdb::GridBase& grid) {
    return forHost(grid.copyGridWithNewTree(), optionsOf(c, a));
}

MeshPointer meshForFile(const Context& c, const Arguments& a) {
    const HostOptions options = optionsOf(c, a);
    MeshPointer mesh = c.mesh("what");
    if (!options.host || axesFor(*options.host, options.up).identity()) return mesh;
    return std::make_shared<const Mesh>(forHost(*mesh, options));
}

std::shared_ptr<const Points> pointsForFile(const Context& c, const Arguments& a) {
    const HostOptions options = optionsOf(c, a);
    if (c.anyPoints("what").positionsN)
        throw ValueError("points of more than 3 dimensions can only be written to a .csv");
    const auto set = std::get<PointsPointer>(c.value("what"));
    if (keepsGeometry(options)) return {set, &set->particles};
    return std::make_shared<const Points>(forHost(set->particles, options));
}

std::shared_ptr<const Curves> curvesForFile(const Context& c, const Arguments& a) {
    const HostOptions options = optionsOf(c, a);
    CurvesPointer curves = c.curves("what");
    if (keepsGeometry(options)) return curves;
    return std::make_shared<const Curves>(forHost(*curves, options));
}

openvdb::MetaMap metadataOf(const Context& c, const Arguments& a) {
    openvdb::MetaMap metadata;
    metadata.insertMeta("creator", openvdb::StringMetadata("Curlew"));
    if (const auto time = timeOf(c)) {
        metadata.insertMeta("frame", openvdb::DoubleMetadata(time->frame));
        metadata.insertMeta("fps", openvdb::DoubleMetadata(time->fps));
        // As OpenVDB's Maya node names it, which knows whole numbers only.
        if (time->fps == std::floor(time->fps))
            metadata.insertMeta("frames_per_second", openvdb::Int32Metadata(static_cast<int32_t>(time->fps)));
    }
    if (!a.given("target")) return metadata;
    const HostProfile& host = kHostProfiles.at(a.choice("target"));
    const bool zUp = host.axes == HostAxes::zUp || host.axes == HostAxes::zUpLeftHanded;
    metadata.insertMeta("target", openvdb::StringMetadata(std::string(host.name)));
    metadata.insertMeta("up_axis", openvdb::StringMetadata(zUp ? "Z" : "Y"));
    metadata.insertMeta("velocity_unit", openvdb::StringMetadata(a.text("per")));
    return metadata;
}

void writeNumpyFile(const Context& c, const Arguments& a, const std::string& file) {
    const NumpyOptions options{.deflate = a.choice<Codec>("codec") == Codec::zip, .time = timeOf(c)};
    if (a.choice<Codec>("codec") == Codec::blosc) throw ValueError("a .npz cannot hold Blosc; use codec=zip or none");
    const Monitor monitor = c.follow(fmt::format("writing {}", file));
    switch (c.kind("what")) {
        case Kind::points:
            requireOne(c, file);
            return writeNumpy(file, *pointsForFile(c, a), options, monitor);
        case Kind::curves:
            requireOne(c, file);
            return writeNumpy(file, *curvesForFile(c, a), options, monitor);
        default:
            return writeNumpy(file, gridsForFile(c, a), options, monitor);
    }
}

void writeFgaFile(const Context& c, const Arguments& a, const std::string& file) {
    const auto grid = vectorsOf(gridForFile(c, a, file));
    if (!grid) throw ValueError(fmt::format("'{}' holds vectors; make a grid with -velocity", file));
    sayBox(c, file, writeFga(file, *grid, c.follow(fmt::format("writing {}", file))));
}

void writeVfFile(const Context& c, const Arguments& a, const std::string& file) {
    sayBox(c, file, writeVf(file, *gridForFile(c, a, file), c.follow(fmt::format("writing {}", file))));
}

void writeNanoFile(const Context& c, const Arguments& a, const std::string& file) {
    writeNano(file, gridsForFile(c, a), {.half = a.flag("half"), .codec = a.choice<Codec>("codec")},
              c.console().cancelFunction());
}

void writeBgeoFile(const Context& c, const Arguments& a, const std::string& file) {
    requireOne(c, file);
    if (c.kind("what") == Kind::points) return writeBgeo(file, *pointsForFile(c, a), c.console().cancelFunction());
    writeBgeo(file, *curvesForFile(c, a), c.console().cancelFunction());
}

void writeUsdFile(const Context& c, const Arguments& a, const std::string& file) {
    if (anyGrid(c)) return writeUsdVolume(c, a, file);
    if (c.kind("what") == Kind::points) return writeUsdGeometry(c, a, file, pointsForFile(c, a));
    writeUsdGeometry(c, a, file, curvesForFile(c, a));
}

bool collectsFrames(const Context& c, const Arguments& a, const std::string& file) {
    return endingOf(file) == ".usda" && isWholeSequence(c, a, file) && !anyGrid(c) &&
           c.clock()->frame != framePlanOf(*c.graph().frameRange).frames().back();
}

} // namespace curlew::app
