// SPDX-License-Identifier: Apache-2.0
#include "Arrays.h"
#include "Handle.h"
#include "curlew/field/ForEachBatch.h"

#include <algorithm>

using namespace curlew;
using namespace curlew::c;

struct curlew_field {
    app::AnyField field;
};
struct curlew_flow {
    app::AnyFlow flow;
};

namespace {

/// The positions of a call.
struct Positions {
    const curlew_array& array;
    ptrdiff_t stride = strideOf(array);

    size_t size() const { return static_cast<size_t>(array.count); }
    template <int N>
    Vec<double, N> at(size_t k) const {
        Vec<double, N> p;
        for (int axis = 0; axis < N; ++axis) p[axis] = realAt(array, stride, k, static_cast<size_t>(axis));
        return p;
    }
};

/// A buffer for results; may be absent.
struct Target {
    const curlew_buffer* buffer;
    ptrdiff_t stride = buffer ? strideOf(*buffer) : 0;

    bool wanted() const { return buffer != nullptr; }
    bool isDouble() const { return buffer && buffer->type == CURLEW_FLOAT64; }
    void put(double value, size_t item, size_t component) const { putReal(value, *buffer, stride, item, component); }
};

void checkTarget(const curlew_buffer* buffer, const char* name, const Positions& positions, int components) {
    if (buffer) checkBuffer(*buffer, name, positions.array.count, components, Numbers::floats);
}

/// Calls `work(points, begin, finite)` for batches of the positions. Positions that are not finite are replaced by the
/// origin, and `work` must write NaN for them.
template <int N, class Work>
void forEachFinite(const Positions& positions, const Work& work) {
    forEachBatch(PointsBy{positions.size(), [&](size_t k) { return positions.at<N>(k); }},
                 [&](PointBatchN<N> points, size_t begin) {
                     std::array<bool, kBatch> finite{};
                     for (int i = 0; i < points.size; ++i) {
                         const Vec<double, N> p = points[i];
                         finite[static_cast<size_t>(i)] =
                             std::all_of(p.c.begin(), p.c.end(), [](double x) { return std::isfinite(x); });
                         if (!finite[static_cast<size_t>(i)]) points.set(i, {});
                     }
                     work(points, begin, finite);
                 });
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

template <class T, int N>
void evaluate(const ScalarFieldN<N>& field, const Positions& positions, const Target& values, const Target& gradients) {
    forEachFinite<N>(positions, [&](const PointBatchN<N>& points, size_t begin, const auto& finite) {
        JetBatchN<T, N, 1> jets;
        if (gradients.wanted()) {
            field.eval(points, jets);
        } else {
            JetBatchN<T, N, 0> plain;
            field.eval(points, plain);
            jets.c[0] = plain.c[0];
        }
        for (size_t i = 0; i < static_cast<size_t>(points.size); ++i) {
            const auto number = [&](size_t k) { return finite[i] ? static_cast<double>(jets.c[k][i]) : kNan; };
            if (values.wanted()) values.put(number(0), begin + i, 0);
            for (size_t axis = 0; axis < N && gradients.wanted(); ++axis)
                gradients.put(number(1 + axis), begin + i, axis);
        }
    });
}

template <class T, int N>
void evaluate(const FlowN<N>& flow, const Positions& positions, const Target& velocities, const Target& potentials) {
    forEachFinite<N>(positions, [&](const PointBatchN<N>& points, size_t begin, const auto& finite) {
        typename FlowN<N>::template Jets<T> jets;
        VecBatchN<T, N> velocity;
        flow.eval(points, jets, velocity);
        for (int i = 0; i < points.size; ++i) {
            const size_t item = begin + static_cast<size_t>(i);
            const bool good = finite[static_cast<size_t>(i)];
            for (int axis = 0; axis < N && velocities.wanted(); ++axis)
                velocities.put(good ? static_cast<double>(velocity[i][axis]) : kNan, item, static_cast<size_t>(axis));
            for (size_t k = 0; k < N - 1 && potentials.wanted(); ++k)
                potentials.put(good ? static_cast<double>(jets[k][i].value) : kNan, item, k);
        }
    });
}

/// Returns the positions. Throws ValueError unless they have the object's dimension, or 3 components.
Positions positionsFor(const curlew_array* positions, int dimension) {
    const curlew_array& array = required(positions, "positions");
    checkArray(array, "positions", dimension < 3 && array.components == 3 ? 3 : dimension, Numbers::floats);
    return {array};
}

} // namespace

extern "C" {

curlew_status curlew_session_field(const curlew_session* session, int64_t age, curlew_field** field) {
    return guarded([&] {
        required(field, "the pointer to the field") = nullptr;
        const app::Session::Held& held = required(session, "the session").object(CURLEW_FIELD, age);
        *field = new curlew_field{std::get<app::FieldValue>(held.value).field};
    });
}

curlew_status curlew_session_flow(const curlew_session* session, int64_t age, curlew_flow** flow) {
    return guarded([&] {
        required(flow, "the pointer to the flow") = nullptr;
        const app::Session::Held& held = required(session, "the session").object(CURLEW_FLOW, age);
        *flow = new curlew_flow{std::get<app::AnyFlow>(held.value)};
    });
}

void curlew_field_release(curlew_field** field) {
    if (field) delete std::exchange(*field, nullptr);
}
void curlew_flow_release(curlew_flow** flow) {
    if (flow) delete std::exchange(*flow, nullptr);
}

int32_t curlew_field_dimension(const curlew_field* field) { return field ? app::dimensionOf(field->field) : 0; }
int32_t curlew_flow_dimension(const curlew_flow* flow) { return flow ? app::dimensionOf(flow->flow) : 0; }

curlew_status curlew_field_evaluate(const curlew_field* field, const curlew_array* positions,
                                    const curlew_buffer* values, const curlew_buffer* gradients) {
    return guarded([&] {
        const app::AnyField& known = required(field, "the field").field;
        const Positions at = positionsFor(positions, app::dimensionOf(known));
        const int dimension = at.array.components;
        checkTarget(values, "values", at, 1);
        checkTarget(gradients, "gradients", at, dimension);
        const Target value{values}, gradient{gradients};
        const app::AnyField seen = dimension == app::dimensionOf(known) ? known : app::AnyField(app::inSpace(known));
        std::visit(
            [&]<int N>(const ScalarFieldN<N>& f) {
                if (value.isDouble() || gradient.isDouble())
                    evaluate<double, N>(f, at, value, gradient);
                else
                    evaluate<float, N>(f, at, value, gradient);
            },
            seen);
    });
}

curlew_status curlew_flow_evaluate(const curlew_flow* flow, const curlew_array* positions,
                                   const curlew_buffer* velocities, const curlew_buffer* potentials) {
    return guarded([&] {
        const app::AnyFlow& known = required(flow, "the flow").flow;
        const Positions at = positionsFor(positions, app::dimensionOf(known));
        const int dimension = at.array.components;
        checkTarget(velocities, "velocities", at, dimension);
        checkTarget(potentials, "potentials", at, dimension - 1);
        const Target velocity{velocities}, potential{potentials};
        const app::AnyFlow seen = dimension == app::dimensionOf(known) ? known : app::AnyFlow(app::inSpace(known));
        std::visit(
            [&]<int N>(const FlowN<N>& f) {
                if (potential.wanted() && !f.hasTracks())
                    throw ValueError("this flow has no tracks, so it has no potentials");
                if (velocity.isDouble() || potential.isDouble())
                    evaluate<double, N>(f, at, velocity, potential);
                else
                    evaluate<float, N>(f, at, velocity, potential);
            },
            seen);
    });
}
}
