// SPDX-License-Identifier: Apache-2.0
#include "curlew/flow/RailFlow.h"

#include "curlew/base/Error.h"
#include "curlew/field/Algebra.h"

#include <cmath>

namespace curlew {

namespace {

/// The integral over u of (1 - (u² + v²) / R²)³, which is constant beyond R. So ∇A × ∇v is that profile times the
/// tangent of the rail. With m = 1 - v² / R², the integral is m³u - m²u³/R² + (3/5) m u⁵/R⁴ - u⁷ / (7 R⁶).
class IntegratedProfile {
  public:
    IntegratedProfile(RailPointer rail, double radius, double speed)
        : mRail(std::move(rail)), mRadius(radius), mSpeed(speed) {}

    template <int Order, class T>
    void evalBatch(const PointBatch& points, JetBatch<T, Order>& jets) const {
        for (int i = 0; i < points.size; ++i) {
            const auto near = mRail->nearest(points[i]);
            const auto jet = integral(mRail->template across<Order>(near.arc, points[i])) * (mSpeed * mRadius);
            for (int k = 0; k < jet.kSize; ++k)
                jets.c[static_cast<size_t>(k)][static_cast<size_t>(i)] = static_cast<T>(jet.component(k));
        }
    }

  private:
    /// For R = 1.
    template <class J>
    J integral(const std::array<J, 2>& across) const {
        const J u = across[0] * (1 / mRadius), v = across[1] * (1 / mRadius), m = J(1) - v * v;
        if (!(m.value > 0)) return J(0);
        if (u.value * u.value < m.value) {
            const J s = u * u;
            return u * (m * m * m - m * m * s + m * s * s * 0.6 - s * s * s * (1.0 / 7));
        }
        const J edge = m * m * m * sqrt(m) * (16.0 / 35);
        return u.value > 0 ? edge : -edge;
    }

    RailPointer mRail;
    double mRadius, mSpeed;
};

} // namespace

Flow railFlow(const std::vector<RailPointer>& rails, const RailFlowOptions& o) {
    if (!std::isfinite(o.speed) || o.speed == 0) throw ValueError("the speed of a rail must be finite and not zero");
    const Sdf tubes = tubeSdf(rails, o.radius);
    Domain domain{.box = rails.front()->bounds(), .wall = Wall{.sdf = tubes, .side = Side::inside, .width = o.radius}};
    for (const RailPointer& rail : rails)
        for (int k = 0; k < 3; ++k) {
            domain.box.lower[k] = std::min(domain.box.lower[k], rail->bounds().lower[k]);
            domain.box.upper[k] = std::max(domain.box.upper[k], rail->bounds().upper[k]);
        }
    domain.box = domain.box.padded(o.radius);
    if (o.profile == RailProfile::plug) {
        requireSeparate(rails, o.radius);
        return Flow(o.speed * acrossRails(rails, 0), acrossRails(rails, 1), domain);
    }
    std::vector<Flow::Potentials> terms;
    for (const RailPointer& rail : rails) {
        requireSeparate({rail}, o.radius);
        terms.push_back({ScalarField(IntegratedProfile(rail, o.radius, o.speed)), acrossRails({rail}, 1)});
    }
    return Flow(std::move(terms), domain);
}

} // namespace curlew
