// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Isolated.h"
#include "curlew/vdb/ModelData.h"

namespace curlew::app {

/// Hands the data of a model file over to the host process.
void writeModel(const ModelData& data, PartWriter& parts);

/// Takes what writeModel() wrote. Throws FileError unless it is consistent (isConsistent()).
ModelData takeModel(PartReader& parts);

} // namespace curlew::app
