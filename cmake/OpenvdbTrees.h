// SPDX-License-Identifier: Apache-2.0
// The types of trees that the functions of openvdb::tools are instantiated for (see StaticOpenVDB.cmake): those of our
// grids, instead of OpenVDB's eleven.
#pragma once

#include <openvdb/version.h>

#undef OPENVDB_REAL_TREE_INSTANTIATE
#undef OPENVDB_NUMERIC_TREE_INSTANTIATE
#undef OPENVDB_VEC3_TREE_INSTANTIATE
#undef OPENVDB_VOLUME_TREE_INSTANTIATE
#undef OPENVDB_ALL_TREE_INSTANTIATE
#define OPENVDB_REAL_TREE_INSTANTIATE(Function) OPENVDB_INSTANTIATE Function(FloatTree);
#define OPENVDB_NUMERIC_TREE_INSTANTIATE(Function) \
    OPENVDB_INSTANTIATE Function(Int32Tree);       \
    OPENVDB_REAL_TREE_INSTANTIATE(Function)
#define OPENVDB_VEC3_TREE_INSTANTIATE(Function) OPENVDB_INSTANTIATE Function(Vec3STree);
#define OPENVDB_VOLUME_TREE_INSTANTIATE(Function) \
    OPENVDB_INSTANTIATE Function(BoolTree);       \
    OPENVDB_NUMERIC_TREE_INSTANTIATE(Function)    \
    OPENVDB_VEC3_TREE_INSTANTIATE(Function)
#define OPENVDB_ALL_TREE_INSTANTIATE(Function) OPENVDB_VOLUME_TREE_INSTANTIATE(Function)
