// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/SnapToLevelSet.h"

#include "curlew/base/Memory.h"
#include "curlew/base/Require.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/track/Neighbours.h"
#include "curlew/vdb/LevelSetMesh.h"

#include <array>
#include <limits>

namespace curlew {

namespace {

constexpr int kSteps = 6; ///< Steps along the surface, each with one onto it.

using Jet2 = Jet<double, 3, 2>;

double determinant(const Vec3d& a, const Vec3d& b, const Vec3d& c) { return dot(a, cross(b, c)); }

/// Moves `here` towards the surface point closest to `point`: one step of Newton's method on half the squared distance
/// to the point. Its second derivative along the surface is 1 + D times the curvature of the surface, where D is the
/// point's distance. Steps are at most two voxels long.
Vec3d nearer(const Jet2& jet, const Vec3d& here, const Vec3d& point, double voxel) {
    const double slope = length(jet.gradient);
    if (!(slope > 0.1)) return here;
    const Vec3d normal = jet.gradient * (1 / slope), surface = here - normal * (jet.value / slope),
                offset = point - surface;
    const double distance = dot(offset, normal);
    const Vec3d along = offset - normal * distance;
    std::array<Vec3d, 3> columns; // columns of a symmetric matrix
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) columns[static_cast<size_t>(i)][j] = distance / slope * jet.hessian(i, j);
        columns[static_cast<size_t>(i)][i] += 1;
    }
    const auto& [a, b, c] = columns;
    const double size = determinant(a, b, c);
    Vec3d step{{determinant(along, b, c) / size, determinant(a, along, c) / size, determinant(a, b, along) / size}};
    step = step - normal * dot(step, normal);
    double longest = 2 * voxel;
    if (!(dot(step, along) > 0) || !(length(step) <= length(along))) { // beyond the medial axis, or at an edge
        step = along;
        longest = voxel / 4;
    }
    const double stepLength = length(step);
    return surface + (stepLength > longest ? step * (longest / stepLength) : step);
}

/// Returns, for each particle, the nearest of the points that OpenVDB's volumeToMesh puts on the surface, one in each
/// cell that the surface crosses.
std::vector<Vec3d> nearestOfMesh(const LevelSet& levelSet, const Points& particles, const Monitor& monitor) {
    std::vector<Vec3d> surface;
    for (const openvdb::Vec3s& p : levelSetToMesh(levelSet).points)
        surface.push_back({{double(p[0]), double(p[1]), double(p[2])}});
    const Monitor quiet = monitor.quiet();
    const Neighbours neighbours(surface, quiet);
    std::vector<Vec3d> positions;
    for (size_t k = 0; k < particles.size(); ++k) positions.push_back(particles.position(k));
    const std::vector<uint32_t> nearest = neighbours.nearest(positions, quiet);
    for (size_t k = 0; k < nearest.size(); ++k) positions[k] = surface[nearest[k]];
    return positions;
}

std::vector<double> distancesOf(const ScalarField& distance, const Points& particles) {
    std::vector<double> distances(particles.size());
    forEachBatch(particles, [&](const PointBatch& points, size_t begin) {
        JetBatch<double, 0> jets;
        distance.eval(points, jets);
        for (int i = 0; i < points.size; ++i) distances[begin + static_cast<size_t>(i)] = std::abs(jets[i].value);
    });
    return distances;
}

/// Snaps the particles that are not on the surface yet once more, from these positions beside it: the steps along the
/// surface may have led them over a crease.
void startAgain(const ScalarField& distance, const std::vector<Vec3d>& beside, double voxel, double tolerance,
                Points& particles, std::vector<double>& left, const Monitor& monitor) {
    std::vector<size_t> which;
    for (size_t k = 0; k < left.size(); ++k)
        if (!(left[k] <= tolerance)) which.push_back(k);
    if (which.empty()) return;
    std::vector<Vec3d> starts;
    for (const size_t k : which) starts.push_back(beside[k]);
    Points again = Points::at(starts);
    snap(distance, 0, again, voxel, tolerance, monitor.quiet());
    const std::vector<double> leftNow = distancesOf(distance, again);
    for (size_t n = 0; n < which.size(); ++n) {
        particles.setPosition(which[n], again.position(n));
        left[which[n]] = leftNow[n];
    }
}

} // namespace

SnapResult snapToLevelSet(const LevelSet& levelSet, Points& particles, double reach, double tolerance,
                          const Monitor& monitor) {
    requirePositive(reach, "the reach");
    requirePositive(tolerance, "the tolerance");
    const double voxel = levelSet.voxelSize();
    constexpr double kBytesPerPoint = Points::kPlainBytes + sizeof(Vec3d) + sizeof(uint32_t) + 2 * sizeof(double);
    requireMemory(kBytesPerPoint * static_cast<double>(particles.size()),
                  fmt::format("the nearest surface of {} points", particles.size()), "use fewer points");
    const Sdf sdf = sdfOf(levelSet);
    Points there = particles;
    const std::vector<Vec3d> beside = nearestOfMesh(levelSet, particles, monitor);
    for (size_t k = 0; k < beside.size(); ++k) there.setPosition(k, beside[k]);
    forEachBatch(
        there,
        [&](const PointBatch& start, size_t begin) {
            PointBatch points = start;
            JetBatch<double, 2> jets;
            std::array<double, kBatch> best;
            best.fill(std::numeric_limits<double>::max());
            for (int step = 0; step <= kSteps; ++step) {
                sdf.distance.eval(points, jets);
                for (int i = 0; i < points.size; ++i) {
                    const size_t k = begin + static_cast<size_t>(i);
                    const Vec3d here = points[i], wanted = particles.position(k);
                    const double away = length(here - wanted) + std::abs(jets[i].value);
                    if (away < best[static_cast<size_t>(i)]) {
                        best[static_cast<size_t>(i)] = away;
                        there.setPosition(k, here);
                    }
                    points.set(i, nearer(jets[i], here, wanted, voxel));
                }
            }
        },
        monitor);
    snap(sdf.distance, 0, there, voxel, tolerance, monitor);
    std::vector<double> left = distancesOf(sdf.distance, there);
    startAgain(sdf.distance, beside, voxel, tolerance, there, left, monitor);
    SnapResult result{.points = particles.size()};
    for (size_t k = 0; k < particles.size(); ++k) {
        const Vec3d from = particles.position(k), to = there.position(k);
        if (!(left[k] <= tolerance) || !(length(to - from) <= reach)) {
            ++result.missed;
            continue;
        }
        result.moved += length(to - from);
        particles.setPosition(k, to);
    }
    for (auto* array : {&particles.vx, &particles.vy, &particles.vz}) array->clear();
    for (auto* array : {&particles.f, &particles.g}) array->clear();
    particles.converged.clear();
    if (result.points > result.missed) result.moved /= static_cast<double>(result.points - result.missed);
    return result;
}

} // namespace curlew
