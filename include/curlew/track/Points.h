// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Vec.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace curlew {

/// Moving points as a structure of arrays. Position and id always have size() entries. The other arrays have as many,
/// or are empty until something sets them.
struct Points {
    std::vector<double> x, y, z;    ///< Position, world units.
    std::vector<float> vx, vy, vz;  ///< Velocity at that position, world units per second.
    std::vector<int64_t> id;        ///< Stable for the life of a particle.
    std::vector<double> f, g;       ///< The track: the potentials' values that the particle keeps.
    std::vector<uint8_t> converged; ///< 0 if some step could not return to the track; empty: all converged.
    std::vector<float> age;         ///< Seconds since the particle's birth.
    std::vector<float> life;        ///< The age at which the particle dies, seconds; infinite or empty: never.
    /// Visibility, 0 to 1, a factor for opacity or size; empty: fully visible (Loop.h).
    std::vector<float> fade;

    /// Returns particles at these positions, with ids 0 … size-1.
    static Points at(const std::vector<Vec3d>& positions);

    size_t size() const { return x.size(); }
    Vec3d position(size_t k) const { return {{x[k], y[k], z[k]}}; }
    void setPosition(size_t k, const Vec3d& p) { x[k] = p[0], y[k] = p[1], z[k] = p[2]; }
    void setVelocity(size_t k, const Vec3d& v) {
        vx[k] = static_cast<float>(v[0]), vy[k] = static_cast<float>(v[1]), vz[k] = static_cast<float>(v[2]);
    }
    /// World units per second; 0 if there are no velocities.
    double maxSpeed() const;
    bool hasVelocity() const { return !vx.empty(); }
    bool hasTrack() const { return !f.empty(); }
    bool hasAge() const { return !age.empty(); }
    bool hasLife() const { return !life.empty(); }
    bool hasFade() const { return !fade.empty(); }

    /// Removes the particles whose flag is not 0; the others keep their order. Throws ValueError unless there is one
    /// flag per particle.
    void remove(const std::vector<uint8_t>& flags);
    /// Appends `more`. An array that only one of the two has is filled in for the other: velocity 0, age 0, infinite
    /// life, fade 1. Tracks are kept only if both have them.
    void append(const Points& more);
    /// Adds `duration` seconds to all ages and removes the particles that are then older than their life. Particles
    /// without an age do not change. Returns the number of removed particles.
    size_t grow(double duration);

    /// Memory per particle that has only a position and an id, bytes.
    static constexpr size_t kPlainBytes = 3 * sizeof(double) + sizeof(int64_t);
    /// Memory per particle with all its arrays, bytes.
    static constexpr size_t kBytes =
        3 * sizeof(double) + 3 * sizeof(float) + sizeof(int64_t) + 2 * sizeof(double) + 1 + 3 * sizeof(float);
};

/// Calls `visit` with each array of the particles, in declaration order.
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
