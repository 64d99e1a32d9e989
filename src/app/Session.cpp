#include "curlew/app/Session.h"

#include "Recording.h"
#include "curlew/field/Algebra.h"

namespace curlew::app {

Session::Session(Console& output)
    : console(output),
      mRecording(std::make_shared<Recording>()),
      mLastLevelSets(std::make_shared<FrameLevelSets>()),
      mSdfs(std::make_shared<SdfCache>()) {}

Particles& Session::particles(size_t age) {
    for (size_t k = 0; k < geometry.size(); ++k)
        if (auto* found = std::get_if<Particles>(&geometry.at(k)); found && age-- == 0) return *found;
    throw ValueError("there are no points; make some with -scatter, or read a .vdb that has them");
}

bool Session::hasParticles() const {
    for (size_t k = 0; k < geometry.size(); ++k)
        if (std::holds_alternative<Particles>(geometry.at(k))) return true;
    return false;
}

openvdb::Vec3SGrid::ConstPtr Session::velocity() const {
    for (size_t k = 0; k < grids.size(); ++k)
        if (auto velocity = openvdb::GridBase::grid<openvdb::Vec3SGrid>(grids.at(k).grid)) return velocity;
    return nullptr;
}

std::optional<size_t> Session::newestLevelSet() const {
    for (size_t k = 0; k < grids.size(); ++k)
        if (grids.at(k).grid->getGridClass() == openvdb::GRID_LEVEL_SET) return k;
    return {};
}

std::optional<size_t> Session::newestField(bool sdf) const {
    for (size_t k = 0; k < fields.size(); ++k)
        if (fields.at(k).sdf.has_value() == sdf) return k;
    return {};
}

namespace {

/// The surface on its way from one to the other.
Sdf between(const Sdf& from, const Sdf& to, double part) {
    if (part <= 0) return from;
    Box bounds = from.bounds;
    for (int axis = 0; axis < 3; ++axis) {
        bounds.lower[axis] = std::min(bounds.lower[axis], to.bounds.lower[axis]);
        bounds.upper[axis] = std::max(bounds.upper[axis], to.bounds.upper[axis]);
    }
    return {.distance = (1 - part) * from.distance + part * to.distance,
            .bounds = bounds,
            .reach = 0,
            .steepness = std::max(from.steepness, to.steepness)};
}

} // namespace

Sdf Session::levelSetSdf(size_t age, double distance) {
    GridObject& object = grids.at(age);
    Sdf sdf = widenedSdf(object, distance);
    if (!object.earlier || object.part >= 1) return sdf;
    GridObject earlier = *object.earlier;
    return between(widenedSdf(earlier, distance), sdf, object.part);
}

Sdf Session::widenedSdf(GridObject& object, double distance) {
    for (const auto& known : mSdfs->entries)
        if (known.distance == distance && known.of.lock() == object.grid) {
            object.grid = known.widened;
            return known.sdf;
        }
    const openvdb::GridBase::ConstPtr given = object.grid;
    LevelSet levelSet = levelSetOf(object.grid);
    levelSet.mesh = object.mesh;
    const double halfWidth = distance / levelSet.voxelSize() + kSplineSupport;
    if (halfWidth > levelSet.halfWidth()) {
        console.detail(fmt::format("level set '{}': band widened from {:.3g} to {:.3g} voxels", object.grid->getName(),
                                   levelSet.halfWidth(), halfWidth));
        levelSet = widened(levelSet, halfWidth, console.follow("widening the band"));
        object.grid = levelSet.grid;
    }
    Sdf sdf = sdfOf(levelSet);
    mSdfs->add({given, distance, object.grid, sdf});
    return sdf;
}

Sdf Session::newestSdf(double distance) {
    const auto field = newestField(true), grid = newestLevelSet();
    if (!field && !grid)
        throw ValueError("there is no shape or level set; make one (-sphere, -mesh2ls, …) or read one");
    if (field && (!grid || fields.entry(*field).made > grids.entry(*grid).made)) return *fields.at(*field).sdf;
    return levelSetSdf(*grid, distance);
}

} // namespace curlew::app
