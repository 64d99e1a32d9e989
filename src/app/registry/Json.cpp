// SPDX-License-Identifier: Apache-2.0
#include "curlew/app/registry/Json.h"

template class nlohmann::basic_json<nlohmann::ordered_map>;
