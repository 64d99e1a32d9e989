// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/Openvdb.h"

CURLEW_GRID_INSTANCES()
