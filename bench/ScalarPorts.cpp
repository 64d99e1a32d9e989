// SPDX-License-Identifier: Apache-2.0
#include "ScalarPorts.h"

#include <cmath>

namespace curlew::ports {

namespace {

constexpr int kHashes = 289;

struct Vector {
    float x, y, z;
};

float modulo289(float k) { return k - std::floor(k * (1.0F / kHashes)) * kHashes; }
float permute(float k) {
    const float rest = modulo289(k);
    return modulo289((rest * 34 + 10) * rest); // below 2^24: exact
}

/// Returns a point of a spherical Fibonacci spiral (steps 8 and 9 of the paper).
template <class T>
Vector spiral(T hash) {
    const T theta = hash * T(3.883222077), z = T(0.996539792) - T(0.006920415) * hash;
    const T radius = std::sqrt(1 - z * z);
    return {static_cast<float>(std::cos(theta) * radius), static_cast<float>(std::sin(theta) * radius),
            static_cast<float>(z)};
}

struct Table {
    Vector gradients[kHashes];
    Table() {
        for (int hash = 0; hash < kHashes; ++hash) gradients[hash] = spiral<double>(hash);
    }
};
const Table kTable;

template <Gradients G>
Vector gradientOf(float hash) {
    if constexpr (G == Gradients::computed)
        return spiral<float>(hash);
    else
        return kTable.gradients[static_cast<int>(hash)];
}

/// Adds the contribution of the corner with simplex coordinates u to the sum at the position p.
template <Gradients G>
void addCorner(const Vector& p, const Vector& u, Sample& sum) {
    const Vector corner{0.5F * (u.y + u.z - u.x), 0.5F * (u.x + u.z - u.y), 0.5F * (u.x + u.y - u.z)};
    const Vector d{p.x - corner.x, p.y - corner.y, p.z - corner.z};
    const Vector g = gradientOf<G>(permute(permute(permute(u.z) + u.y) + u.x));
    const float rest = 0.5F - (d.x * d.x + d.y * d.y + d.z * d.z), w = rest > 0 ? rest : 0;
    const float ramp = g.x * d.x + g.y * d.y + g.z * d.z, w3 = w * w * w, slope = -6 * w * w * ramp;
    sum.value += w3 * ramp;
    sum.gradient[0] += w3 * g.x + slope * d.x;
    sum.gradient[1] += w3 * g.y + slope * d.y;
    sum.gradient[2] += w3 * g.z + slope * d.z;
}

float step(float edge, float x) { return x >= edge ? 1.0F : 0.0F; }

} // namespace

template <Gradients G>
Sample noise(const float (&position)[3]) {
    const Vector p{position[0], position[1], position[2]};
    const Vector u{p.y + p.z, p.x + p.z, p.x + p.y};
    const Vector base{std::floor(u.x), std::floor(u.y), std::floor(u.z)};
    const Vector r{u.x - base.x, u.y - base.y, u.z - base.z};
    // The order of the fractional parts determines the corners between base and base + (1, 1, 1) (Table 1).
    const float xy = step(r.x, r.y), xz = step(r.x, r.z), yz = step(r.y, r.z); // 1: the later axis goes first
    const Vector wins{2 - xy - xz, xy + 1 - yz, xz + yz};                      // 2 for the first axis, 0 for the last
    const Vector first{step(2, wins.x), step(2, wins.y), step(2, wins.z)};
    const Vector second{step(1, wins.x), step(1, wins.y), step(1, wins.z)};
    Sample sum{};
    addCorner<G>(p, base, sum);
    addCorner<G>(p, {base.x + first.x, base.y + first.y, base.z + first.z}, sum);
    addCorner<G>(p, {base.x + second.x, base.y + second.y, base.z + second.z}, sum);
    addCorner<G>(p, {base.x + 1, base.y + 1, base.z + 1}, sum);
    constexpr float kScale = 39.5F;
    return {kScale * sum.value, {kScale * sum.gradient[0], kScale * sum.gradient[1], kScale * sum.gradient[2]}};
}

template <Gradients G>
void velocity(const float (&position)[3], float (&velocity)[3]) {
    const float elsewhere[3] = {position[0] + kSecond[0], position[1] + kSecond[1], position[2] + kSecond[2]};
    const Sample f = noise<G>(position), g = noise<G>(elsewhere);
    const float *a = f.gradient, *b = g.gradient;
    velocity[0] = a[1] * b[2] - a[2] * b[1];
    velocity[1] = a[2] * b[0] - a[0] * b[2];
    velocity[2] = a[0] * b[1] - a[1] * b[0];
}

template Sample noise<Gradients::computed>(const float (&)[3]);
template Sample noise<Gradients::table>(const float (&)[3]);
template void velocity<Gradients::computed>(const float (&)[3], float (&)[3]);
template void velocity<Gradients::table>(const float (&)[3], float (&)[3]);

} // namespace curlew::ports
