// SPDX-License-Identifier: Apache-2.0
#include "EdgeSpline.h"

#include "SplineContraction.h"
#include "curlew/base/Parallel.h"
#include "curlew/math/CubicBSpline.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace curlew {

namespace {

/// Computes the n + 2 coefficients of the cubic spline through n >= 5 values at the integers, with a continuous third
/// derivative at the second and the last but one of them ("not a knot").
void interpolate(std::span<const double> d, std::vector<double>& c) {
    const size_t n = d.size();
    c.resize(n + 2); // c[j] belongs to the integer j - 1
    // The end conditions determine the coefficients at the second and the last but one value. Between them,
    // c[j-1] + 4 c[j] + c[j+1] = 6 d: a tridiagonal system (Thomas' algorithm).
    c[2] = (8 * d[1] - d[0] - d[2]) / 6;
    c[n - 1] = (8 * d[n - 2] - d[n - 1] - d[n - 3]) / 6;
    std::vector<double> ratio(n + 2, 0.0);
    for (size_t j = 3; j + 1 < n; ++j) { // c[j], at the value d[j - 1]
        const double pivot = 4 - ratio[j - 1];
        ratio[j] = 1 / pivot;
        c[j] = (6 * d[j - 1] - c[j - 1] - (j + 2 == n ? c[n - 1] : 0)) / pivot;
    }
    for (size_t j = n - 3; j >= 3 && j + 2 < n; --j) c[j] -= ratio[j] * c[j + 1];
    c[1] = 6 * d[1] - 4 * c[2] - c[3];
    c[0] = 6 * d[0] - 4 * c[1] - c[2];
    c[n] = 6 * d[n - 2] - 4 * c[n - 1] - c[n - 2];
    c[n + 1] = 6 * d[n - 1] - 4 * c[n] - c[n - 1];
}

/// Replaces the values along an axis by the coefficients of a spline: `integrals`: of degree 2 with these integrals
/// between the integers, else of degree 3 with these values at the integers.
Lattice<double> filtered(const Lattice<double>& values, int axis, bool integrals) {
    Vec<int, 3> size = values.size();
    const int n = size[axis];
    size[axis] = n + 2;
    Lattice<double> coefficients(size);
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    parallelFor(static_cast<size_t>(size[u]), 4, [&](size_t begin, size_t end) {
        std::vector<double> line, c;
        for (int a = static_cast<int>(begin); a < static_cast<int>(end); ++a)
            for (int b = 0; b < size[v]; ++b) {
                Vec<int, 3> p;
                p[u] = a;
                p[v] = b;
                line.clear();
                double sum = 0;
                if (integrals) line.push_back(0);
                for (p[axis] = 0; p[axis] < n; ++p[axis]) line.push_back(integrals ? sum += values(p) : values(p));
                interpolate(line, c);
                for (p[axis] = 0; p[axis] < n + 2; ++p[axis]) {
                    const auto j = static_cast<size_t>(p[axis]);
                    // The derivative of the spline of the sums has the differences of its coefficients.
                    coefficients(p) = integrals ? c[j + 1] - c[j] : c[j];
                }
            }
    });
    return coefficients;
}

/// Returns the weights of the three coefficients around t in [0, 1] in the uniform quadratic B-spline, or their
/// derivatives.
std::array<double, 4> quadraticWeights(double t, int derivative) {
    switch (derivative) {
        case 0:
            return {0.5 * (1 - t) * (1 - t), 0.5 + t * (1 - t), 0.5 * t * t, 0};
        case 1:
            return {t - 1, 1 - 2 * t, t, 0};
        case 2:
            return {1, -2, 1, 0};
        default:
            return {};
    }
}

/// A coordinate that stops one edge beyond the lattice: x inside, and outside a C¹ function of x (its derivatives up to
/// the third).
Univariate<double> stopping(double x, int cells) {
    const double side = x < 0 ? 0 : cells, beyond = x - side, d = std::min(std::abs(beyond), 1.0);
    const double sign = beyond < 0 ? -1 : 1;
    if (!(d > 0)) return {x, 1, 0, 0}; // also NaN
    if (d == 1) return {side + sign * (2.0 / 3), 0, 0, 0};
    return {side + sign * (d - d * d * d / 3), 1 - d * d, -2 * sign * d, -2};
}

class EdgeSpline {
  public:
    EdgeSpline(const EdgePotentials& potentials, int axis, const LatticeFrame& frame, double factor)
        : mAxis(axis), mFrame(frame) {
        Lattice<double> c = potentials[axis];
        for (int k = 0; k < 3; ++k) {
            mCells[k] = c.size()[k] - (k == axis ? 0 : 1);
            c = filtered(c, k, k == axis);
        }
        // A fourth coefficient along the axis, of weight 0, so that all axes have four.
        const Vec<int, 3> size = c.size();
        mStride = {static_cast<size_t>(size[1]) * static_cast<size_t>(size[2]), static_cast<size_t>(size[2]), 1};
        mCoefficients = c.values();
        mCoefficients.resize(mCoefficients.size() + mStride[static_cast<size_t>(axis)], 0.0);
        for (double& value : mCoefficients) {
            value *= factor;
            mMaxAbs = std::max(mMaxAbs, std::abs(value));
        }
    }

    static constexpr std::string_view kNotSymbolic = "a velocity grid";

    /// The values of a spline lie between its coefficients.
    Interval range() const { return Interval::within(mMaxAbs); }

    template <int Order, class T>
    void evalBatch(const PointBatch& points, JetBatch<T, Order>& jets) const {
        for (int i = 0; i < points.size; ++i) {
            const Jet<double, 3, Order> jet = pullBack(at<Order>(points[i]), mFrame.toLattice);
            for (int k = 0; k < jet.kSize; ++k)
                jets.c[static_cast<size_t>(k)][static_cast<size_t>(i)] = static_cast<T>(jet.component(k));
        }
    }

  private:
    template <int Order>
    Jet<double, 3, Order> at(const Vec3d& position) const {
        SplineWeights<double, Order> w{};
        const double* corner = mCoefficients.data();
        for (int axis = 0; axis < 3; ++axis) {
            double x = mFrame.shift[axis];
            for (int k = 0; k < 3; ++k) x = mulAdd(mFrame.toLattice[axis][k], position[k], x);
            const auto a = static_cast<size_t>(axis);
            const bool in = x >= 0 && x <= mCells[axis];
            const auto s = in ? Univariate<double>{x, 1, 0, 0} : stopping(x, mCells[axis]);
            const int cell = std::isnan(x) ? 0 : std::clamp(static_cast<int>(s.value), 0, mCells[axis] - 1);
            const double t = s.value - cell;
            for (int d = 0; d <= Order; ++d)
                w[a][static_cast<size_t>(d)] = axis == mAxis ? quadraticWeights(t, d) : cubicBSplineWeights(t, d);
            if constexpr (Order > 0)
                if (!in) chain<Order>(w[a], s);
            corner += static_cast<size_t>(cell) * mStride[a];
        }
        return contractedSpline<Order>(w, [&](size_t i, size_t j) {
            const double* row = corner + i * mStride[0] + j * mStride[1];
            return std::array{row[0], row[1], row[2], row[3]};
        });
    }

    /// Turns derivatives with respect to s into those with respect to its argument.
    template <int Order>
    static void chain(std::array<std::array<double, 4>, size_t{Order + 1}>& w, const Univariate<double>& s) {
        for (size_t k = 0; k < 4; ++k) {
            const double first = w[1][k];
            w[1][k] = first * s.first;
            if constexpr (Order >= 2) {
                const double second = w[2][k];
                w[2][k] = second * s.first * s.first + first * s.second;
                if constexpr (Order >= 3)
                    w[3][k] = w[3][k] * s.first * s.first * s.first + 3 * second * s.first * s.second + first * s.third;
            }
        }
    }

    int mAxis;
    LatticeFrame mFrame;
    Vec<int, 3> mCells;
    std::array<size_t, 3> mStride;
    std::vector<double> mCoefficients;
    double mMaxAbs = 0;
};

} // namespace

ScalarField edgeSpline(const EdgePotentials& potentials, int axis, const LatticeFrame& frame, double factor) {
    return ScalarField(EdgeSpline(potentials, axis, frame, factor));
}

} // namespace curlew
