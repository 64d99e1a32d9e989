// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/track/Stepper.h"

#include <string>

namespace curlew {

/// Returns Σ weights_j k_j of the first `count` stages as text in any dialect, without those of weight 0. Stage j is
/// the variable kj; the last one has another name, unless that is empty.
std::string stageText(const std::array<double, Tableau::kMaxStages>& weights, int count, const std::string& last = {});

} // namespace curlew
