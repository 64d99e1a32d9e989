// SPDX-License-Identifier: Apache-2.0
#include "BackwardMap.h"

#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>

#ifdef __FMA__
#include <immintrin.h>
#endif

namespace curlew {

namespace {

using openvdb::Coord;

constexpr int kNodes = 6;       ///< Nodes of the interpolation along each axis: at -2 … 3 from the voxel below.
constexpr int kNodesBefore = 2; ///< Number of nodes before that voxel.

using Node = BackwardMap::Node;

/// Weights of the nodes: three for the components of the origin, and one for φ.
using Weights = std::array<Node, kNodes>;

/// Lagrange polynomials at t: of degree 5 for origins; of degree 3, on the nodes -1 … 2, for φ. Also their derivatives,
/// and the difference degree 5 minus degree 3.
struct Lagrange {
    Weights value{}, slope{}, difference{};

    explicit Lagrange(double t) {
        constexpr std::array<double, kNodes> kScale{-1.0 / 120, 1.0 / 24, -1.0 / 12, 1.0 / 12, -1.0 / 24, 1.0 / 120};
        const std::array<double, kNodes> cubic{0,
                                               -t * (t - 1) * (t - 2) / 6,
                                               (t + 1) * (t - 1) * (t - 2) / 2,
                                               -(t + 1) * t * (t - 2) / 2,
                                               (t + 1) * t * (t - 1) / 6,
                                               0},
            cubicSlope{0,
                       -(3 * t * t - 6 * t + 2) / 6,
                       (3 * t * t - 4 * t - 1) / 2,
                       -(3 * t * t - 2 * t - 2) / 2,
                       (3 * t * t - 1) / 6,
                       0};
        for (size_t k = 0; k < kNodes; ++k) {
            double product = kScale[k], derivative = 0;
            for (size_t m = 0; m < kNodes; ++m) {
                if (m == k) continue;
                const double factor = t - (static_cast<double>(m) - kNodesBefore);
                derivative = derivative * factor + product;
                product *= factor;
            }
            const double difference5 = product - cubic[k];
            value[k] = Node{product, product, product, cubic[k]};
            slope[k] = Node{derivative, derivative, derivative, cubicSlope[k]};
            difference[k] = Node{difference5, difference5, difference5, difference5};
        }
    }
};

Vec3d originOf(const Node& node) { return {{node[0], node[1], node[2]}}; }

/// Estimates the error of φ₀ at an origin that is off by `difference`.
double errorOf(const Vec3d& gradient, const Node& difference) {
    const Vec3d off = originOf(difference);
    constexpr double kFlat = 0.5; // below the slope of a distance: outside its band
    return length(gradient) < kFlat ? length(off) : std::abs(dot(gradient, off));
}

std::array<Coord, 8> cornersOf(const Coord& cell) {
    std::array<Coord, 8> corners;
    for (size_t n = 0; n < 8; ++n)
        corners[n] = cell.offsetBy(static_cast<int>(n & 1), static_cast<int>(n >> 1 & 1), static_cast<int>(n >> 2 & 1));
    return corners;
}

/// Returns the nodes that interpolation in these cells needs.
openvdb::MaskTree nodesOf(const std::vector<Coord>& cells) {
    openvdb::MaskTree nodes;
    {
        openvdb::tree::ValueAccessor<openvdb::MaskTree> mask(nodes);
        for (const Coord& cell : cells) mask.setValueOn(cell);
    }
    for (int axis = 0; axis < 3; ++axis) {
        const openvdb::MaskTree before = nodes;
        openvdb::tree::ValueAccessor<openvdb::MaskTree> mask(nodes);
        for (auto voxel = before.cbeginValueOn(); voxel; ++voxel) {
            Coord node = voxel.getCoord();
            node[axis] -= kNodesBefore;
            for (int k = 0; k < kNodes; ++k, ++node[axis]) mask.setValueOn(node);
        }
    }
    return nodes;
}

} // namespace

void BackwardMap::follow(const std::vector<openvdb::Vec3d>& seeds, const Trace& trace, const Monitor& monitor) {
    std::vector<Coord> cells;
    for (const auto& seed : seeds)
        if (seed.lengthSqr() < 0x1p60) cells.push_back(Coord::floor(seed)); // skips NaN and huge coordinates
    while (!cells.empty()) {
        openvdb::MaskTree wanted = nodesOf(cells);
        wanted.topologyDifference(mKnown);
        const auto count = static_cast<size_t>(wanted.activeVoxelCount());
        const size_t begin = mVoxels.size();
        if (count == 0) return;
        if (begin + count > INT32_MAX)
            throw ResourceError(fmt::format("the surface has grown to {} voxels; choose larger voxels", begin + count));
        constexpr double kBytesEach = 160; // includes what the distances will need
        requireMemory(static_cast<double>(count) * kBytesEach,
                      fmt::format("the surface, which has grown to {} voxels,", begin + count),
                      "follow it for a shorter time, or choose larger voxels");
        std::vector<Coord> voxels;
        voxels.reserve(count);
        for (auto voxel = wanted.cbeginValueOn(); voxel; ++voxel) voxels.push_back(voxel.getCoord());
        const std::vector<Vec3d> origins = trace(voxels);
        mKnown.topologyUnion(wanted);
        for (size_t n = 0; n < count; ++n) mIndex.setValueOn(voxels[n], static_cast<int32_t>(begin + n));
        mVoxels.insert(mVoxels.end(), voxels.begin(), voxels.end());
        for (const Vec3d& x : origins) mNodes.push_back(Node{x[0], x[1], x[2], 0});
        evaluate(begin, monitor);
        cells = crossedCells(begin, monitor);
    }
}

void BackwardMap::evaluate(size_t begin, const Monitor& monitor) {
    forEachBatch(
        PointsBy{mVoxels.size() - begin, [&](size_t n) { return origin(begin + n); }},
        [&](const PointBatch& points, size_t from) {
            JetBatch<double, 0> jets;
            mSource.eval(points, jets);
            for (size_t i = 0; i < static_cast<size_t>(points.size); ++i) mNodes[begin + from + i][3] = jets.c[0][i];
        },
        monitor);
}

/// Returns the cells whose corners have both signs and include a voxel with an index of at least `begin`.
std::vector<Coord> BackwardMap::crossedCells(size_t begin, const Monitor& monitor) const {
    constexpr size_t kGrain = 1024;
    const size_t count = mVoxels.size() - begin;
    std::vector<std::vector<Coord>> found((count + kGrain - 1) / kGrain);
    parallelFor(
        count, kGrain,
        [&](size_t from, size_t to) {
            const Accessor index(mIndex);
            for (size_t n = from; n < to; ++n)
                for (const Coord& offset : cornersOf({0, 0, 0})) {
                    const Coord cell = mVoxels[begin + n] - offset;
                    int in = 0, out = 0;
                    for (const Coord& corner : cornersOf(cell)) {
                        const int32_t at = index.getValue(corner);
                        if (at < 0) break;
                        ++(inside(static_cast<size_t>(at)) ? in : out);
                    }
                    if (in + out == 8 && in > 0 && out > 0) found[from / kGrain].push_back(cell);
                }
        },
        monitor);
    std::vector<Coord> cells;
    for (const auto& chunk : found) cells.insert(cells.end(), chunk.begin(), chunk.end());
    return cells;
}

namespace {

/// An edge between voxels, its two nodes and the nodes on the line beyond, and the bracket of φ's root on it.
struct VoxelEdge {
    std::array<Node, kNodes> nodes{};
    double a = 0, b = 1, phiA = 0, phiB = 0;
    bool byOrigins = true; ///< If true, φ is evaluated at the interpolated origin; otherwise φ itself is interpolated.
    bool open = true;

    Node at(const Weights& weights) const {
        Node sum{};
        for (size_t k = 0; k < kNodes; ++k) sum += nodes[k] * weights[k];
        return sum;
    }
    /// Returns the next position to try: the Illinois variant of regula falsi (Dowell and Jarratt 1971), with a
    /// bisection every fourth time, since φ₀ is flat beyond its band.
    double next(int iteration) const { return iteration % 4 == 3 ? (a + b) / 2 : a - phiA * (b - a) / (phiB - phiA); }
    void narrow(double t, double phi) {
        constexpr double kEnough = 1e-7; // voxels
        if ((phi < 0) == (phiB < 0)) {
            phiA /= 2;
        } else {
            a = b;
            phiA = phiB;
        }
        b = t;
        phiB = phi;
        open = std::abs(b - a) > kEnough && phi != 0;
    }
};

/// Finds the roots of up to kBatch edges.
void solve(const ScalarField& source, std::span<VoxelEdge> edges) {
    const auto middle = [&](size_t n) { return originOf(edges[n].at(Lagrange(0.5).value)); };
    const PointBatch middles = batchOf(PointsBy{edges.size(), middle}, 0, edges.size());
    JetBatch<double, 1> jets;
    source.eval(middles, jets);
    for (size_t n = 0; n < edges.size(); ++n) {
        const auto difference = edges[n].at(Lagrange(0.5).difference);
        edges[n].byOrigins = errorOf(jets[static_cast<int>(n)].gradient, difference) < std::abs(difference[3]);
    }
    constexpr int kMax = 40;
    for (int k = 0; k < kMax; ++k) {
        PointBatch points;
        std::array<double, kBatch> where;
        std::array<size_t, kBatch> owner;
        for (size_t n = 0; n < edges.size(); ++n) {
            if (!edges[n].open) continue;
            const double t = edges[n].next(k);
            const auto node = edges[n].at(Lagrange(t).value);
            if (!edges[n].byOrigins) {
                edges[n].narrow(t, node[3]);
                continue;
            }
            where[static_cast<size_t>(points.size)] = t;
            owner[static_cast<size_t>(points.size)] = n;
            points.push(originOf(node));
        }
        if (points.size == 0) continue;
        JetBatch<double, 0> phi;
        source.eval(points, phi);
        for (size_t lane = 0; lane < static_cast<size_t>(points.size); ++lane)
            edges[owner[lane]].narrow(where[lane], phi.c[0][lane]);
    }
}

} // namespace

std::vector<BackwardMap::Crossing> BackwardMap::crossings(const Monitor& monitor) const {
    constexpr size_t kGrain = 1024;
    std::vector<std::vector<Crossing>> found((size() + kGrain - 1) / kGrain);
    const auto search = [&](size_t from, size_t to) {
        const Accessor index(mIndex);
        std::vector<Crossing> crossings;
        std::vector<VoxelEdge> edges;
        for (size_t n = from; n < to; ++n)
            for (int axis = 0; axis < 3; ++axis) {
                VoxelEdge edge;
                bool known = true;
                for (int k = 0; k < kNodes && known; ++k) {
                    Coord node = mVoxels[n];
                    node[axis] += k - kNodesBefore;
                    const int32_t at = index.getValue(node);
                    known = at >= 0;
                    if (known) edge.nodes[static_cast<size_t>(k)] = mNodes[static_cast<size_t>(at)];
                }
                edge.phiA = edge.nodes[kNodesBefore][3];
                edge.phiB = edge.nodes[kNodesBefore + 1][3];
                if (!known || (edge.phiA < 0) == (edge.phiB < 0)) continue;
                crossings.push_back({mVoxels[n], axis, 0});
                edges.push_back(edge);
            }
        for (size_t begin = 0; begin < edges.size(); begin += kBatch)
            solve(mSource, std::span(edges).subspan(begin, std::min<size_t>(kBatch, edges.size() - begin)));
        for (size_t n = 0; n < edges.size(); ++n) crossings[n].fraction = edges[n].b;
        found[from / kGrain] = std::move(crossings);
    };
    parallelFor(size(), kGrain, search, monitor);
    std::vector<Crossing> all;
    for (const auto& chunk : found) all.insert(all.end(), chunk.begin(), chunk.end());
    return all;
}

namespace {

/// The indices of the 6³ nodes around a position, which are in up to eight leaves.
class NodeBlock {
  public:
    /// `first` is the lowest node.
    NodeBlock(const Coord& first, const BackwardMap::Accessor& index) : mFirst(first) {
        for (int axis = 0; axis < 3; ++axis) mSplit[axis] = std::min(kNodes, kWidth - (first[axis] & (kWidth - 1)));
        for (int n = 0; n < 8; ++n) {
            const Coord offset((n & 1) * mSplit[0], (n >> 1 & 1) * mSplit[1], (n >> 2) * mSplit[2]);
            if (offset[offset.maxIndex()] == kNodes) continue; // beyond the nodes
            if (const Leaf* leaf = index.probeConstLeaf(first + offset))
                mLeaves[static_cast<size_t>(n)] = leaf->buffer().data();
        }
    }

    /// Reads the indices of a row along z. Returns false if one is unknown.
    bool readRow(int i, int j, std::array<int32_t, kNodes>& row) const {
        const size_t leaf = (i < mSplit[0] ? 0U : 1U) + (j < mSplit[1] ? 0U : 2U);
        const int32_t *lower = mLeaves[leaf], *upper = mSplit[2] < kNodes ? mLeaves[leaf + 4] : lower;
        if (!lower || !upper) return false;
        const Coord at = mFirst.offsetBy(i, j, 0);
        lower += Leaf::coordToOffset(at);
        upper += Leaf::coordToOffset(at.offsetBy(0, 0, mSplit[2] % kNodes));
        int32_t all = 0; // negative if one of them is
        for (int k = 0; k < kNodes; ++k) {
            const int32_t node = k < mSplit[2] ? lower[k] : upper[k - mSplit[2]];
            row[static_cast<size_t>(k)] = node;
            all |= node;
        }
        return all >= 0;
    }

  private:
    using Leaf = openvdb::Int32Tree::LeafNodeType;
    static constexpr int kWidth = static_cast<int>(Leaf::DIM);

    Coord mFirst;
    Coord mSplit;                            ///< How many nodes are in the lower leaves along each axis.
    std::array<const int32_t*, 8> mLeaves{}; ///< Bits of the number: the upper leaf along x, y and z.
};

/// Returns a b + c, rounded once.
Node fusedMulAdd(const Node& a, const Node& b, const Node& c) {
#ifdef __FMA__
    return _mm256_fmadd_pd(a, b, c); // GCC 12 would not vectorise all of the loop below
#else
    Node sum{};
    for (int k = 0; k < 4; ++k) sum[k] = std::fma(a[k], b[k], c[k]);
    return sum;
#endif
}

} // namespace

bool BackwardMap::interpolate(const openvdb::Vec3d& position, const Accessor& index, Interpolated& result) const {
    const Coord base = Coord::floor(position);
    const Lagrange x(position[0] - base[0]), y(position[1] - base[1]), z(position[2] - base[2]);
    // The sums in `difference` are those of the differences along each axis; together they are the difference in space,
    // except for their products.
    result = Interpolated{};
    const NodeBlock block(base.offsetBy(-kNodesBefore), index);
    std::array<int32_t, kNodes> row;
    const auto add = [](Node& sum, const Node& value, const Node& weight) { sum = fusedMulAdd(value, weight, sum); };
    for (size_t i = 0; i < kNodes; ++i) {
        Node plane{}, planeY{}, planeZ{}, planeDifference{};
        for (size_t j = 0; j < kNodes; ++j) {
            if (!block.readRow(static_cast<int>(i), static_cast<int>(j), row)) return false;
            Node line{}, lineZ{}, lineDifference{};
            for (size_t k = 0; k < kNodes; ++k) {
                const Node& node = mNodes[static_cast<size_t>(row[k])];
                add(line, node, z.value[k]);
                add(lineZ, node, z.slope[k]);
                add(lineDifference, node, z.difference[k]);
            }
            add(plane, line, y.value[j]);
            add(planeY, line, y.slope[j]);
            add(planeZ, lineZ, y.value[j]);
            add(planeDifference, line, y.difference[j]);
            add(planeDifference, lineDifference, y.value[j]);
        }
        add(result.value, plane, x.value[i]);
        add(result.derivatives[0], plane, x.slope[i]);
        add(result.derivatives[1], planeY, x.value[i]);
        add(result.derivatives[2], planeZ, x.value[i]);
        add(result.difference, plane, x.difference[i]);
        add(result.difference, planeDifference, x.value[i]);
    }
    return true;
}

void BackwardMap::sample(const std::vector<openvdb::Vec3d>& positions, const Accessor& index,
                         std::vector<Sample>& samples, std::vector<uint8_t>& known) const {
    samples.assign(positions.size(), {});
    known.assign(positions.size(), 0);
    PointBatch points;
    std::array<size_t, kBatch> owner;
    std::array<Interpolated, kBatch> between;
    for (size_t n = 0; n < positions.size(); ++n) {
        const auto lane = static_cast<size_t>(points.size);
        if (!interpolate(positions[n], index, between[lane])) continue;
        known[n] = 1;
        owner[lane] = n;
        points.push(originOf(between[lane].value));
    }
    if (points.size == 0) return;
    JetBatch<double, 1> jets;
    mSource.eval(points, jets);
    for (int lane = 0; lane < points.size; ++lane) {
        const auto jet = jets[lane];
        const Interpolated& here = between[static_cast<size_t>(lane)];
        Sample& sample = samples[owner[static_cast<size_t>(lane)]];
        const bool byOrigins = errorOf(jet.gradient, here.difference) < std::abs(here.difference[3]);
        sample.phi = byOrigins ? jet.value : here.value[3];
        for (int axis = 0; axis < 3; ++axis) {
            const Node& derivative = here.derivatives[static_cast<size_t>(axis)];
            sample.gradient[axis] = byOrigins ? dot(jet.gradient, originOf(derivative)) : derivative[3];
        }
    }
}

} // namespace curlew
