// SPDX-License-Identifier: Apache-2.0
#include "curlew/track/Points.h"

#include "curlew/base/Error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace curlew {

namespace {

/// Appends `more` to the `size` values of an array. If one of the two is empty, its part is filled with `fill`.
template <class T>
void appendArray(std::vector<T>& values, size_t size, const std::vector<T>& more, size_t moreSize, T fill) {
    if (values.empty() && more.empty()) return;
    values.resize(size, fill);
    values.insert(values.end(), more.begin(), more.end());
    values.resize(size + moreSize, fill);
}

} // namespace

Points Points::at(const std::vector<Vec3d>& positions) {
    Points p;
    for (auto* array : {&p.x, &p.y, &p.z}) array->resize(positions.size());
    p.id.resize(positions.size());
    for (size_t k = 0; k < positions.size(); ++k) {
        p.setPosition(k, positions[k]);
        p.id[k] = static_cast<int64_t>(k);
    }
    return p;
}

double Points::maxSpeed() const {
    double squared = 0;
    for (size_t k = 0; k < vx.size(); ++k) {
        const auto a = static_cast<double>(vx[k]), b = static_cast<double>(vy[k]), c = static_cast<double>(vz[k]);
        squared = std::max(squared, a * a + b * b + c * c);
    }
    return std::sqrt(squared);
}

void Points::remove(const std::vector<uint8_t>& flags) {
    if (flags.size() != size())
        throw ValueError(fmt::format("{} flags for {} particles; give one for each", flags.size(), size()));
    forEachArray(*this, [&](auto& values) {
        if (values.empty()) return;
        size_t kept = 0;
        for (size_t k = 0; k < flags.size(); ++k)
            if (flags[k] == 0) values[kept++] = values[k];
        values.resize(kept);
    });
}

void Points::append(const Points& more) {
    const size_t size = this->size(), moreSize = more.size();
    if (moreSize == 0) return;
    const bool tracks = (size == 0 || hasTrack()) && more.hasTrack();
    const auto add = [&](auto& values, const auto& others, auto fill) {
        appendArray(values, size, others, moreSize, fill);
    };
    if (tracks) {
        add(f, more.f, 0.0);
        add(g, more.g, 0.0);
    } else {
        f.clear();
        g.clear();
    }
    add(vx, more.vx, 0.0F), add(vy, more.vy, 0.0F), add(vz, more.vz, 0.0F);
    add(converged, more.converged, uint8_t{1});
    add(age, more.age, 0.0F);
    add(life, more.life, std::numeric_limits<float>::infinity());
    add(fade, more.fade, 1.0F);
    add(id, more.id, int64_t{0});
    add(x, more.x, 0.0), add(y, more.y, 0.0), add(z, more.z, 0.0);
}

size_t Points::grow(double duration) {
    if (!hasAge()) return 0;
    for (float& a : age) a = static_cast<float>(static_cast<double>(a) + duration);
    if (!hasLife()) return 0;
    std::vector<uint8_t> dead(size());
    size_t count = 0;
    for (size_t k = 0; k < size(); ++k) {
        dead[k] = static_cast<uint8_t>(age[k] > life[k]);
        count += dead[k];
    }
    if (count > 0) remove(dead);
    return count;
}

} // namespace curlew
