// SPDX-License-Identifier: Apache-2.0
#pragma once

/// OpenVDB's usual grids, only declared: enough for files that pass grids on. Files that use a grid include Openvdb.h,
/// which takes seconds to compile.

#include <openvdb/Types.h>

#include <memory>

namespace openvdb {
OPENVDB_USE_VERSION_NAMESPACE
namespace OPENVDB_VERSION_NAME {

class GridBase;
template <typename Tree>
class Grid;

namespace tree {
template <typename Root>
class Tree;
template <typename Child>
class RootNode;
template <typename Child, Index Log2Dim>
class InternalNode;
template <typename T, Index Log2Dim>
class LeafNode;
} // namespace tree

namespace points {
template <typename T, Index Log2Dim>
class PointDataLeafNode;
} // namespace points

template <typename Leaf>
using TreeOf = tree::Tree<tree::RootNode<tree::InternalNode<tree::InternalNode<Leaf, 4>, 5>>>;

using FloatGrid = Grid<TreeOf<tree::LeafNode<float, 3>>>;
using Vec3SGrid = Grid<TreeOf<tree::LeafNode<Vec3s, 3>>>;

namespace points {
using PointDataGrid = Grid<TreeOf<PointDataLeafNode<PointDataIndex32, 3>>>;
} // namespace points

} // namespace OPENVDB_VERSION_NAME
} // namespace openvdb
