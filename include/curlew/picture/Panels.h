// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/picture/Image.h"

#include <string>
#include <vector>

namespace curlew {

struct PanelOptions {
    int columns = 0; ///< 0: one row for up to three pictures, otherwise about as many columns as rows.
    int gap = -1;    ///< Pixels between the pictures and around them; negative: 1/100 of the total width.
    /// One line above each picture, in the legend font (Legend.h). Empty, or one per picture.
    std::vector<std::string> labels = {};
};

/// Returns RGB pictures side by side, row by row, as one RGB picture on a dark background. A column is as wide as its
/// widest picture, a row as high as its highest. Smaller pictures are centred in their column and aligned to the top of
/// their row. Labels become smaller, then shorter, if they do not fit. Throws ValueError if there is no picture,
/// channels are not R, G, B, the number of labels does not match, the number of columns is negative, or the result is
/// larger than 65536 pixels along an edge; ResourceError if it does not fit into memory.
Image panels(const std::vector<Image>& pictures, const PanelOptions& options = {});

} // namespace curlew
