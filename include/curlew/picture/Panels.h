// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/picture/Image.h"

#include <string>
#include <vector>

namespace curlew {

struct PanelOptions {
    int columns = 0; ///< 0: one row of up to three pictures, else about as many columns as rows.
    int gap = -1;    ///< Pixels between the pictures and around them; negative: a hundredth of the whole.
    /// One line above each picture, in the font of the legends (Legend.h); none, or as many as there are pictures.
    std::vector<std::string> labels = {};
};

/// RGB pictures side by side, row by row, as one RGB picture on a dark ground. A column is as wide as its widest
/// picture, a row as high as its highest; smaller ones stand in the middle of their column, at the top of their row.
/// Labels become smaller, then shorter, where they have no room. Throws ValueError where there is no picture, for other
/// channels than R, G, B, for labels in another number and for negative columns; ResourceError where the memory would
/// not do.
Image panels(const std::vector<Image>& pictures, const PanelOptions& options = {});

} // namespace curlew
