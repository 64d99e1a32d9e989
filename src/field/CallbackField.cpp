// SPDX-License-Identifier: Apache-2.0
#include "curlew/field/CallbackField.h"

#include "curlew/base/Error.h"
#include "curlew/base/Random.h"
#include "curlew/field/Differences.h"
#include "curlew/field/Dimensions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace curlew {

namespace {

template <int N>
class CallbackModel {
  public:
    CallbackModel(FieldCallback callback, double scale) : mCallback(std::move(callback)), mStep(scale * 0x1p-18) {}

    template <int Order, class T>
    void evalBatch(const PointBatchN<N>& points, JetBatchN<T, N, Order>& jets) const {
        if constexpr (Order == 3)
            throw ValueError("a field from a callback has no third derivatives");
        else
            evaluate<Order>(points, jets);
    }

  private:
    struct Found {
        std::array<double, kBatch> values;
        std::array<double, size_t{kBatch} * N> gradients;
        double gradient(size_t k, size_t axis) const { return gradients[k * N + axis]; }
    };

    Found call(const PointBatchN<N>& points) const {
        std::array<double, size_t{kBatch} * N> positions;
        const auto count = static_cast<size_t>(points.size);
        for (size_t k = 0; k < count; ++k)
            for (size_t axis = 0; axis < N; ++axis) positions[k * N + axis] = points.c[axis][k];
        Found found;
        mCallback(count, positions.data(), found.values.data(), found.gradients.data());
        return found;
    }

    template <int Order, class T>
    void evaluate(const PointBatchN<N>& points, JetBatchN<T, N, Order>& jets) const {
        using J = Jet<double, N, Order>;
        const Found here = call(points);
        std::array<J, kBatch> all;
        for (size_t k = 0; k < static_cast<size_t>(points.size); ++k) {
            all[k].value = here.values[k];
            if constexpr (Order >= 1)
                for (size_t axis = 0; axis < N; ++axis)
                    all[k].gradient[static_cast<int>(axis)] = here.gradient(k, axis);
        }
        if constexpr (Order >= 2)
            for (size_t j = 0; j < N; ++j) {
                PointBatchN<N> above = points, below = points;
                for (size_t k = 0; k < static_cast<size_t>(points.size); ++k) {
                    above.c[j][k] += mStep;
                    below.c[j][k] -= mStep;
                }
                const Found up = call(above), down = call(below);
                for (size_t k = 0; k < static_cast<size_t>(points.size); ++k)
                    for (size_t i = 0; i < N; ++i) {
                        const double d = (up.gradient(k, i) - down.gradient(k, i)) / (2 * mStep);
                        // A Hessian is symmetric: the mean of both differences. The diagonal is visited once.
                        all[k].hessian(static_cast<int>(i), static_cast<int>(j)) += i == j ? d : 0.5 * d;
                    }
            }
        for (int i = 0; i < points.size; ++i)
            for (int k = 0; k < J::kSize; ++k)
                jets.c[static_cast<size_t>(k)][static_cast<size_t>(i)] =
                    static_cast<T>(all[static_cast<size_t>(i)].component(k));
    }

    FieldCallback mCallback;
    double mStep; ///< Of the differences, world units.
};

/// The rms and the worst difference between gradients and central differences of the values.
template <int N>
struct GradientError {
    double rms = 0, gradients = 0, worst = 0;
    Vec<double, N> where{};
};

template <int N>
GradientError<N> gradientError(const ScalarFieldN<N>& field, const PointBatchN<N>& points, double h) {
    GradientError<N> error;
    JetBatchN<double, N, 1> jets;
    field.eval(points, jets);
    std::array<double, kBatch> squares{};
    forCentralDifferences(field, points, h, [&](int i, int axis, double difference) {
        const double gradient = jets[i].gradient[axis], off = difference - gradient;
        squares[static_cast<size_t>(i)] += off * off;
        error.gradients += gradient * gradient / points.size;
    });
    for (int i = 0; i < points.size; ++i) {
        const double square = squares[static_cast<size_t>(i)];
        error.rms += square / points.size;
        if (!(square <= error.worst)) {
            error.worst = square;
            error.where = points[i];
        }
    }
    error.rms = std::sqrt(error.rms);
    error.gradients = std::sqrt(error.gradients);
    return error;
}

template <int N>
void check(const ScalarFieldN<N>& field, const BoxN<N>& box, double scale) {
    constexpr uint64_t kSeed = 0x63616c6c;
    PointBatchN<N> points;
    while (!points.full()) {
        Vec<double, N> p;
        for (int axis = 0; axis < N; ++axis)
            p[axis] = box.lower[axis] + box.size()[axis] * randomUniform(kSeed, static_cast<uint64_t>(points.size),
                                                                         static_cast<uint64_t>(axis));
        points.push(p);
    }
    JetBatchN<double, N, 1> jets;
    field.eval(points, jets);
    for (int i = 0; i < points.size; ++i)
        for (int k = 0; k < Jet<double, N, 1>::kSize; ++k)
            if (!std::isfinite(jets[i].component(k)))
                throw ValueError(fmt::format("the callback returns a {} that is not finite at {:.6g}",
                                             k == 0 ? "value" : "gradient", fmt::join(points[i].c, ",")));
    // The error of central differences falls with the square of the step, for a kinked gradient at least with its root;
    // that of a wrong gradient stays.
    constexpr double kFalls = 0.75, kRounding = 1e-6;
    const double h = scale * 0x1p-12;
    const GradientError<N> coarse = gradientError(field, points, h), fine = gradientError(field, points, h / 4);
    if (fine.rms <= kRounding * fine.gradients || fine.rms <= kFalls * coarse.rms) return;
    throw ValueError(fmt::format(
        "the gradients of the callback are not those of its values: they differ from differences by {:.2g} "
        "of the rms gradient, most at {:.6g}",
        fine.rms / std::max(fine.gradients, std::numeric_limits<double>::min()), fmt::join(fine.where.c, ",")));
}

} // namespace

template <int N>
ScalarFieldN<N> callbackField(FieldCallback callback, const BoxN<N>& box) {
    if (!callback) throw ValueError("there is no callback");
    const Vec<double, N> size = box.size();
    const double scale = *std::max_element(size.c.begin(), size.c.end());
    if (!box.finite() || !(scale > 0)) throw ValueError("the box of a callback is empty or infinite");
    ScalarFieldN<N> field{CallbackModel<N>(std::move(callback), scale)};
    check(field, box, scale);
    return field;
}

#define CURLEW_INSTANTIATE(N) template ScalarFieldN<N> callbackField(FieldCallback, const BoxN<N>&);
CURLEW_FOR_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
