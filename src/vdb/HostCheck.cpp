// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/HostCheck.h"

#include "curlew/base/Error.h"
#include "curlew/base/Text.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/VdbFile.h"

#include <fmt/format.h>
#include <openvdb/io/File.h>

#include <algorithm>
#include <cctype>

namespace curlew {

namespace {

namespace fs = std::filesystem;
using openvdb::GridBase;

bool isVector(const GridBase& grid) { return grid.valueType().starts_with("vec3"); }
bool isPoints(const GridBase& grid) { return grid.type().find("ptdata") != std::string::npos; }

/// Returns whether a comma-separated list contains the name.
bool lists(std::string_view list, std::string_view name) {
    while (!list.empty()) {
        const size_t comma = std::min(list.find(','), list.size());
        if (list.substr(0, comma) == name) return true;
        list.remove_prefix(std::min(comma + 1, list.size()));
    }
    return false;
}

bool isNumbered(const fs::path& path) {
    const std::string stem = path.stem().string();
    return !stem.empty() && std::isdigit(static_cast<unsigned char>(stem.back()));
}

class HostCheck {
  public:
    HostCheck(const fs::path& path, const HostProfile& host) : mHost(host) {
        vdbContents(path); // validates the headers, which OpenVDB does not
        openvdb::io::File file(path.string());
        file.open(/*delayLoad=*/false);
        mMetadata = file.getMetadata();
        mGrids = *file.readAllGridMetadata();
        file.close();
    }

    std::vector<std::string> run(bool numbered) {
        if (!mHost.readsVdb) add("{0} does not read .vdb; write another format (docs/hosts/{0}.md)", mHost.name);
        checkCreator();
        checkVelocity();
        if (numbered && !(*mMetadata)["fps"] && !(*mMetadata)["frames_per_second"])
            add("the file of a sequence has no frame rate (metadata fps); set it in {}", mHost.name);
        for (const GridBase::Ptr& grid : mGrids)
            if (isPoints(*grid) && mHost.refusesPoints)
                add("{} does not read the points '{}'; write them as .ply", mHost.name, printable(grid->getName()));
        return std::move(mProblems);
    }

  private:
    template <class... Values>
    void add(fmt::format_string<Values...> text, Values&&... values) {
        mProblems.push_back(fmt::format(text, std::forward<Values>(values)...));
    }

    void checkCreator() {
        const auto creator = mMetadata->getMetadata<openvdb::StringMetadata>(GridBase::META_GRID_CREATOR);
        if (mHost.name == "blender" && creator && creator->value().starts_with("Houdini"))
            add("its creator is '{}', so Blender rotates its axes; write it with another creator",
                printable(creator->value()));
    }

    /// Returns the grid in which the host finds velocities; null if there is none.
    const GridBase* velocity() const {
        for (const std::string_view names : {mHost.gridVelocity, mHost.otherVelocities})
            for (const GridBase::Ptr& grid : mGrids)
                if (isVector(*grid) && lists(names, grid->getName())) return grid.get();
        return nullptr;
    }

    bool hasComponents() const {
        if (mHost.componentSuffix.empty()) return false;
        return std::all_of(std::begin(kAxes), std::end(kAxes), [&](char axis) {
            const std::string name = fmt::format("{}{}{}", mHost.gridVelocity, mHost.componentSuffix, axis);
            return std::any_of(mGrids.begin(), mGrids.end(),
                               [&](const GridBase::Ptr& g) { return g->getName() == name; });
        });
    }

    void checkVelocity() {
        const GridBase* grid = velocity();
        if (!grid) return checkMissing();
        const std::string name = printable(grid->getName());
        if (grid->valueType() != "vec3s") add("'{}' is of type {}, not vec3s", name, grid->valueType());
        const bool staggered = grid->getGridClass() == openvdb::GRID_STAGGERED;
        if (staggered && !mHost.staggered)
            add("'{}' is staggered, which {} does not read: its velocities would be off by half a voxel; write it with "
                "target={}",
                name, mHost.name, mHost.name);
        if (mHost.fogVectors && grid->getGridClass() != openvdb::GRID_FOG_VOLUME)
            add("'{}' is not of the class fog volume, which {} requires; write it with target={}", name, mHost.name,
                mHost.name);
        if (grid->getVectorType() != openvdb::VEC_CONTRAVARIANT_RELATIVE)
            add("the vector type of '{}' is {}, not contravariant relative, so a transform of the volume would not "
                "rotate it",
                name, GridBase::vecTypeToString(grid->getVectorType()));
        const bool alone = std::none_of(mGrids.begin(), mGrids.end(),
                                        [](const GridBase::Ptr& other) { return other->valueType() == "float"; });
        if (mHost.wholeVolumes && alone)
            add("there is no density beside '{}': {} takes one file per volume (-velocity density=1)", name,
                mHost.name);
    }

    void checkMissing() {
        if (hasComponents()) return;
        std::string others;
        for (const GridBase::Ptr& grid : mGrids)
            if (isVector(*grid))
                others += fmt::format("{}'{}'", others.empty() ? "" : ", ", printable(grid->getName()));
        add("it has no velocity grid '{}'{}", mHost.gridVelocity,
            others.empty() ? "" : fmt::format("; its vector grids are {}", others));
    }

    static constexpr std::string_view kAxes = "xyz";

    const HostProfile& mHost;
    openvdb::MetaMap::Ptr mMetadata;
    openvdb::GridPtrVec mGrids;
    std::vector<std::string> mProblems;
};

} // namespace

std::vector<std::string> hostProblems(const fs::path& vdb, const HostProfile& host) {
    try {
        return HostCheck(vdb, host).run(isNumbered(vdb));
    } catch (const openvdb::Exception& error) {
        throw FileError(
            fmt::format("'{}' is damaged ({}); write or copy it again", vdb.string(), printable(error.what())));
    }
}

} // namespace curlew
