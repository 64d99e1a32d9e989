// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/render/Camera.h"

#include <cstddef>

namespace curlew::detail {

/// Computes where positions, at least as many as T has lanes, are in the picture of a camera.
struct ProjectKernel {
    /// Positions, and where to write pixels and depths.
    struct Job {
        const double *x, *y, *z;
        size_t count;
        float *pixelX, *pixelY, *depth;
    };

    template <class T>
    static void run(const Camera& camera, const Job& job) {
        using Float = Rebind<T, float>;
        constexpr size_t kCount{kLanes<T>};
        for (size_t next = 0; next < job.count; next += kCount) {
            const size_t k = std::min(next, job.count - kCount); // the last lanes may overlap those before
            const auto p = camera.project(Vec3<T>{{load<T>(job.x + k), load<T>(job.y + k), load<T>(job.z + k)}});
            store(convertTo<Float>(p.x), job.pixelX + k);
            store(convertTo<Float>(p.y), job.pixelY + k);
            store(convertTo<Float>(p.depth), job.depth + k);
        }
    }
};

} // namespace curlew::detail
