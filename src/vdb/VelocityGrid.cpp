#include "curlew/vdb/VelocityGrid.h"

#include "VoxelSize.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"
#include "curlew/math/Fade.h"

#include <fmt/format.h>
#include <openvdb/tree/LeafManager.h>

#include <algorithm>
#include <memory>

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
        mEnd = reach > 0 ? std::min(voxels * voxel, reach) : voxels * voxel;
        mBegin = mEnd * std::min(kInterpolation / voxels, 0.75);
        mOneSided = true;
    }
    double fade(double distance) const {
        return mOneSided ? 1 - quinticFade((beyondWall(mSide, distance) - mBegin) / (mEnd - mBegin)).value : 1;
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
    double mBegin = 0, mEnd = 1;
};

void distances(const Domain& domain, const PointBatch& points, JetBatch<double, 0>& d) {
    if (domain.wall)
        domain.wall->sdf.distance.eval(points, d);
    else
        d.c[0].fill(std::numeric_limits<double>::infinity());
}

/// Fills one leaf of a grid whose voxel ijk has its centre at voxel * ijk.
class LeafSampler {
  public:
    LeafSampler(const Flow& flow, double voxel, const Skin& skin) : mFlow(flow), mVoxel(voxel), mSkin(skin) {}

    void collocated(VelocityLeaf& leaf) const {
        for (openvdb::Index begin = 0; begin < VelocityLeaf::SIZE; begin += kBatch) {
            PointBatch points;
            for (openvdb::Index n = begin; n < begin + kBatch; ++n) points.push(centre(leaf.offsetToGlobalCoord(n)));
            JetBatch<double, 0> d;
            distances(mFlow.domain(), points, d);
            PointBatch moving;
            std::array<openvdb::Index, kBatch> offset;
            std::array<double, kBatch> fade;
            for (int i = 0; i < kBatch; ++i) {
                const double rest = mSkin.fade(d.c[0][static_cast<size_t>(i)]);
                if (!(rest > 0) || !mFlow.domain().box.contains(points[i])) continue;
                offset[static_cast<size_t>(moving.size)] = begin + static_cast<openvdb::Index>(i);
                fade[static_cast<size_t>(moving.size)] = rest;
                moving.push(points[i]);
            }
            if (moving.size == 0) continue;
            VecBatch<float> velocity;
            mFlow.velocity(moving, velocity);
            for (int i = 0; i < moving.size; ++i) {
                const Vec3f v = velocity[i] * static_cast<float>(fade[static_cast<size_t>(i)]);
                leaf.setValueOn(offset[static_cast<size_t>(i)], {v[0], v[1], v[2]});
            }
        }
    }

    void staggered(VelocityLeaf& leaf) const {
        Corners corners(*this, leaf.origin());
        // Beyond a wall, what counts is whether anything still flows; a contained flow ends there, whatever the box.
        const auto& wall = mFlow.domain().wall;
        const bool contained = wall && wall->side == Side::inside;
        for (openvdb::Index n = 0; n < VelocityLeaf::SIZE; ++n) {
            const Coord local = VelocityLeaf::offsetToLocalCoord(n);
            openvdb::Vec3s v;
            for (int axis = 0; axis < 3; ++axis)
                v[axis] = static_cast<float>(corners.flux(local, axis) / (mVoxel * mVoxel));
            const bool flows = !wall || v != openvdb::Vec3s(0);
            if (flows && (contained || mFlow.domain().box.contains(centre(leaf.offsetToGlobalCoord(n)))))
                leaf.setValueOn(n, v);
        }
    }

  private:
    Vec3d centre(const Coord& ijk) const { return {{ijk[0] * mVoxel, ijk[1] * mVoxel, ijk[2] * mVoxel}}; }

    /// The potentials at the 9³ corners of a leaf's voxels; the first of each term, f, faded beyond the wall.
    class Corners {
      public:
        Corners(const LeafSampler& sampler, const Coord& origin) : mTerms(sampler.mFlow.terms().size()) {
            const double h = sampler.mVoxel;
            for (size_t begin = 0; begin < kCount; begin += kBatch) {
                const size_t end = std::min(kCount, begin + kBatch);
                PointBatch points;
                for (size_t n = begin; n < end; ++n) {
                    const auto i = static_cast<int>(n / (kEdge * kEdge)), j = static_cast<int>(n / kEdge % kEdge),
                               k = static_cast<int>(n % kEdge);
                    points.push({{(origin[0] + i - 0.5) * h, (origin[1] + j - 0.5) * h, (origin[2] + k - 0.5) * h}});
                }
                JetBatch<double, 0> d, f, g;
                distances(sampler.mFlow.domain(), points, d);
                for (size_t t = 0; t < mTerms.size(); ++t) {
                    sampler.mFlow.terms()[t][0].eval(points, f);
                    sampler.mFlow.terms()[t][1].eval(points, g);
                    for (size_t n = begin; n < end; ++n) {
                        mTerms[t].f[n] = f.c[0][n - begin] * sampler.mSkin.fade(d.c[0][n - begin]);
                        mTerms[t].g[n] = g.c[0][n - begin];
                    }
                }
            }
        }

        /// The circulation of f dg around the low face across `axis` of a voxel: its flux in the direction of the axis.
        double flux(const Coord& voxel, int axis) const {
            Coord u(0), v(0);
            u[(axis + 1) % 3] = v[(axis + 2) % 3] = 1;
            const size_t a = index(voxel), b = index(voxel + u), c = index(voxel + u + v), d = index(voxel + v);
            return along(a, b) + along(b, c) - along(d, c) - along(a, d);
        }

      private:
        static constexpr size_t kEdge = kLeaf + 1, kCount = kEdge * kEdge * kEdge;
        struct Term {
            std::array<double, kCount> f, g;
        };
        static size_t index(const Coord& c) {
            return (static_cast<size_t>(c[0]) * kEdge + static_cast<size_t>(c[1])) * kEdge + static_cast<size_t>(c[2]);
        }
        /// Every edge is integrated in the direction of its axis, so that the faces that share it get the same bits.
        double along(size_t from, size_t to) const {
            double sum = 0;
            for (const Term& t : mTerms) sum += 0.5 * (t.f[from] + t.f[to]) * (t.g[to] - t.g[from]);
            return sum;
        }

        std::vector<Term> mTerms;
    };

    const Flow& mFlow;
    double mVoxel;
    const Skin& mSkin;
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

/// New leaves at the origins, filled in parallel, those without an active voxel left out.
openvdb::Vec3STree::Ptr filledTree(const std::vector<Coord>& origins, const std::function<void(VelocityLeaf&)>& fill,
                                   const Monitor& monitor) {
    std::vector<std::unique_ptr<VelocityLeaf>> leaves(origins.size());
    parallelFor(
        origins.size(), 8,
        [&](size_t begin, size_t end) {
            for (size_t n = begin; n < end; ++n) {
                auto leaf = std::make_unique<VelocityLeaf>(origins[n], openvdb::Vec3s(0));
                fill(*leaf);
                if (!leaf->isEmpty()) leaves[n] = std::move(leaf);
            }
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
    const auto tree = filledTree(
        origins,
        [&](VelocityLeaf& leaf) {
            options.layout == Layout::staggered ? sampler.staggered(leaf) : sampler.collocated(leaf);
            if (mask) restrictTo(*mask->probeConstLeaf(leaf.origin()), leaf);
        },
        monitor);
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
