// SPDX-License-Identifier: Apache-2.0
#include "PointArrays.h"
#include "VoxelSize.h"
#include "curlew/base/Error.h"
#include "curlew/base/Memory.h"
#include "curlew/base/PacedMonitor.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/PointFile.h"

#include <fmt/format.h>
#include <openvdb/points/AttributeArray.h>
#include <openvdb/points/PointAttribute.h>
#include <openvdb/points/PointConversion.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

namespace curlew {

namespace {

namespace points = openvdb::points;

/// Adapters from the particles' arrays to OpenVDB's point tools. They also let these be cancelled.
struct Positions {
    using value_type = openvdb::Vec3d; // NOLINT: OpenVDB's name for it
    using PosType = openvdb::Vec3d;
    const Points& particles;
    PacedMonitor ask;

    size_t size() const { return particles.size(); }
    void getPos(size_t n, PosType& position) const {
        ask();
        position = {particles.x[n], particles.y[n], particles.z[n]};
    }
};

struct Velocities {
    using value_type = openvdb::Vec3s; // NOLINT: OpenVDB's name for it
    const Points& particles;
    PacedMonitor ask;

    void get(value_type& v, openvdb::Index64 n, openvdb::Index) const {
        ask();
        v = {particles.vx[n], particles.vy[n], particles.vz[n]};
    }
};

struct Ids {
    using value_type = int32_t; // NOLINT: OpenVDB's name for it
    const Points& particles;
    PacedMonitor ask;

    void get(value_type& id, openvdb::Index64 n, openvdb::Index) const {
        ask();
        id = int32_t(particles.id[n]);
    }
};

struct ScalarValues {
    using value_type = float; // NOLINT: OpenVDB's name for it
    const Points& particles;
    const Scalar& scalar;
    PacedMonitor ask;

    void get(value_type& value, openvdb::Index64 n, openvdb::Index) const {
        ask();
        value = scalar.of(particles, n);
    }
};

const points::AttributeArray& attributeOf(const points::PointDataTree::LeafNodeType& leaf, std::string_view name) {
    const size_t position = leaf.attributeSet().find(std::string(name));
    if (position >= leaf.attributeSet().size())
        throw ValueError(
            fmt::format("some points of the grid have no attribute '{}'; give it to all of them, or to none", name));
    return leaf.constAttributeArray(position);
}

template <typename T>
points::AttributeHandle<T> handleOf(const points::AttributeArray& array, const std::string& name) {
    if (array.valueType() != openvdb::typeNameAsString<T>())
        throw ValueError(fmt::format("the point attribute '{}' has the type {}; give it the type {}", name,
                                     array.valueType(), openvdb::typeNameAsString<T>()));
    return points::AttributeHandle<T>(array);
}

template <typename T>
void readIds(const points::AttributeArray& array, int64_t* ids) {
    const points::AttributeHandle<T> handle(array);
    for (openvdb::Index n = 0; n < handle.size(); ++n) ids[n] = handle.get(n);
}

template <typename T>
void reorder(std::vector<T>& values, const std::vector<size_t>& order, const Monitor& monitor) {
    if (values.empty()) return;
    std::vector<T> sorted(values.size());
    parallelFor(
        values.size(), 1 << 16,
        [&](size_t begin, size_t end) {
            for (size_t n = begin; n < end; ++n) sorted[n] = values[order[n]];
        },
        monitor);
    values = std::move(sorted);
}

/// Returns the position of each id if the ids are distinct consecutive numbers in any order; otherwise an empty vector.
std::vector<size_t> placesOf(const std::vector<int64_t>& ids) {
    const auto [least, most] = std::minmax_element(ids.begin(), ids.end());
    if (uint64_t(*most) - uint64_t(*least) != ids.size() - 1) return {};
    constexpr size_t none = std::numeric_limits<size_t>::max();
    std::vector<size_t> places(ids.size(), none);
    const int64_t first = *least;
    for (size_t n = 0; n < ids.size(); ++n) {
        size_t& place = places[size_t(ids[n] - first)];
        if (place != none) return {};
        place = n;
    }
    return places;
}

void sortById(Points& particles, const Monitor& monitor) {
    const std::vector<int64_t>& ids = particles.id;
    if (std::is_sorted(ids.begin(), ids.end())) return;
    std::vector<size_t> order = placesOf(ids);
    if (order.empty()) {
        order.resize(ids.size());
        std::iota(order.begin(), order.end(), size_t(0));
        tbb::parallel_sort(order, [&, ask = PacedMonitor(monitor)](size_t a, size_t b) {
            ask();
            return std::pair(ids[a], a) < std::pair(ids[b], b);
        });
    }
    forEachArray(particles, [&](auto& values) { reorder(values, order, monitor); });
}

} // namespace

points::PointDataGrid::Ptr pointGrid(const Points& particles, const PointGridOptions& options, const Monitor& monitor) {
    openvdb::initialize();
    checkArrays(particles);
    checkIds(particles);
    auto grid = points::PointDataGrid::create();
    if (particles.size() > 0) {
        // OpenVDB's index of the points, the order of the points in it, and leaves of about eight points per voxel.
        constexpr double kIndexBytes = 45;
        constexpr auto kPositionAndId = static_cast<double>(sizeof(openvdb::Vec3s) + sizeof(int32_t));
        const size_t more =
            (particles.hasVelocity() ? sizeof(openvdb::Vec3s) : 0) + sizeof(float) * scalarsOf(particles).size();
        requireMemory(
            (kIndexBytes + kPositionAndId + static_cast<double>(more)) * static_cast<double>(particles.size()),
            fmt::format("a grid of {} points", particles.size()), "write fewer points");
        const auto transform =
            openvdb::math::Transform::createLinearTransform(voxelSizeFor(particles, options.voxelSize, monitor));
        const PacedMonitor ask(monitor);
        const Positions positions{particles, ask};
        const auto index = openvdb::tools::createPointIndexGrid<openvdb::tools::PointIndexGrid>(positions, *transform);
        grid = points::createPointDataGrid<points::NullCodec, points::PointDataGrid>(*index, positions, *transform);
        if (particles.hasVelocity()) {
            points::appendAttribute<openvdb::Vec3s>(grid->tree(), options.velocity);
            points::populateAttribute(grid->tree(), index->tree(), options.velocity, Velocities{particles, ask});
        }
        points::appendAttribute<int32_t>(grid->tree(), "id");
        points::populateAttribute(grid->tree(), index->tree(), "id", Ids{particles, ask});
        for (const Scalar& scalar : scalarsOf(particles)) {
            points::appendAttribute<float>(grid->tree(), scalar.name);
            points::populateAttribute(grid->tree(), index->tree(), scalar.name, ScalarValues{particles, scalar, ask});
        }
    }
    grid->setName(options.name);
    if (particles.hasVelocity()) grid->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
    return grid;
}

Points pointsOf(const points::PointDataGrid& grid, const Monitor& monitor) {
    using Leaf = points::PointDataTree::LeafNodeType;
    std::vector<const Leaf*> leaves;
    std::vector<size_t> starts{0};
    std::string velocity; // its attribute name, if there is one
    bool hasIds = false;
    std::vector<Scalar> scalars;
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
        if (leaf->getLastValue() == 0) continue;
        leaves.push_back(&*leaf);
        starts.push_back(starts.back() + leaf->getLastValue());
        const auto host = std::find_if(kHostProfiles.begin(), kHostProfiles.end(), [&](const HostProfile& profile) {
            return leaf->hasAttribute(std::string(profile.pointVelocity));
        });
        if (host != kHostProfiles.end()) velocity = host->pointVelocity;
        hasIds = hasIds || leaf->hasAttribute("id");
    }

    for (const Scalar& scalar : kScalars)
        if (!leaves.empty() && leaves.front()->hasAttribute(scalar.name) &&
            attributeOf(*leaves.front(), scalar.name).valueType() == openvdb::typeNameAsString<float>())
            scalars.push_back(scalar);
    Points particles;
    const size_t size = starts.back();
    // Bytes per point: positions, ids, and for sorting an order and a second copy of one array.
    const double bytes =
        4 * 8.0 + (hasIds ? 2 * 8.0 : 0) + (velocity.empty() ? 0 : 3 * 4.0) + 8.0 * double(scalars.size());
    requireMemory(bytes * double(size), fmt::format("the {} points of the grid '{}'", size, grid.getName()),
                  "write fewer points into the file");
    for (auto* values : {&particles.x, &particles.y, &particles.z}) values->resize(size);
    if (!velocity.empty())
        for (auto* values : {&particles.vx, &particles.vy, &particles.vz}) values->resize(size);
    for (const Scalar& scalar : scalars) scalar.resize(particles, size);
    particles.id.resize(size);
    if (!hasIds) std::iota(particles.id.begin(), particles.id.end(), int64_t(0));

    const auto readLeaf = [&](const Leaf& leaf, size_t start) {
        leaf.validateOffsets();
        const auto positions = handleOf<openvdb::Vec3s>(attributeOf(leaf, "P"), "P");
        openvdb::Index n = 0;
        for (openvdb::Index voxel = 0; voxel < Leaf::SIZE; ++voxel) {
            const openvdb::Vec3d corner = leaf.offsetToGlobalCoord(voxel).asVec3d();
            for (const openvdb::Index end = leaf.getValue(voxel); n < end; ++n) {
                const openvdb::Vec3d world = grid.indexToWorld(corner + openvdb::Vec3d(positions.get(n)));
                particles.x[start + n] = world.x(), particles.y[start + n] = world.y(),
                                    particles.z[start + n] = world.z();
            }
        }
        if (!velocity.empty()) {
            const auto velocities = handleOf<openvdb::Vec3s>(attributeOf(leaf, velocity), velocity);
            for (openvdb::Index k = 0; k < n; ++k) {
                const openvdb::Vec3s v = velocities.get(k);
                particles.vx[start + k] = v.x(), particles.vy[start + k] = v.y(), particles.vz[start + k] = v.z();
            }
        }
        for (const Scalar& scalar : scalars) {
            const auto values = handleOf<float>(attributeOf(leaf, scalar.name), scalar.name);
            for (openvdb::Index k = 0; k < n; ++k) scalar.set(particles, start + k, values.get(k));
        }
        if (hasIds) {
            const points::AttributeArray& ids = attributeOf(leaf, "id");
            if (ids.valueType() == openvdb::typeNameAsString<int64_t>())
                readIds<int64_t>(ids, &particles.id[start]);
            else if (ids.valueType() == openvdb::typeNameAsString<int32_t>())
                readIds<int32_t>(ids, &particles.id[start]);
            else
                throw ValueError(fmt::format(
                    "the point attribute 'id' has the type {}; give it the type int32 or int64", ids.valueType()));
        }
    };
    parallelFor(
        leaves.size(), 16,
        [&](size_t begin, size_t end) {
            for (size_t n = begin; n < end; ++n) readLeaf(*leaves[n], starts[n]);
        },
        monitor);
    if (particles.f.size() != particles.g.size())
        for (auto* half : {&particles.f, &particles.g}) half->clear(); // a track needs both
    if (hasIds) sortById(particles, monitor);
    return particles;
}

} // namespace curlew
