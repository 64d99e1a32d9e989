// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/GridFlow.h"

#include "EdgePotentials.h"
#include "EdgeSpline.h"
#include "VelocityLattice.h"
#include "curlew/base/Error.h"
#include "curlew/base/Memory.h"
#include "curlew/field/Algebra.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/vdb/GridField.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/VelocityGrid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace curlew {

namespace {

using Point = Vec<int, 3>;

/// Returns the box in world space around a box in index coordinates.
Box worldBox(const VelocityLattice& lattice, const Vec3d& lower, const Vec3d& upper) {
    const Matrix3 toWorld = transpose(lattice.axes); // times the voxel size
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Box box{{{kInfinity, kInfinity, kInfinity}}, {{-kInfinity, -kInfinity, -kInfinity}}};
    for (int corner = 0; corner < 8; ++corner) {
        Vec3d index;
        for (int k = 0; k < 3; ++k) index[k] = (corner >> k & 1) != 0 ? upper[k] : lower[k];
        const Vec3d world = toWorld * ((index - lattice.shift) * lattice.voxel);
        for (int k = 0; k < 3; ++k) {
            box.lower[k] = std::min(box.lower[k], world[k]);
            box.upper[k] = std::max(box.upper[k], world[k]);
        }
    }
    return box;
}

/// The trilinear interpolant of a grid of scalars in the coordinates A x + b.
class LinearGrid {
  public:
    static constexpr std::string_view kNotSymbolic = "a velocity grid";

    LinearGrid(openvdb::FloatGrid::ConstPtr grid, const Matrix3& toIndex, const Vec3d& shift)
        : mGrid(std::move(grid)), mToIndex(toIndex), mShift(shift) {}

    template <int Order, class T>
    void evalBatch(const PointBatch& points, JetBatch<T, Order>& jets) const {
        const openvdb::tree::ValueAccessor<const openvdb::FloatTree, /*IsSafe=*/false> values(mGrid->tree());
        for (int i = 0; i < points.size; ++i) {
            const Jet<double, 3, Order> jet = pullBack(at<Order>(points[i], values), mToIndex);
            for (int k = 0; k < jet.kSize; ++k)
                jets.c[static_cast<size_t>(k)][static_cast<size_t>(i)] = static_cast<T>(jet.component(k));
        }
    }

  private:
    template <int Order, class Accessor>
    Jet<double, 3, Order> at(const Vec3d& position, const Accessor& values) const {
        constexpr double kNowhere = 0x1p30; // coordinates that no voxel has, also for NaN
        using J = Jet<double, 3, Order>;
        openvdb::Coord base;
        Vec3d t;
        for (int axis = 0; axis < 3; ++axis) {
            double x = dot(mToIndex[axis], position) + mShift[axis];
            if (!(std::abs(x) < kNowhere)) x = kNowhere;
            base[axis] = static_cast<int>(std::floor(x));
            t[axis] = x - base[axis];
        }
        const auto variables = J::variables(t);
        J sum(0);
        for (int corner = 0; corner < 8; ++corner) {
            J weight(1);
            openvdb::Coord ijk = base;
            for (int axis = 0; axis < 3; ++axis) {
                const bool upper = (corner >> axis & 1) != 0;
                ijk[axis] += upper ? 1 : 0;
                weight = weight * (upper ? variables[axis] : J(1) - variables[axis]);
            }
            sum += weight * J(static_cast<double>(values.getValue(ijk)));
        }
        return sum;
    }

    openvdb::FloatGrid::ConstPtr mGrid;
    Matrix3 mToIndex;
    Vec3d mShift;
};

/// Returns a component of the velocity along its own axis as a field.
ScalarField componentField(const VelocityLattice& lattice, int axis, GridSampling sampling, const Monitor& monitor) {
    const auto& grid = lattice.components[static_cast<size_t>(axis)];
    Vec3d shift = lattice.shift;
    if (lattice.staggered) shift[axis] += 0.5; // a face's centre has the index coordinates ijk - 1/2 along its axis
    if (sampling == GridSampling::linear) return ScalarField(LinearGrid(grid, lattice.toIndex, shift));
    openvdb::Mat4d toIndex = openvdb::Mat4d::identity();
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) toIndex(j, i) = lattice.toIndex[i][j];
        toIndex(3, i) = shift[i];
    }
    const auto placed =
        grid->copyGridReplacingTransform(openvdb::math::Transform::createLinearTransform(toIndex.inverse()));
    return gridField(*placed, monitor);
}

/// Returns the velocities through the faces of `n` cells from the lowest active voxel on. Those of a collocated grid
/// are the averages of the voxels beside a face, and those of the voxel at a side of the box.
FaceVelocities facesOf(const VelocityLattice& lattice, const Point& n) {
    FaceVelocities faces(n);
    const openvdb::Coord first = lattice.active.min();
    std::array<std::unique_ptr<openvdb::FloatGrid::ConstAccessor>, 3> value;
    for (size_t k = 0; k < 3; ++k)
        value[k] = std::make_unique<openvdb::FloatGrid::ConstAccessor>(lattice.components[k]->tree());
    const auto component = [&](size_t k, const Point& p) {
        return static_cast<double>(value[k]->getValue(first.offsetBy(p[0], p[1], p[2])));
    };
    const auto along = [&](int axis, const Point& p) { // of a collocated voxel, whose velocity is in world space
        double sum = 0;
        for (int k = 0; k < 3; ++k) sum += lattice.axes[axis][k] * component(static_cast<size_t>(k), p);
        return sum;
    };
    for (int axis = 0; axis < 3; ++axis)
        Lattice<double>::forEach(faces[axis].size(), [&](const Point& face) {
            if (lattice.staggered) {
                faces[axis](face) = component(static_cast<size_t>(axis), face);
                return;
            }
            Point below = next(face, axis, -1), above = face;
            below[axis] = std::max(below[axis], 0);
            above[axis] = std::min(above[axis], n[axis] - 1);
            faces[axis](face) = 0.5 * (along(axis, below) + along(axis, above));
        });
    return faces;
}

/// Throws ResourceError if an array of `bytes` for each voxel of the box of the active voxels would not fit in memory.
void requireDense(const VelocityLattice& lattice, double bytes) {
    const openvdb::Vec3d size =
        lattice.active.max().asVec3d() - lattice.active.min().asVec3d() + openvdb::Vec3d(1); // may exceed an int
    requireMemory(bytes * size[0] * size[1] * size[2],
                  fmt::format("a velocity grid in a box of {:.0f} x {:.0f} x {:.0f} voxels", size[0], size[1], size[2]),
                  "use a smaller box, or a grid with fewer voxels");
}

/// Returns the number of cells whose faces are all known. The upper faces of the last active voxels of a staggered grid
/// are beyond the active voxels. If the values there make these voxels as divergence-free as the others, the box is
/// closed (a solver's wall), and the voxels count.
Point cellsOf(const VelocityLattice& lattice) {
    constexpr double kBytes = 2 * 3 * sizeof(double); // of the velocities through faces, twice
    if (lattice.staggered) requireDense(lattice, kBytes);
    Point n;
    for (int axis = 0; axis < 3; ++axis) n[axis] = lattice.active.dim()[axis] - (lattice.staggered ? 1 : 0);
    if (!lattice.staggered || *std::min_element(n.c.begin(), n.c.end()) < 1) return n;
    const FaceVelocities known = facesOf(lattice, n);
    constexpr double kRounding = 1e-5, kMargin = 10;
    const double bar = std::max(kMargin * known.rmsDivergence(), kRounding * known.rms());
    Point closed = n;
    for (int axis = 0; axis < 3; ++axis) {
        const FaceVelocities more = facesOf(lattice, next(n, axis));
        double squares = 0, count = 0;
        Point layer = n;
        layer[axis] = 1;
        Lattice<double>::forEach(layer, [&](Point cell) {
            cell[axis] = n[axis];
            const double d = more.divergence(cell);
            squares += d * d;
            ++count;
        });
        if (std::sqrt(squares / count) <= bar) ++closed[axis];
    }
    return closed;
}

/// Returns the box of the cells in world space.
Box boxOf(const VelocityLattice& lattice, const Point& cells) {
    Vec3d lower, upper;
    for (int k = 0; k < 3; ++k) {
        lower[k] = lattice.active.min()[k] - 0.5;
        upper[k] = lower[k] + std::max(cells[k], 1);
    }
    return worldBox(lattice, lower, upper);
}

/// Returns the cells whose centres are beyond the wall. Throws ValueError if more of the motion is there than in the
/// others, not counting the cells so close to the wall that a flow may fade there, unless the rest is hardly any of it.
Lattice<uint8_t> solidCells(const VelocityLattice& lattice, const FaceVelocities& faces,
                            const std::optional<Wall>& wall) {
    Lattice<uint8_t> solid(faces.cells, 0);
    if (!wall || wall->side == Side::both) return solid;
    const double reach = wall->sdf.reach; // beyond it, distances level off
    const double fade = (VelocityGridOptions{}.wallFade + 0.5) * lattice.voxel;
    const double margin = reach > 0 ? std::min(fade, 0.9 * reach) : fade;
    Lattice<uint8_t> far(faces.cells, 0);
    std::vector<Point> cells;
    std::vector<Vec3d> centres;
    const openvdb::Coord first = lattice.active.min();
    const Matrix3 toWorld = transpose(lattice.axes);
    double beyond = 0, within = 0, all = 0; // sums of squared speeds
    const auto flush = [&] {
        forEachBatch(PointsBy{centres.size(), [&](size_t k) { return centres[k]; }},
                     [&](const PointBatch& points, size_t begin) {
                         JetBatch<double, 0> d;
                         wall->sdf.distance.eval(points, d);
                         for (size_t i = 0; i < static_cast<size_t>(points.size); ++i) {
                             const double depth = beyondWall(wall->side, d.c[0][i]);
                             solid(cells[begin + i]) = depth > 0 ? 1 : 0;
                             far(cells[begin + i]) = std::abs(depth) > margin ? 1 : 0;
                         }
                     });
        cells.clear();
        centres.clear();
    };
    Lattice<double>::forEach(faces.cells, [&](const Point& cell) {
        cells.push_back(cell);
        Vec3d index;
        for (int k = 0; k < 3; ++k) index[k] = first[k] + cell[k];
        centres.push_back(toWorld * ((index - lattice.shift) * lattice.voxel));
        constexpr size_t kTogether = 1 << 16;
        if (cells.size() == kTogether) flush();
    });
    flush();
    Lattice<double>::forEach(faces.cells, [&](const Point& cell) {
        double energy = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const double v = 0.5 * (faces[axis](cell) + faces[axis](next(cell, axis)));
            energy += v * v;
        }
        all += energy;
        if (far(cell)) (solid(cell) ? beyond : within) += energy;
    });
    if (constexpr double kHardly = 0.01; beyond > within && beyond > kHardly * all)
        throw ValueError(
            fmt::format("{:.0f} % of the motion of the velocity grid is on the wrong side of the wall, so the wall "
                        "seems to be inside out; choose the other side (side=)",
                        100 * beyond / (beyond + within)));
    return solid;
}

/// Stops the flow through the faces of solid cells.
void close(FaceVelocities& faces, const Lattice<uint8_t>& solid) {
    Lattice<double>::forEach(faces.cells, [&](const Point& cell) {
        if (!solid(cell)) return;
        for (int axis = 0; axis < 3; ++axis) faces[axis](cell) = faces[axis](next(cell, axis)) = 0;
    });
}

double rmsDifference(const FaceVelocities& a, const FaceVelocities& b) {
    FaceVelocities difference = a;
    for (int axis = 0; axis < 3; ++axis)
        Lattice<double>::forEach(a[axis].size(), [&](const Point& face) { difference[axis](face) -= b[axis](face); });
    return difference.rms();
}

/// Returns the corners of solid cells and of the sides of the box through which nothing flows.
Lattice<uint8_t> stationaryCorners(const FaceVelocities& faces, const Lattice<uint8_t>& solid) {
    const Point corners = next(next(next(faces.cells, 0), 1), 2);
    Lattice<uint8_t> stationary(corners, 0);
    Lattice<uint8_t>::forEach(faces.cells, [&](const Point& cell) {
        if (!solid(cell)) return;
        for (int corner = 0; corner < 8; ++corner) {
            Point p = cell;
            for (int k = 0; k < 3; ++k) p[k] += corner >> k & 1;
            stationary(p) = 1;
        }
    });
    for (int axis = 0; axis < 3; ++axis)
        for (const bool upper : {false, true}) {
            if (!faces.closed(axis, upper)) continue;
            Point side = corners;
            side[axis] = 1;
            Lattice<uint8_t>::forEach(side, [&](Point p) {
                if (upper) p[axis] = faces.cells[axis];
                stationary(p) = 1;
            });
        }
    return stationary;
}

} // namespace

Flow sampledFlow(const VelocityGrids& grids, GridSampling sampling, const Monitor& monitor) {
    const VelocityLattice lattice = latticeOf(grids);
    Flow::Components along{componentField(lattice, 0, sampling, monitor), componentField(lattice, 1, sampling, monitor),
                           componentField(lattice, 2, sampling, monitor)};
    const Domain domain{.box = boxOf(lattice, cellsOf(lattice)), .wall = {}};
    if (lattice.alongWorld()) return Flow::ofComponents(std::move(along), domain);
    const auto world = [&](int k) {
        return lattice.axes[0][k] * along[0] + lattice.axes[1][k] * along[1] + lattice.axes[2][k] * along[2];
    };
    return Flow::ofComponents({world(0), world(1), world(2)}, domain);
}

PotentialFlow potentialFlow(const VelocityGrids& grids, const PotentialFlowOptions& options, const Monitor& monitor) {
    const VelocityLattice lattice = latticeOf(grids);
    const Point n = cellsOf(lattice);
    for (int axis = 0; axis < 3; ++axis)
        if (constexpr int kMin = 4; n[axis] < kMin) // of the splines
            throw ValueError(
                fmt::format("potentials need a velocity grid of at least {} voxels along each axis, but "
                            "this one has {} along {}",
                            kMin, n[axis], "xyz"[axis]));
    constexpr double kBytesEach = 350 + 8 * 15; // of a Poisson solver, and of the lattices
    requireMemory(kBytesEach * n[0] * n[1] * n[2],
                  fmt::format("the potentials of a velocity grid of {} x {} x {} voxels", n[0], n[1], n[2]),
                  "use a grid with fewer voxels");
    const FaceVelocities given = facesOf(lattice, n);
    const double scale = given.rms();
    if (!(scale > 0)) throw ValueError("the velocity grid does not move: all its values are zero");
    FaceVelocities faces = given;
    const Lattice<uint8_t> solid = solidCells(lattice, faces, options.wall);
    close(faces, solid);
    monitor.check();
    const Projection projection = project(faces, solid, monitor);
    const Gauge gauge = gauged(sweep(faces), stationaryCorners(faces, solid), monitor);

    // The lattice of corners begins half a voxel below the centre of the first voxel.
    const openvdb::Coord first = lattice.active.min();
    LatticeFrame frame{lattice.toIndex, lattice.shift};
    for (int k = 0; k < 3; ++k) frame.shift[k] += 0.5 - first[k];
    const Domain domain{.box = boxOf(lattice, n), .wall = options.wall};
    const auto ramp = options.wall ? std::optional(layerRamp(*options.wall)) : std::nullopt;
    std::vector<Flow::Potentials> terms;
    for (int axis = 0; axis < 3; ++axis) {
        const ScalarField psi =
            edgeSpline(gauge.potentials, axis, frame, lattice.mirrored ? -lattice.voxel : lattice.voxel);
        terms.push_back({ramp ? psi * *ramp : psi, rampField(lattice.axes[axis])});
    }
    return {.flow = Flow(std::move(terms), domain),
            .cells = n,
            .divergence = given.rmsDivergence() / scale,
            .change = rmsDifference(faces, given) / scale,
            .residual = projection.residual,
            .iterations = projection.iterations + gauge.iterations,
            .channels = gauge.channels};
}

} // namespace curlew
