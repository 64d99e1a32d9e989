#include "Arrays.h"
#include "Handle.h"

#include <optional>

using namespace curlew;
using namespace curlew::c;

struct curlew_field {
    app::AnyField field;
};
struct curlew_flow {
    app::AnyFlow flow;
};

namespace {

/// The positions of a call, in batches.
struct Positions {
    const curlew_array& array;
    ptrdiff_t stride = strideOf(array);

    size_t size() const { return static_cast<size_t>(array.count); }
    /// Those from `begin` on; `finite` tells for which what is computed counts.
    template <int N>
    PointBatchN<N> batch(size_t begin, std::array<bool, kBatch>& finite) const {
        PointBatchN<N> points;
        for (size_t k = begin; k < std::min(size(), begin + kBatch); ++k) {
            Vec<double, N> p;
            bool good = true;
            for (int axis = 0; axis < N; ++axis) {
                p[axis] = realAt(array, stride, k, static_cast<size_t>(axis));
                good = good && std::isfinite(p[axis]);
            }
            finite[k - begin] = good;
            points.push(good ? p : Vec<double, N>{});
        }
        return points;
    }
};

/// Where results go, if they are wanted.
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

/// Calls `work(begin)` for the batches of the positions.
template <class Work>
void forEachBatch(const Positions& positions, const Work& work) {
    constexpr size_t kGrain = size_t{16} * kBatch;
    parallelFor(positions.size(), kGrain, [&](size_t begin, size_t end) {
        for (size_t k = begin; k < end; k += kBatch) work(k);
    });
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

template <class T, int N>
void evaluate(const ScalarFieldN<N>& field, const Positions& positions, const Target& values, const Target& gradients) {
    forEachBatch(positions, [&](size_t begin) {
        std::array<bool, kBatch> finite{};
        const PointBatchN<N> points = positions.batch<N>(begin, finite);
        JetBatchN<T, N, 1> jets;
        if (gradients.wanted()) {
            field.eval(points, jets);
        } else {
            JetBatchN<T, N, 0> plain;
            field.eval(points, plain);
            jets.c[0] = plain.c[0];
        }
        for (int i = 0; i < points.size; ++i) {
            const size_t item = begin + static_cast<size_t>(i);
            const auto number = [&](size_t component) {
                return finite[static_cast<size_t>(i)] ? static_cast<double>(jets.c[component][static_cast<size_t>(i)])
                                                      : kNan;
            };
            if (values.wanted()) values.put(number(0), item, 0);
            for (size_t axis = 0; axis < N && gradients.wanted(); ++axis) gradients.put(number(1 + axis), item, axis);
        }
    });
}

template <class T, int N>
void evaluate(const FlowN<N>& flow, const Positions& positions, const Target& velocities, const Target& potentials) {
    forEachBatch(positions, [&](size_t begin) {
        std::array<bool, kBatch> finite{};
        const PointBatchN<N> points = positions.batch<N>(begin, finite);
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

/// The positions, once they are known to be some of the object's dimension, or in space.
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
        const app::Session& s = required(session, "the session").readable();
        *field = new curlew_field{s.fields.at(static_cast<size_t>(std::max<int64_t>(age, -1))).field};
    });
}

curlew_status curlew_session_flow(const curlew_session* session, int64_t age, curlew_flow** flow) {
    return guarded([&] {
        required(flow, "the pointer to the flow") = nullptr;
        const app::Session& s = required(session, "the session").readable();
        *flow = new curlew_flow{s.flows.at(static_cast<size_t>(std::max<int64_t>(age, -1)))};
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
                    throw ValueError("this flow is a sum, and has no tracks and no potentials");
                if (velocity.isDouble() || potential.isDouble())
                    evaluate<double, N>(f, at, velocity, potential);
                else
                    evaluate<float, N>(f, at, velocity, potential);
            },
            seen);
    });
}
}
