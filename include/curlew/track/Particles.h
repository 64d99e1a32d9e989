#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace curlew {

/// Points that move, as a structure of arrays. Every array has size() entries, except that v, f and g are empty until
/// something has set them.
struct Particles {
    std::vector<double> x, y, z;    ///< Position, world units.
    std::vector<float> vx, vy, vz;  ///< Velocity at that position, world units per second.
    std::vector<int64_t> id;        ///< Stable for the life of a particle.
    std::vector<double> f, g;       ///< The track: the values of the flow's potentials that the particle keeps.
    std::vector<uint8_t> converged; ///< 0 where some step could not be brought back onto the track; empty: all are.

    size_t size() const { return x.size(); }
    bool hasVelocity() const { return !vx.empty(); }
    bool hasTrack() const { return !f.empty(); }

    /// Memory of one particle with all its arrays, in bytes.
    static constexpr size_t kBytes = 3 * sizeof(double) + 3 * sizeof(float) + sizeof(int64_t) + 2 * sizeof(double) + 1;
};

} // namespace curlew
