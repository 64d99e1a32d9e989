// SPDX-License-Identifier: Apache-2.0
#pragma once

/// OpenVDB, with the grids that most files here make declared as instantiated elsewhere (src/vdb/Openvdb.cpp). A
/// compiler that sees a tree constructed compiles all virtual functions of its type: 250 kB of machine code per type.

#include <openvdb/openvdb.h>

// NOLINTBEGIN(bugprone-macro-parentheses): the arguments are template arguments
#define CURLEW_GRID_INSTANCE(prefix, name)                                  \
    prefix template class openvdb::tree::Tree<openvdb::name::RootNodeType>; \
    prefix template class openvdb::Grid<openvdb::name>;
#define CURLEW_GRID_INSTANCES(prefix)        \
    CURLEW_GRID_INSTANCE(prefix, FloatTree)  \
    CURLEW_GRID_INSTANCE(prefix, DoubleTree) \
    CURLEW_GRID_INSTANCE(prefix, Int32Tree)  \
    CURLEW_GRID_INSTANCE(prefix, MaskTree)   \
    CURLEW_GRID_INSTANCE(prefix, Vec3STree)
// NOLINTEND(bugprone-macro-parentheses)

CURLEW_GRID_INSTANCES(extern)
