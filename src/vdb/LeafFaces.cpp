// SPDX-License-Identifier: Apache-2.0
#include "LeafFaces.h"

#include "curlew/base/Parallel.h"
#include "curlew/math/Dispatch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>
#include <utility>

namespace curlew {

namespace {

using openvdb::Coord;

/// Finds the leaves near a triangle: those of a few cubes of leaves around it, then the nearest eighths of these.
class LeavesNear {
  public:
    explicit LeavesNear(double reach) : mReach(reach) {}

    /// Calls use(leaf, distance) with the first voxel of each leaf, divided by 8, and the distance of its centre.
    template <class Use>
    void find(const std::array<Vec3d, 3>& corner, const Use& use) {
        constexpr double kRounding = 1e-6;
        Coord first, last;
        for (int axis = 0; axis < 3; ++axis) {
            const auto [least, most] = std::minmax({corner[0][axis], corner[1][axis], corner[2][axis]});
            first[axis] = static_cast<int>(std::ceil(least - mReach - kRounding)) >> 3;
            last[axis] = static_cast<int>(std::floor(most + mReach + kRounding)) >> 3;
        }
        const auto span = [&](int axis, int level) { return (last[axis] >> level) - (first[axis] >> level); };
        int level = 0;
        while (std::max({span(0, level), span(1, level), span(2, level)}) > 1) ++level;
        mCubes.clear();
        for (int i = first[0] >> level; i <= last[0] >> level; ++i)
            for (int j = first[1] >> level; j <= last[1] >> level; ++j)
                for (int k = first[2] >> level; k <= last[2] >> level; ++k) mCubes.emplace_back(i, j, k);
        const PreparedTriangle<double> triangle(corner[0], corner[1], corner[2]);
        for (; level > 0; --level) {
            mEighths.clear();
            forNear(triangle, level, [&](const Coord& cube, double) {
                for (int n = 0; n < 8; ++n) mEighths.push_back((cube << 1) + Coord(n >> 2, (n >> 1) & 1, n & 1));
            });
            mCubes.swap(mEighths);
        }
        forNear(triangle, 0, use);
    }

  private:
    /// Calls use(cube, distance) with those of mCubes, of 2^level leaves along an edge, that may have voxels within
    /// reach.
    template <class Use>
    void forNear(const PreparedTriangle<double>& triangle, int level, const Use& use) {
        const double edge = std::ldexp(8, level), half = (edge - 1) / 2; // between the first and the last voxel
        const double most = mReach + half * std::numbers::sqrt3;
        std::array<double, kBatch> squares;
        for (size_t begin = 0; begin < mCubes.size(); begin += kBatch) {
            PointBatch centers;
            for (size_t n = begin; n < mCubes.size() && !centers.full(); ++n) {
                Vec3d center;
                for (int axis = 0; axis < 3; ++axis) center[axis] = mCubes[n][axis] * edge + half;
                centers.push(center);
            }
            runKernel<TriangleFromKernel, double>(triangle, std::as_const(centers), squares);
            for (size_t n = 0; n < static_cast<size_t>(centers.size); ++n)
                if (squares[n] <= most * most) use(mCubes[begin + n], std::sqrt(squares[n]));
        }
    }

    double mReach;
    std::vector<Coord> mCubes, mEighths;
};

} // namespace

LeafFaces::LeafFaces(const IndexMesh& mesh, double reach, const Monitor& monitor) : mMesh(mesh), mReach(reach) {
    constexpr size_t kChunk = 256; // small, since what a chunk finds takes three times the memory of what it keeps
    mFaces.resize((mesh.polygonCount() + kChunk - 1) / kChunk);
    std::vector<std::vector<Run>> runs(mFaces.size());
    parallelFor(
        mesh.polygonCount(), kChunk,
        [&](size_t begin, size_t end) {
            const size_t chunk = begin / kChunk;
            struct Found {
                Coord leaf;
                Near near;
            };
            std::vector<Found> found;
            LeavesNear leaves(reach);
            for (size_t face = begin; face < end; ++face)
                mesh.forTriangles(face, [&](const std::array<Vec3d, 3>& corner, const auto&) {
                    leaves.find(corner, [&](const Coord& leaf, double distance) {
                        found.push_back({leaf, {static_cast<uint32_t>(face), static_cast<float>(distance)}});
                    });
                });
            std::sort(found.begin(), found.end(), [](const Found& a, const Found& b) {
                return std::tie(a.leaf, a.near.face, a.near.distance) < std::tie(b.leaf, b.near.face, b.near.distance);
            });
            for (const auto& [leaf, near] : found) {
                const auto size = static_cast<uint32_t>(mFaces[chunk].size());
                const bool first = runs[chunk].empty() || runs[chunk].back().leaf != leaf;
                if (first) runs[chunk].push_back({leaf, static_cast<uint32_t>(chunk), size, size});
                if (!first && mFaces[chunk].back().face == near.face) continue; // the other half of a quad
                mFaces[chunk].push_back(near);
                ++runs[chunk].back().end;
            }
        },
        monitor);
    for (std::vector<Run>& some : runs) mRuns.insert(mRuns.end(), some.begin(), some.end());
    std::sort(mRuns.begin(), mRuns.end(),
              [](const Run& a, const Run& b) { return std::tie(a.leaf, a.chunk) < std::tie(b.leaf, b.chunk); });
    for (size_t n = 0; n < mRuns.size(); ++n)
        if (n == 0 || mRuns[n].leaf != mRuns[n - 1].leaf) mFirst.push_back(n);
    mFirst.push_back(mRuns.size());
}

void LeafFaces::forTriangles(size_t leaf, const std::function<void(std::span<const LeafTriangle>)>& use) const {
    const Coord start = origin(leaf);
    const Vec3d shift{{double(start[0]), double(start[1]), double(start[2])}};
    const auto forFaces = [&](const auto& visit) {
        for (size_t n = mFirst[leaf]; n < mFirst[leaf + 1]; ++n)
            for (uint32_t k = mRuns[n].begin; k < mRuns[n].end; ++k) visit(mFaces[mRuns[n].chunk][k]);
    };
    Near nearest{0, std::numeric_limits<float>::infinity()};
    forFaces([&](const Near& near) {
        if (near.distance < nearest.distance) nearest = near;
    });
    constexpr double kAcross = 7 * std::numbers::sqrt3;                            // from the first voxel to the last
    const double most = 1.001 * (static_cast<double>(nearest.distance) + kAcross); // distances are rounded to float
    constexpr size_t kSome = 64;                                                   // fit into the L1 cache
    std::vector<LeafTriangle> triangles;
    triangles.reserve(kSome + 1);
    const auto add = [&](size_t face) {
        if (triangles.size() >= kSome) {
            use(triangles);
            triangles.clear();
        }
        mMesh.forTriangles(face, [&](const std::array<Vec3d, 3>& corner, const auto&) {
            const Vec3d a = corner[0] - shift, b = corner[1] - shift, c = corner[2] - shift;
            LeafTriangle one{.triangle = {a, b, c}, .face = static_cast<double>(face)};
            for (int axis = 0; axis < 3; ++axis) {
                one.least[axis] = std::min(std::min(a[axis], b[axis]), c[axis]);
                one.most[axis] = std::max(std::max(a[axis], b[axis]), c[axis]);
                const double first = std::ceil(std::max(one.least[axis] - mReach, 0.0));
                const double last = std::floor(std::min(one.most[axis] + mReach, 7.0));
                if (first > last) return;
                one.first[static_cast<size_t>(axis)] = static_cast<int>(first);
                one.last[static_cast<size_t>(axis)] = static_cast<int>(last);
            }
            triangles.push_back(one);
        });
    };
    add(nearest.face);
    forFaces([&](const Near& near) {
        if (near.face != nearest.face && static_cast<double>(near.distance) <= most) add(near.face);
    });
    use(triangles);
}

} // namespace curlew
