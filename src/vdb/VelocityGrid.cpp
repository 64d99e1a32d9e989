#include "curlew/vdb/VelocityGrid.h"

#include "VoxelSize.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"
#include "curlew/math/Fade.h"

#include <fmt/format.h>
#include <openvdb/tree/LeafManager.h>

#include <algorithm>
#include <bit>
#include <bitset>
#include <map>
#include <memory>
#include <optional>

namespace curlew {

namespace {

using openvdb::Coord;
using VelocityLeaf = openvdb::Vec3STree::LeafNodeType;

constexpr int kLeaf = 8;
constexpr double kInterpolation = 1.75; // voxels: √3, how far beyond the wall trilinear interpolation inside looks

/// How much of the flow is left beyond a one-sided wall.
class Skin {
  public:
    Skin(const Domain& domain, double voxel, double voxels) {
        if (!domain.wall || domain.wall->side == Side::both) return;
        mSide = domain.wall->side;
        // A sampled distance levels off beyond its reach; one that is only a bound (reach 0) does not.
        const double reach = domain.wall->sdf.reach;
        mSteepness = domain.wall->sdf.steepness;
        mEnd = reach > 0 ? std::min(voxels * voxel, reach) : voxels * voxel;
        mBegin = mEnd * std::min(kInterpolation / voxels, 0.75);
        mOneSided = true;
    }
    bool oneSided() const { return mOneSided; }
    /// From 1 to 0; for a one-sided wall.
    double fade(double distance) const {
        const double beyond = mSide == Side::inside ? distance : -distance;
        return 1 - quinticFade((beyond - mBegin) / (mEnd - mBegin)).value;
    }
    /// Whether nothing fades within `radius` of a position at this distance.
    bool isFar(double distance, double radius) const {
        return !mOneSided || beyondWall(mSide, distance) + mSteepness * radius < mBegin;
    }
    /// The distances at which anything is left, and `margin` more.
    DistanceRange range(double margin) const {
        DistanceRange range;
        if (mOneSided && mSide == Side::inside) range.upper = mEnd + margin;
        if (mOneSided && mSide == Side::outside) range.lower = -mEnd - margin;
        return range;
    }

  private:
    bool mOneSided = false;
    Side mSide = Side::inside;
    double mBegin = 0, mEnd = 1, mSteepness = 1;
};

template <class T>
void distances(const Domain& domain, const PointBatch& points, JetBatch<T, 0>& d) {
    if (domain.wall)
        domain.wall->sdf.distance.eval(points, d);
    else
        d.c[0].fill(std::numeric_limits<T>::infinity());
}

/// The voxels of one plane of a leaf are a batch, and a word of the mask of its active voxels.
static_assert(kBatch == kLeaf * kLeaf);

/// Fills leaves of a grid whose voxel ijk has its centre at voxel * ijk.
class LeafSampler {
  public:
    LeafSampler(const Flow& flow, double voxel, const Skin& skin) : mFlow(flow), mVoxel(voxel), mSkin(skin) {}

    void collocated(VelocityLeaf& leaf) const {
        const bool whole = inBox(leaf.origin()), fades = !isFar(leaf.origin());
        for (int plane = 0; plane < kLeaf; ++plane) {
            PointBatch points = centres(leaf.origin(), plane);
            Fade fade;
            const uint64_t flows = flowing(points, whole, fades, fade);
            if (flows == 0) continue;
            std::array<uint8_t, kBatch> voxel; // in the plane
            if (flows != kAll) keep(flows, points, fade, voxel);
            VecBatch<float> v;
            mFlow.velocity(points, v);
            if (fades)
                for (auto& axis : v.c)
                    for (size_t i = 0; i < kBatch; ++i) axis[i] *= fade[i];
            openvdb::Vec3s* values = leaf.buffer().data() + plane * kBatch;
            for (size_t i = 0; i < static_cast<size_t>(points.size); ++i)
                values[flows == kAll ? i : voxel[i]] = {v.c[0][i], v.c[1][i], v.c[2][i]};
            leaf.getValueMask().getWord<uint64_t>(plane) = flows;
        }
    }

    /// Whether all voxels of a leaf have their centres in the box.
    bool inBox(const Coord& origin) const {
        const Coord last = origin.offsetBy(kLeaf - 1);
        const Box& box = mFlow.domain().box;
        return box.contains(centre(origin)) && box.contains(centre(last));
    }
    /// Whether nothing fades in a cube of so many voxels along an edge, nor at their corners.
    bool isFar(const Coord& origin, int edge = kLeaf) const {
        if (!mSkin.oneSided()) return true;
        const double half = 0.5 * edge;
        const Vec3d middle = centre(origin) + Vec3d{{1, 1, 1}} * ((half - 0.5) * mVoxel);
        return mSkin.isFar(mFlow.domain().wall->sdf.distance.at<0>(middle).value, half * std::sqrt(3.0) * mVoxel);
    }
    Vec3d centre(const Coord& ijk) const { return {{ijk[0] * mVoxel, ijk[1] * mVoxel, ijk[2] * mVoxel}}; }

    const Flow& flow() const { return mFlow; }
    double voxel() const { return mVoxel; }
    const Skin& skin() const { return mSkin; }

    /// The centres of the voxels of a plane.
    PointBatch centres(const Coord& origin, int plane) const {
        PointBatch points;
        points.size = kBatch;
        points.c[0].fill((origin[0] + plane) * mVoxel);
        for (int j = 0; j < kLeaf; ++j)
            for (int k = 0; k < kLeaf; ++k) {
                points.c[1][static_cast<size_t>(j * kLeaf + k)] = (origin[1] + j) * mVoxel;
                points.c[2][static_cast<size_t>(j * kLeaf + k)] = (origin[2] + k) * mVoxel;
            }
        return points;
    }

  private:
    static constexpr uint64_t kAll = ~uint64_t{0};
    using Fade = std::array<float, kBatch>;

    /// The voxels where anything flows, as bits, and how much of it.
    uint64_t flowing(const PointBatch& points, bool whole, bool fades, Fade& fade) const {
        uint64_t flows = kAll;
        if (!whole)
            for (int i = 0; i < kBatch; ++i)
                if (!mFlow.domain().box.contains(points[i])) flows &= ~(uint64_t{1} << i);
        fade.fill(1);
        if (flows == 0 || !fades) return flows;
        JetBatch<float, 0> d;
        distances(mFlow.domain(), points, d);
        for (size_t i = 0; i < kBatch; ++i) fade[i] = static_cast<float>(mSkin.fade(static_cast<double>(d.c[0][i])));
        for (size_t i = 0; i < kBatch; ++i)
            if (!(fade[i] > 0)) flows &= ~(uint64_t{1} << i);
        return flows;
    }

    /// Leaves the positions where anything flows, side by side, and says which voxels they are of.
    static void keep(uint64_t flows, PointBatch& points, Fade& fade, std::array<uint8_t, kBatch>& voxel) {
        points.size = 0;
        for (; flows != 0; flows &= flows - 1) {
            const int i = std::countr_zero(flows);
            const auto to = static_cast<size_t>(points.size);
            fade[to] = fade[static_cast<size_t>(i)];
            voxel[to] = static_cast<uint8_t>(i);
            points.push(points[i]);
        }
    }

    const Flow& mFlow;
    double mVoxel;
    const Skin& mSkin;
};

/// The potentials at the corners of the voxels of a brick of leaves, each computed once, when the first leaf needs it.
class BrickCorners {
  public:
    static constexpr int kLeaves = 4; ///< Along an edge: 33³ corners for up to 32³ voxels.
    static constexpr size_t kAllLeaves = size_t{kLeaves} * kLeaves * kLeaves;

    /// `origin`: the lowest voxel of the brick.
    BrickCorners(const LeafSampler& sampler, const Coord& origin)
        : mSampler(sampler), mOrigin(origin), mTerms(sampler.flow().terms().size()) {
        for (Term& t : mTerms) {
            t.f.resize(kCount);
            t.g.resize(kCount);
        }
    }

    /// Computes all corners: for a brick that has all its leaves.
    void needAll() {
        const double h = mSampler.voxel();
        const bool fades = !mSampler.isFar(mOrigin, kLeaves * kLeaf);
        PointBatch points;
        size_t done = 0;
        const auto flush = [&] {
            evaluate(points, fades, [&](size_t t, const Values& f, const Values& g) {
                std::copy_n(f.begin(), points.size, mTerms[t].f.begin() + static_cast<std::ptrdiff_t>(done));
                std::copy_n(g.begin(), points.size, mTerms[t].g.begin() + static_cast<std::ptrdiff_t>(done));
            });
            done += static_cast<size_t>(points.size);
            points.size = 0;
        };
        for (int i = 0; i < kEdge; ++i)
            for (int j = 0; j < kEdge; ++j)
                for (int k = 0; k < kEdge; ++k) {
                    points.push(cornerOf(mOrigin.offsetBy(i, j, k), h));
                    if (points.full()) flush();
                }
        flush();
        mKnown.set();
    }

    /// The velocities of a leaf of the brick at its faces: the circulation of f dg around each, over its area.
    void staggered(VelocityLeaf& leaf) {
        if (!mKnown.all()) need(leaf.origin());
        Edges edges;
        integrate(leaf.origin(), edges);
        const auto& [x, y, z] = edges;
        const double perArea = 1 / (mSampler.voxel() * mSampler.voxel());
        openvdb::Vec3s* values = leaf.buffer().data();
        for (size_t i = 0; i < kLeaf; ++i)
            for (size_t j = 0; j < kLeaf; ++j) {
                std::array<std::array<float, kLeaf>, 3> v;
                for (size_t k = 0; k < kLeaf; ++k) {
                    const size_t n = i * kEdgeX + j * kEdgeY + k;
                    v[0][k] = static_cast<float>((y[n] + z[n + kEdgeY] - y[n + 1] - z[n]) * perArea);
                    v[1][k] = static_cast<float>((z[n] + x[n + 1] - z[n + kEdgeX] - x[n]) * perArea);
                    v[2][k] = static_cast<float>((x[n] + y[n + kEdgeX] - x[n + kEdgeY] - y[n]) * perArea);
                }
                for (size_t k = 0; k < kLeaf; ++k) *values++ = {v[0][k], v[1][k], v[2][k]};
            }
        activate(leaf);
    }

  private:
    static constexpr int kEdge = kLeaves * kLeaf + 1;
    static constexpr size_t kCount = size_t{kEdge} * kEdge * kEdge;
    struct Term {
        std::vector<double> f, g;
    };
    // Of a leaf: from each corner to the next along one axis, of its 9³ corners, z fastest.
    static constexpr size_t kEdgeY = kLeaf + 1, kEdgeX = kEdgeY * kEdgeY;
    using Edges = std::array<std::array<double, kEdgeX*(kLeaf + 1)>, 3>;

    using Values = std::array<double, kBatch>;

    static Vec3d cornerOf(const Coord& ijk, double h) {
        return {{(ijk[0] - 0.5) * h, (ijk[1] - 0.5) * h, (ijk[2] - 0.5) * h}};
    }
    static size_t cornerAt(const Coord& c) {
        return (static_cast<size_t>(c[0]) * kEdge + static_cast<size_t>(c[1])) * kEdge + static_cast<size_t>(c[2]);
    }

    /// Computes the corners of a leaf that are not known yet.
    void need(const Coord& leaf) {
        const Coord lower = leaf - mOrigin;
        const double h = mSampler.voxel();
        const bool fades = !mSampler.isFar(leaf);
        PointBatch points;
        std::array<size_t, kBatch> corner;
        for (int i = 0; i <= kLeaf; ++i)
            for (int j = 0; j <= kLeaf; ++j)
                for (int k = 0; k <= kLeaf; ++k) {
                    const Coord c = lower.offsetBy(i, j, k);
                    const size_t n = cornerAt(c);
                    if (mKnown[n]) continue;
                    mKnown[n] = true;
                    corner[static_cast<size_t>(points.size)] = n;
                    points.push(cornerOf(mOrigin + c, h));
                    if (points.full()) compute(points, fades, corner);
                }
        if (points.size > 0) compute(points, fades, corner);
    }

    /// Stores the potentials at their corners.
    void compute(PointBatch& points, bool fades, const std::array<size_t, kBatch>& corner) {
        evaluate(points, fades, [&](size_t t, const Values& f, const Values& g) {
            for (size_t n = 0; n < static_cast<size_t>(points.size); ++n) {
                mTerms[t].f[corner[n]] = f[n];
                mTerms[t].g[corner[n]] = g[n];
            }
        });
        points.size = 0;
    }

    /// use(term, f, g) with the potentials of each term, f faded beyond the wall.
    template <class Use>
    void evaluate(const PointBatch& points, bool fades, const Use& use) const {
        JetBatch<double, 0> d, f, g;
        if (fades) {
            distances(mSampler.flow().domain(), points, d);
            for (double& value : d.c[0]) value = mSampler.skin().fade(value);
        }
        for (size_t t = 0; t < mTerms.size(); ++t) {
            mSampler.flow().terms()[t][0].eval(points, f);
            mSampler.flow().terms()[t][1].eval(points, g);
            if (fades)
                for (size_t n = 0; n < kBatch; ++n) f.c[0][n] *= d.c[0][n];
            use(t, f.c[0], g.c[0]);
        }
    }

    /// Every edge is integrated in the direction of its axis, so that the faces that share it get the same bits.
    void integrate(const Coord& leaf, Edges& edges) const {
        constexpr std::array<size_t, 3> kStep{size_t{kEdge} * kEdge, kEdge, 1};
        constexpr size_t kCorners = kLeaf + 1; // of an edge
        const size_t first = cornerAt(leaf - mOrigin);
        for (auto& sums : edges) sums.fill(0);
        for (const Term& t : mTerms)
            for (size_t axis = 0; axis < 3; ++axis) {
                // The last corner along the axis has no edge.
                const size_t endI = kCorners - (axis == 0), endJ = kCorners - (axis == 1), step = kStep[axis];
                for (size_t i = 0; i < endI; ++i)
                    for (size_t j = 0; j < endJ; ++j) {
                        const size_t from = first + i * kStep[0] + j * kStep[1];
                        const double *f = &t.f[from], *g = &t.g[from];
                        double* sum = &edges[axis][i * kEdgeX + j * kEdgeY];
                        for (size_t k = 0; k < kLeaf; ++k) sum[k] += 0.5 * (f[k] + f[k + step]) * (g[k + step] - g[k]);
                        if (axis != 2) {
                            constexpr size_t k = kLeaf;
                            sum[k] += 0.5 * (f[k] + f[k + step]) * (g[k + step] - g[k]);
                        }
                    }
            }
    }

    /// Beyond a wall, what counts is whether anything still flows; a contained flow ends there, whatever the box.
    void activate(VelocityLeaf& leaf) const {
        const Domain& domain = mSampler.flow().domain();
        const bool contained = domain.wall && domain.wall->side == Side::inside;
        const bool whole = contained || mSampler.inBox(leaf.origin());
        if (whole && !domain.wall) return leaf.setValuesOn();
        for (openvdb::Index n = 0; n < VelocityLeaf::SIZE; ++n) {
            openvdb::Vec3s& v = leaf.buffer().data()[n];
            const bool flows = !domain.wall || v != openvdb::Vec3s(0);
            if (flows && (whole || domain.box.contains(mSampler.centre(leaf.offsetToGlobalCoord(n)))))
                leaf.setValueOn(n);
            else
                v = openvdb::Vec3s(0);
        }
    }

    const LeafSampler& mSampler;
    Coord mOrigin;
    std::vector<Term> mTerms;
    std::bitset<kCount> mKnown;
};

double voxelFor(const Flow& flow, const VelocityGridOptions& options) {
    if (options.voxel < 0 || !std::isfinite(options.voxel))
        throw ValueError(fmt::format("voxel size {} must be positive", options.voxel));
    if (options.voxel == 0 && options.dim < 1) throw ValueError(fmt::format("dim {} must be at least 1", options.dim));
    const Box& box = flow.domain().box;
    if (!box.finite()) throw ValueError("the domain is infinite; give a box");
    const Vec3d size = box.size();
    if (!(std::min({size[0], size[1], size[2]}) > 0)) throw ValueError("the box is empty");
    return options.voxel > 0 ? options.voxel : std::max({size[0], size[1], size[2]}) / options.dim;
}

/// The origins of the leaves that may hold active voxels, in order.
std::vector<Coord> leafOrigins(const Domain& domain, double voxel, const Skin& skin) {
    const double bytes = sizeof(VelocityLeaf) + VelocityLeaf::SIZE * sizeof(openvdb::Vec3s) + 64;
    const auto fitting = static_cast<size_t>(static_cast<double>(availableMemory()) / (bytes + 3 * sizeof(Coord)));
    const Vec3d origin{{-0.5 * voxel, -0.5 * voxel, -0.5 * voxel}};
    const double voxels = volumeOf(domain) / (voxel * voxel * voxel);
    requireMemory(voxels * sizeof(openvdb::Vec3s), fmt::format("a velocity grid of {:.3g} voxels", voxels),
                  "choose larger voxels");
    std::vector<Coord> origins;
    // A voxel's faces matter as far as its corners: half a diagonal beyond its centre.
    Domain searched = domain;
    if (domain.wall && domain.wall->side == Side::inside) searched.box = domain.box.padded(skin.range(voxel).upper);
    for (const auto& cell : coveringCells(searched, origin, voxel * kLeaf, skin.range(0.9 * voxel), fitting))
        origins.emplace_back(cell[0] * kLeaf, cell[1] * kLeaf, cell[2] * kLeaf);
    requireMemory(static_cast<double>(origins.size()) * bytes,
                  fmt::format("a velocity grid of up to {} voxels", origins.size() * VelocityLeaf::SIZE),
                  "choose larger voxels");
    return origins;
}

/// The active voxels of a mask, and the size of its voxels; they have to be axis-aligned cubes around multiples of it.
double maskVoxel(const openvdb::GridBase& mask) {
    const auto voxel = mask.voxelSize();
    const auto lattice = openvdb::math::Transform::createLinearTransform(voxel[0]);
    if (!(voxel[0] > 0) || mask.transform() != *lattice)
        throw ValueError(
            fmt::format("the mask '{}' must have cubic voxels, aligned with the axes and the origin", mask.getName()));
    return voxel[0];
}

openvdb::MaskTree::Ptr topologyOfMask(const openvdb::GridBase& mask) {
    openvdb::MaskTree::Ptr topology;
    const bool known = mask.apply<openvdb::GridTypes>([&](const auto& grid) {
        topology = std::make_shared<openvdb::MaskTree>(grid.tree(), false, true, openvdb::TopologyCopy());
    });
    if (!known) throw ValueError(fmt::format("grid '{}' of type {} cannot be a mask", mask.getName(), mask.type()));
    topology->voxelizeActiveTiles();
    return topology;
}

/// Leaves nothing but background outside the mask.
void restrictTo(const openvdb::MaskTree::LeafNodeType& mask, VelocityLeaf& leaf) {
    for (openvdb::Index n = 0; n < VelocityLeaf::SIZE; ++n)
        if (!mask.isValueOn(n)) leaf.setValueOff(n, openvdb::Vec3s(0));
}

/// The leaves of one brick, as indices into their origins.
struct Brick {
    Coord origin;
    std::vector<size_t> leaves;
};

std::vector<Brick> bricksOf(const std::vector<Coord>& origins) {
    constexpr int kBrick = BrickCorners::kLeaves * kLeaf;
    std::map<Coord, std::vector<size_t>> leaves;
    for (size_t n = 0; n < origins.size(); ++n) leaves[origins[n] & ~(kBrick - 1)].push_back(n);
    std::vector<Brick> bricks;
    bricks.reserve(leaves.size());
    for (auto& [origin, indices] : leaves) bricks.push_back({origin, std::move(indices)});
    return bricks;
}

/// New leaves at the origins, filled in parallel, those without an active voxel left out.
openvdb::Vec3STree::Ptr filledTree(const std::vector<Coord>& origins, const LeafSampler& sampler, Layout layout,
                                   const openvdb::MaskTree* mask, const Monitor& monitor) {
    std::vector<std::unique_ptr<VelocityLeaf>> leaves(origins.size());
    const std::vector<Brick> bricks = bricksOf(origins);
    const auto fill = [&](const Brick& brick) {
        std::optional<BrickCorners> corners;
        if (layout == Layout::staggered) corners.emplace(sampler, brick.origin);
        if (corners && brick.leaves.size() == BrickCorners::kAllLeaves) corners->needAll();
        for (const size_t n : brick.leaves) {
            auto leaf = std::make_unique<VelocityLeaf>(origins[n], openvdb::Vec3s(0));
            if (corners)
                corners->staggered(*leaf);
            else
                sampler.collocated(*leaf);
            if (mask) restrictTo(*mask->probeConstLeaf(leaf->origin()), *leaf);
            if (!leaf->isEmpty()) leaves[n] = std::move(leaf);
        }
    };
    parallelFor(
        bricks.size(), 1,
        [&](size_t begin, size_t end) {
            for (size_t k = begin; k < end; ++k) fill(bricks[k]);
        },
        monitor);
    auto tree = std::make_shared<openvdb::Vec3STree>(openvdb::Vec3s(0));
    for (auto& leaf : leaves)
        if (leaf) tree->addLeaf(leaf.release());
    return tree;
}

template <class GridType>
void fillScalar(const std::function<void(const PointBatch&, std::array<float, kBatch>&)>& value, GridType& grid,
                const Monitor& monitor) {
    const openvdb::tree::LeafManager<typename GridType::TreeType> leaves(grid.tree());
    parallelFor(
        leaves.leafCount(), 8,
        [&](size_t begin, size_t end) {
            for (size_t n = begin; n < end; ++n) {
                auto& leaf = leaves.leaf(n);
                PointBatch points;
                std::array<openvdb::Index, kBatch> offset;
                std::array<float, kBatch> values;
                const auto flush = [&] {
                    value(points, values);
                    for (int i = 0; i < points.size; ++i)
                        leaf.setValueOnly(offset[static_cast<size_t>(i)], values[static_cast<size_t>(i)]);
                    points.size = 0;
                };
                for (auto voxel = leaf.cbeginValueOn(); voxel; ++voxel) {
                    const auto p = grid.transform().indexToWorld(voxel.getCoord());
                    offset[static_cast<size_t>(points.size)] = voxel.pos();
                    points.push({{p[0], p[1], p[2]}});
                    if (points.full()) flush();
                }
                if (points.size > 0) flush();
            }
        },
        monitor);
}

openvdb::FloatGrid::Ptr floatGridOn(const openvdb::GridBase& where) {
    const auto topology = topologyOfMask(where);
    auto grid =
        openvdb::FloatGrid::create(std::make_shared<openvdb::FloatTree>(*topology, 0.0f, openvdb::TopologyCopy()));
    grid->setTransform(where.transform().copy());
    return grid;
}

} // namespace

openvdb::Vec3SGrid::Ptr velocityGrid(const Flow& flow, const VelocityGridOptions& options, const Monitor& monitor) {
    if (!(options.skin >= 1)) throw ValueError(fmt::format("skin {} must be at least 1 voxel", options.skin));
    if (options.layout == Layout::staggered && !flow.divergenceFree())
        throw ValueError(
            "a normalised flow is not divergence-free, and has no staggered grid that is; sample it collocated");
    const double voxel = options.mask ? maskVoxel(*options.mask) : voxelFor(flow, options);
    openvdb::MaskTree::Ptr mask;
    std::vector<Coord> origins;
    // With a mask, the mask alone decides what is active.
    constexpr double kFar = 1e300;
    constexpr Box kEverywhere{{{-kFar, -kFar, -kFar}}, {{kFar, kFar, kFar}}};
    const Flow sampled = options.mask ? flow.within({kEverywhere, std::nullopt}) : flow;
    if (options.mask) {
        mask = topologyOfMask(*options.mask);
        for (auto leaf = mask->cbeginLeaf(); leaf; ++leaf) origins.push_back(leaf->origin());
    }
    const Skin skin(sampled.domain(), voxel, options.skin);
    if (!options.mask) origins = leafOrigins(flow.domain(), voxel, skin);
    requireVoxel(voxel);

    const LeafSampler sampler(sampled, voxel, skin);
    const auto tree = filledTree(origins, sampler, options.layout, mask.get(), monitor);
    auto grid = openvdb::Vec3SGrid::create(tree);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
    grid->setName("vel");
    grid->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
    if (options.layout == Layout::staggered) grid->setGridClass(openvdb::GRID_STAGGERED);
    return grid;
}

openvdb::FloatGrid::Ptr sampledGrid(const ScalarField& field, const openvdb::GridBase& where, const std::string& name,
                                    const Monitor& monitor) {
    auto grid = floatGridOn(where);
    grid->setName(name);
    fillScalar(
        [&](const PointBatch& points, std::array<float, kBatch>& values) {
            JetBatch<float, 0> jets;
            field.eval(points, jets);
            values = jets.c[0];
        },
        *grid, monitor);
    return grid;
}

openvdb::FloatGrid::Ptr densityGrid(const Domain& domain, const openvdb::GridBase& where, const Monitor& monitor) {
    auto grid = floatGridOn(where);
    grid->setName("density");
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    const double edge = 2 * grid->voxelSize()[0];
    fillScalar(
        [&](const PointBatch& points, std::array<float, kBatch>& values) {
            JetBatch<double, 0> d;
            distances(domain, points, d);
            for (size_t i = 0; i < values.size(); ++i)
                values[i] =
                    domain.wall
                        ? static_cast<float>(std::clamp(-beyondWall(domain.wall->side, d.c[0][i]) / edge, 0.0, 1.0))
                        : 1.0f;
        },
        *grid, monitor);
    return grid;
}

} // namespace curlew
