// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Expand DO(N) for every dimension of fields, and for every dimension of flows. They serve the explicit instantiations
/// at the end of a source file.
#define CURLEW_FOR_DIMENSIONS(DO) DO(1) DO(2) DO(3) DO(4) DO(5) DO(6) DO(7)
#define CURLEW_FOR_FLOW_DIMENSIONS(DO) DO(2) DO(3) DO(4) DO(5) DO(6) DO(7)
