// SPDX-License-Identifier: Apache-2.0
#include "Arrays.h"
#include "Handle.h"
#include "curlew/vdb/Openvdb.h"

#include <openvdb/tools/Dense.h>

#include <limits>

using namespace curlew;
using namespace curlew::c;

namespace {

openvdb::GridBase::ConstPtr gridAt(const curlew_session* session, int64_t position) {
    return std::get<app::GridValue>(required(session, "the session").object(CURLEW_GRID, position).value).grid;
}

/// Calls `use` with the grid as its concrete type. Throws ValueError if its values are neither numbers nor vectors.
template <class Use>
void withGrid(const openvdb::GridBase& grid, const Use& use) {
    using Known = openvdb::TypeList<openvdb::FloatGrid, openvdb::DoubleGrid, openvdb::Int32Grid, openvdb::Int64Grid,
                                    openvdb::Vec3SGrid, openvdb::Vec3DGrid>;
    if (!grid.apply<Known>(use))
        throw ValueError(
            fmt::format("the values of grid '{}' have the type {}; only numbers and vectors of three can be read",
                        grid.getName(), grid.valueType()));
}

openvdb::CoordBBox boxOf(const int64_t* lower, const int64_t* upper) {
    openvdb::Coord least, most;
    for (int axis = 0; axis < 3; ++axis) {
        constexpr int64_t kMax = 1 << 30;
        if (lower[axis] < -kMax || upper[axis] > kMax || lower[axis] >= upper[axis])
            throw ValueError(
                fmt::format("the box is empty or too large along axis {}: {} to {}", axis, lower[axis], upper[axis]));
        least[axis] = static_cast<int>(lower[axis]);
        most[axis] = static_cast<int>(upper[axis] - 1);
    }
    return {least, most};
}

/// Returns the components of a value; unused ones are 0.
template <class Value>
std::array<double, 3> componentsOf(const Value& value) {
    if constexpr (openvdb::VecTraits<Value>::IsVec)
        return {static_cast<double>(value[0]), static_cast<double>(value[1]), static_cast<double>(value[2])};
    else
        return {static_cast<double>(value), 0, 0};
}

} // namespace

extern "C" {

curlew_status curlew_grid_box(const curlew_session* session, int64_t position, int64_t lower[3], int64_t upper[3]) {
    return guarded([&] {
        required(lower, "lower"), required(upper, "upper");
        const openvdb::CoordBBox box = gridAt(session, position)->evalActiveVoxelBoundingBox();
        for (int axis = 0; axis < 3; ++axis) {
            lower[axis] = box.empty() ? 0 : box.min()[axis];
            upper[axis] = box.empty() ? 0 : int64_t{box.max()[axis]} + 1;
        }
    });
}

curlew_status curlew_grid_read(const curlew_session* session, int64_t position, const int64_t lower[3],
                               const int64_t upper[3], const curlew_buffer* buffer) {
    return guarded([&] {
        const openvdb::CoordBBox box = boxOf(&required(lower, "lower"), &required(upper, "upper"));
        int64_t count = 1;
        for (int axis = 0; axis < 3; ++axis) {
            const int64_t size = upper[axis] - lower[axis];
            if (size > std::numeric_limits<int32_t>::max() / count)
                throw ValueError("the box has 2^31 voxels or more; read parts of it");
            count *= size;
        }
        const openvdb::Coord size = box.dim();
        const curlew_buffer& target = required(buffer, "the buffer");
        withGrid(*gridAt(session, position), [&]<class Grid>(const Grid& grid) {
            using Value = typename Grid::ValueType;
            constexpr bool kVector = openvdb::VecTraits<Value>::IsVec;
            constexpr bool kInteger = std::is_integral_v<Value>;
            checkBuffer(target, "the buffer", count, kVector ? 3 : 1, kInteger ? Numbers::integers : Numbers::floats);
            const ptrdiff_t stride = strideOf(target);
            const auto plane = static_cast<size_t>(size[1]) * static_cast<size_t>(size[2]);
            parallelFor(static_cast<size_t>(size[0]), 1, [&](size_t begin, size_t end) {
                auto accessor = grid.getConstAccessor();
                for (size_t x = begin; x < end; ++x)
                    for (size_t n = 0; n < plane; ++n) {
                        const openvdb::Coord ijk =
                            box.min().offsetBy(static_cast<int>(x), static_cast<int>(n / static_cast<size_t>(size[2])),
                                               static_cast<int>(n % static_cast<size_t>(size[2])));
                        const Value value = accessor.getValue(ijk);
                        const size_t item = x * plane + n;
                        if constexpr (kInteger) {
                            putInteger(static_cast<int64_t>(value), target, stride, item, 0);
                        } else {
                            const auto components = componentsOf(value);
                            for (size_t k = 0; k < (kVector ? 3 : 1); ++k)
                                putReal(components[k], target, stride, item, k);
                        }
                    }
            });
        });
    });
}

curlew_status curlew_grid_leaves(const curlew_session* session, int64_t position, int64_t* count) {
    return guarded([&] {
        required(count, "the pointer to the count") = 0;
        withGrid(*gridAt(session, position),
                 [&](const auto& grid) { *count = static_cast<int64_t>(grid.tree().leafCount()); });
    });
}

curlew_status curlew_grid_leaf(const curlew_session* session, int64_t position, int64_t leaf, int64_t origin[3],
                               const void** values, const uint64_t** active) {
    return guarded([&] {
        required(origin, "origin"), required(values, "values") = nullptr, required(active, "active") = nullptr;
        const curlew_session& s = required(session, "the session");
        const openvdb::GridBase::ConstPtr held = gridAt(session, position);
        withGrid(*held, [&]<class Grid>(const Grid& grid) {
            using Leaf = typename Grid::TreeType::LeafNodeType;
            // Callers usually read all leaves of a grid in turn.
            if (s.leavesOf != held) {
                s.leaves.clear();
                for (auto it = grid.tree().cbeginLeaf(); it; ++it) s.leaves.push_back(&*it);
                s.leavesOf = held;
            }
            if (leaf < 0 || static_cast<size_t>(leaf) >= s.leaves.size())
                throw ValueError(fmt::format("there is no leaf {}; the grid has {}", leaf, s.leaves.size()));
            const auto& found = *static_cast<const Leaf*>(s.leaves[static_cast<size_t>(leaf)]);
            for (int axis = 0; axis < 3; ++axis) origin[axis] = found.origin()[axis];
            *values = found.buffer().data();
            *active = reinterpret_cast<const uint64_t*>(&found.valueMask()); // NOLINT: its words are its only member
        });
    });
}
}
