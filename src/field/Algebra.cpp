#include "curlew/field/Algebra.h"

#include "curlew/base/Error.h"

#include <numbers>

namespace curlew {

namespace {

/// Zero times anything is zero, whatever its range.
double boundOfProduct(double a, double b) { return a == 0 || b == 0 ? 0 : a * b; }

struct Constant {
    double value;
    template <int Order, class T>
    Jet<T, 3, Order> at(const Vec3d&) const {
        return static_cast<T>(value);
    }
    double bound() const { return std::abs(value); }
};

struct Ramp {
    Vec3d direction;
    double offset;
    template <int Order, class T>
    Jet<T, 3, Order> at(const Vec3d& p) const {
        Jet<T, 3, Order> jet(static_cast<T>(dot(direction, p) + offset));
        if constexpr (Order >= 1)
            for (int i = 0; i < 3; ++i) jet.gradient[i] = static_cast<T>(direction[i]);
        return jet;
    }
};

template <class Combine>
struct Binary {
    ScalarField a, b;
    Combine combine;
    double limit;
    template <int Order, class T>
    void evalBatch(const PointBatch& points, JetBatch<T, Order>& jets) const {
        JetBatch<T, Order> other;
        a.eval(points, jets);
        b.eval(points, other);
        for (int i = 0; i < points.size; ++i) jets.set(i, combine(jets[i], other[i]));
    }
    double bound() const { return limit; }
};

struct Scaled {
    double factor;
    ScalarField field;
    template <int Order, class T>
    void evalBatch(const PointBatch& points, JetBatch<T, Order>& jets) const {
        field.eval(points, jets);
        for (int i = 0; i < points.size; ++i) jets.set(i, jets[i] * static_cast<T>(factor));
    }
    double bound() const { return boundOfProduct(std::abs(factor), field.bound()); }
};

struct Placed {
    ScalarField field;
    Matrix3 toField; // the inverse of R S
    Vec3d offset;
    template <int Order, class T>
    void evalBatch(const PointBatch& points, JetBatch<T, Order>& jets) const {
        PointBatch moved;
        for (int i = 0; i < points.size; ++i) moved.push(toField * (points[i] - offset));
        field.eval(moved, jets);
        for (int i = 0; i < points.size; ++i) jets.set(i, pullBack(jets[i], toField));
    }
    double bound() const { return field.bound(); }
};

template <class Combine>
Binary(ScalarField, ScalarField, Combine, double) -> Binary<Combine>;

Matrix3 rotation(const Vec3d& degrees) {
    Matrix3 product;
    for (int axis = 0; axis < 3; ++axis) {
        const double angle = degrees[axis] * std::numbers::pi / 180, c = std::cos(angle), s = std::sin(angle);
        const auto u = static_cast<size_t>((axis + 1) % 3), v = static_cast<size_t>((axis + 2) % 3);
        Matrix3 turn;
        turn.rows[u][static_cast<int>(u)] = turn.rows[v][static_cast<int>(v)] = c;
        turn.rows[u][static_cast<int>(v)] = -s;
        turn.rows[v][static_cast<int>(u)] = s;
        product = turn * product;
    }
    return product;
}

} // namespace

ScalarField constantField(double value) { return ScalarField(Constant{value}); }

ScalarField rampField(const Vec3d& direction, double offset) { return ScalarField(Ramp{direction, offset}); }

ScalarField operator+(const ScalarField& a, const ScalarField& b) {
    return ScalarField(Binary{a, b, [](const auto& p, const auto& q) { return p + q; }, a.bound() + b.bound()});
}

ScalarField operator*(const ScalarField& a, const ScalarField& b) {
    return ScalarField(
        Binary{a, b, [](const auto& p, const auto& q) { return p * q; }, boundOfProduct(a.bound(), b.bound())});
}

ScalarField operator*(double s, const ScalarField& a) { return ScalarField(Scaled{s, a}); }

ScalarField placed(const ScalarField& field, const Placement& placement) {
    if (placement == Placement{}) return field;
    Matrix3 inverse = transpose(rotation(placement.rotate));
    for (int i = 0; i < 3; ++i) {
        if (placement.scale[i] == 0) throw ValueError("a field cannot be scaled by zero");
        inverse.rows[static_cast<size_t>(i)] *= 1 / placement.scale[i];
    }
    return ScalarField(Placed{field, inverse, placement.offset});
}

} // namespace curlew
