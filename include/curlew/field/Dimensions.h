// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Repeats DO(N) for every dimension that fields have, and that flows have: for the explicit instantiations at the end
/// of a source file.
#define CURLEW_FOR_DIMENSIONS(DO) DO(1) DO(2) DO(3) DO(4) DO(5) DO(6) DO(7)
#define CURLEW_FOR_FLOW_DIMENSIONS(DO) DO(2) DO(3) DO(4) DO(5) DO(6) DO(7)
