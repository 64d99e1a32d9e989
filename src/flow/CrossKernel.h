// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/flow/Flow.h"

namespace curlew {

/// Adds the contribution of one term of a flow to the velocity, computed from the jets of its potentials.
template <int N>
struct CrossKernel {
    template <class T, class Jets>
    static void run(const Jets& jets, const int& size, const bool& first, VecBatchN<NumberOf<T>, N>& velocity) {
        for (int i = 0; i < size; i += kLanes<T>) {
            std::array<Vec<T, N>, size_t{N - 1}> gradients;
            for (size_t k = 0; k < gradients.size(); ++k)
                for (int axis = 0; axis < N; ++axis)
                    gradients[k][axis] = load<T>(&jets[k].c[static_cast<size_t>(axis) + 1][static_cast<size_t>(i)]);
            const Vec<T, N> c = cross(gradients);
            velocity.set(i, first ? c : velocity.template lanes<T>(i) + c);
        }
    }
};

} // namespace curlew
