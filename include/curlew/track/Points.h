// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace curlew {

/// Points that move, as a structure of arrays. Every array has size() entries, except those after the position and the
/// id, which are empty until something has set them.
struct Points {
    std::vector<double> x, y, z;    ///< Position, world units.
    std::vector<float> vx, vy, vz;  ///< Velocity at that position, world units per second.
    std::vector<int64_t> id;        ///< Stable for the life of a particle.
    std::vector<double> f, g;       ///< The track: the values of the flow's potentials that the particle keeps.
    std::vector<uint8_t> converged; ///< 0 where some step could not be brought back onto the track; empty: all are.
    std::vector<float> age;         ///< Seconds since the particle's birth.
    std::vector<float> life;        ///< The age at which it dies, seconds; infinite or empty: never.
    /// How much of it is seen, 0 to 1, to be multiplied with its opacity or size; empty: all of it (Loop.h).
    std::vector<float> fade;

    /// Particles at these positions, with ids 0 … size-1.
    static Points at(const std::vector<Vec3d>& positions);

    size_t size() const { return x.size(); }
    Vec3d position(size_t k) const { return {{x[k], y[k], z[k]}}; }
    void setPosition(size_t k, const Vec3d& p) { x[k] = p[0], y[k] = p[1], z[k] = p[2]; }
    void setVelocity(size_t k, const Vec3d& v) {
        vx[k] = static_cast<float>(v[0]), vy[k] = static_cast<float>(v[1]), vz[k] = static_cast<float>(v[2]);
    }
    /// World units per second; 0 without velocities.
    double maxSpeed() const;
    bool hasVelocity() const { return !vx.empty(); }
    bool hasTrack() const { return !f.empty(); }
    bool hasAge() const { return !age.empty(); }
    bool hasLife() const { return !life.empty(); }
    bool hasFade() const { return !fade.empty(); }

    /// Removes the particles whose flag is not 0; the others stay in their order. ValueError where there is not one
    /// flag for each particle.
    void remove(const std::vector<uint8_t>& flags);
    /// Puts `more` after the particles that there are. What only one of the two has is filled up for the other: no
    /// velocity, age 0, an infinite life, fade 1; but of tracks either all have one or none keeps it.
    void append(const Points& more);
    /// Time goes by: all are `duration` seconds older, and those that are now older than their life are removed.
    /// Particles without an age do not change. Returns how many were removed.
    size_t grow(double duration);

    /// Memory of one particle with all its arrays, in bytes.
    static constexpr size_t kBytes =
        3 * sizeof(double) + 3 * sizeof(float) + sizeof(int64_t) + 2 * sizeof(double) + 1 + 3 * sizeof(float);
};

/// Calls `visit` with each array of the particles, in the order in which they are declared.
template <class AnyPoints, class Visit>
void forEachArray(AnyPoints& p, const Visit& visit) {
    visit(p.x), visit(p.y), visit(p.z);
    visit(p.vx), visit(p.vy), visit(p.vz);
    visit(p.id);
    visit(p.f), visit(p.g);
    visit(p.converged);
    visit(p.age), visit(p.life);
    visit(p.fade);
}

} // namespace curlew
