#pragma once

#include "curlew/base/Monitor.h"
#include "curlew/flow/Domain.h"
#include "curlew/track/Points.h"

namespace curlew {

/// `count` points, uniform in the domain, with ids 0 … count-1. Point k depends on the seed and k alone.
/// Throws ValueError where the domain is empty or infinite.
Points scatter(const Domain& domain, size_t count, uint64_t seed, const Monitor& monitor = {});

/// The points from `first` on of those that a larger `count` would give: with ids first … first+count-1.
Points scatterFrom(const Domain& domain, int64_t first, size_t count, uint64_t seed, const Monitor& monitor = {});

} // namespace curlew
