#include "curlew/vdb/PointFile.h"

#include "ChunkedWriter.h"
#include "VoxelSize.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/base/Error.h"
#include "curlew/base/Parallel.h"

#include <fmt/compile.h>
#include <fmt/format.h>
#include <openvdb/openvdb.h>
#include <openvdb/points/AttributeArray.h>
#include <openvdb/points/PointAttribute.h>
#include <openvdb/points/PointConversion.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

namespace curlew {

namespace {

namespace fs = std::filesystem;
namespace points = openvdb::points;

constexpr size_t kGrain = 4096;

void checkArrays(const Particles& particles) {
    const size_t size = particles.size();
    const auto whole = [size](const auto&... arrays) { return ((arrays.size() == size) && ...); };
    const auto wholeOrNone = [&](const auto&... arrays) { return (arrays.empty() && ...) || whole(arrays...); };
    if (!whole(particles.y, particles.z, particles.id) || !wholeOrNone(particles.vx, particles.vy, particles.vz))
        throw ValueError(
            fmt::format("the arrays of the particles differ in length (x has {}, y {}, z {}, id {}, vx {}, vy {}, "
                        "vz {}); give each as many values, or no velocity",
                        size, particles.y.size(), particles.z.size(), particles.id.size(), particles.vx.size(),
                        particles.vy.size(), particles.vz.size()));
    if (!wholeOrNone(particles.age) || !wholeOrNone(particles.life) || !wholeOrNone(particles.f, particles.g))
        throw ValueError(
            fmt::format("the arrays of the particles differ in length (x has {}, age {}, life {}, f {}, g {}); give "
                        "each as many values, or none",
                        size, particles.age.size(), particles.life.size(), particles.f.size(), particles.g.size()));
}

void checkIds(const Particles& particles) {
    for (const int64_t id : particles.id)
        if (!std::in_range<int32_t>(id))
            throw ValueError(
                fmt::format("the particle id {} does not fit in 32 bits, which is what point files hold; "
                            "number the particles from 0, or write .csv",
                            id));
}

// ---- Grids of points

/// The particles' arrays as OpenVDB's point tools ask for them.
struct Positions {
    using value_type = openvdb::Vec3d; // NOLINT: OpenVDB's name for it
    using PosType = openvdb::Vec3d;
    const Particles& particles;

    size_t size() const { return particles.size(); }
    void getPos(size_t n, PosType& position) const { position = {particles.x[n], particles.y[n], particles.z[n]}; }
};

struct Velocities {
    using value_type = openvdb::Vec3s; // NOLINT: OpenVDB's name for it
    const Particles& particles;

    void get(value_type& v, openvdb::Index64 n, openvdb::Index) const {
        v = {particles.vx[n], particles.vy[n], particles.vz[n]};
    }
};

struct Ids {
    using value_type = int32_t; // NOLINT: OpenVDB's name for it
    const Particles& particles;

    void get(value_type& id, openvdb::Index64 n, openvdb::Index) const { id = int32_t(particles.id[n]); }
};

/// What is written of one number a particle, as float, under the names that files give it.
struct Scalar {
    const char* name;
    std::vector<float> Particles::*floats = nullptr;
    std::vector<double> Particles::*doubles = nullptr;

    bool in(const Particles& p) const { return floats ? !(p.*floats).empty() : !(p.*doubles).empty(); }
    float of(const Particles& p, size_t n) const {
        return floats ? (p.*floats)[n] : static_cast<float>((p.*doubles)[n]);
    }
    void resize(Particles& p, size_t size) const { floats ? (p.*floats).resize(size) : (p.*doubles).resize(size); }
    void set(Particles& p, size_t n, float value) const {
        if (floats)
            (p.*floats)[n] = value;
        else
            (p.*doubles)[n] = static_cast<double>(value);
    }
};

const std::array<Scalar, 4> kScalars{{{"age", &Particles::age, nullptr},
                                      {"life", &Particles::life, nullptr},
                                      {"f", nullptr, &Particles::f},
                                      {"g", nullptr, &Particles::g}}};

std::vector<Scalar> scalarsOf(const Particles& particles) {
    std::vector<Scalar> scalars;
    for (const Scalar& scalar : kScalars)
        if (scalar.in(particles)) scalars.push_back(scalar);
    return scalars;
}

struct ScalarValues {
    using value_type = float; // NOLINT: OpenVDB's name for it
    const Particles& particles;
    const Scalar& scalar;

    void get(value_type& value, openvdb::Index64 n, openvdb::Index) const { value = scalar.of(particles, n); }
};

struct Bounds {
    std::array<double, 3> low, high;

    /// Throws ValueError if a position is not finite.
    explicit Bounds(const Particles& particles) {
        const std::array<const std::vector<double>*, 3> axes{&particles.x, &particles.y, &particles.z};
        size_t bad = 0;
        for (size_t axis = 0; axis < 3; ++axis) {
            low[axis] = std::numeric_limits<double>::infinity(), high[axis] = -low[axis];
            for (const double value : *axes[axis]) {
                bad += !std::isfinite(value);
                low[axis] = std::min(low[axis], value), high[axis] = std::max(high[axis], value);
            }
        }
        if (bad > 0)
            throw ValueError(
                fmt::format("{} coordinates of the {} particles are not finite numbers; leave those particles out", bad,
                            particles.size()));
    }

    double extent() const { return std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]}); }

    double largest() const {
        double result = 0;
        for (size_t axis = 0; axis < 3; ++axis) result = std::max({result, -low[axis], high[axis]});
        return result;
    }
};

constexpr double kMaxCoordinate = 1 << 30; // in voxels, so that neighbours are still 32-bit numbers

uint64_t spread(uint64_t bits21) {
    uint64_t spread = 0;
    for (int bit = 0; bit < 21; ++bit) spread |= (bits21 >> bit & 1) << 3 * bit;
    return spread;
}

/// The edge of the cells, of an octree around all particles, of which the particles occupy one for every eight. Where
/// two neighbours in Morton order part is the level from which on they occupy two cells: one sort counts all levels.
double chosenVoxelSize(const Particles& particles, const Bounds& bounds) {
    constexpr int kLevels = 21;
    constexpr double kPointsPerVoxel = 8;
    const double least = std::max(kLeastVoxel, bounds.largest() / kMaxCoordinate);
    const double extent = bounds.extent();
    if (!(extent > 0)) return std::max(least, 0.1);

    std::array<uint64_t, 128> spreads; // of 7 bits each
    for (uint64_t bits = 0; bits < spreads.size(); ++bits) spreads[bits] = spread(bits);
    const double scale = ((1 << kLevels) - 1) / extent;
    std::vector<uint64_t> codes(particles.size());
    parallelFor(codes.size(), kGrain, [&](size_t begin, size_t end) {
        const auto code = [&](double value, double low) {
            const auto cell = std::min(uint64_t((value - low) * scale), uint64_t((1 << kLevels) - 1));
            return spreads[cell & 127] | spreads[cell >> 7 & 127] << 21 | spreads[cell >> 14] << 42;
        };
        for (size_t n = begin; n < end; ++n)
            codes[n] = code(particles.x[n], bounds.low[0]) << 2 | code(particles.y[n], bounds.low[1]) << 1 |
                       code(particles.z[n], bounds.low[2]);
    });
    tbb::parallel_sort(codes);

    std::array<size_t, kLevels + 1> cells{1}; // occupied at each level
    for (size_t n = 1; n < codes.size(); ++n)
        if (codes[n] != codes[n - 1]) ++cells[1 + (size_t(std::countl_zero(codes[n] ^ codes[n - 1])) - 1) / 3];
    std::partial_sum(cells.begin(), cells.end(), cells.begin());

    const double wanted = std::max(1.0, double(particles.size()) / kPointsPerVoxel);
    size_t level = 1;
    while (level < kLevels && double(cells[level]) < wanted) ++level;
    const double above = std::log(double(cells[level - 1])), below = std::log(double(cells[level]));
    const double part = below > above ? std::clamp((std::log(wanted) - above) / (below - above), 0.0, 1.0) : 0.0;
    return std::max(least, extent * std::exp2(-(double(level) - 1 + part)));
}

void checkVoxelSize(double voxelSize, const Bounds& bounds) {
    const double least = std::max(kLeastVoxel, bounds.largest() / kMaxCoordinate);
    if (!(voxelSize >= least) || !std::isfinite(voxelSize * voxelSize * voxelSize))
        throw ValueError(
            fmt::format("the voxel size {:g} of the points is unusable; for these positions give at least {:g}, "
                        "or 0 to have it chosen",
                        voxelSize, least));
}

const points::AttributeArray& attributeOf(const points::PointDataTree::LeafNodeType& leaf, const std::string& name) {
    const size_t position = leaf.attributeSet().find(name);
    if (position >= leaf.attributeSet().size())
        throw ValueError(
            fmt::format("some points of the grid have no attribute '{}'; give all of them one, or none", name));
    return leaf.constAttributeArray(position);
}

template <typename T>
points::AttributeHandle<T> handleOf(const points::AttributeArray& array, const std::string& name) {
    if (array.valueType() != openvdb::typeNameAsString<T>())
        throw ValueError(fmt::format("the attribute '{}' of the points is of type {}; give it the type {}", name,
                                     array.valueType(), openvdb::typeNameAsString<T>()));
    return points::AttributeHandle<T>(array);
}

template <typename T>
void readIds(const points::AttributeArray& array, int64_t* ids) {
    const points::AttributeHandle<T> handle(array);
    for (openvdb::Index n = 0; n < handle.size(); ++n) ids[n] = handle.get(n);
}

template <typename T>
void reorder(std::vector<T>& values, const std::vector<size_t>& order) {
    if (values.empty()) return;
    std::vector<T> sorted(values.size());
    parallelFor(values.size(), kGrain, [&](size_t begin, size_t end) {
        for (size_t n = begin; n < end; ++n) sorted[n] = values[order[n]];
    });
    values = std::move(sorted);
}

void sortById(Particles& particles) {
    if (std::is_sorted(particles.id.begin(), particles.id.end())) return;
    std::vector<size_t> order(particles.size());
    std::iota(order.begin(), order.end(), size_t(0));
    tbb::parallel_sort(
        order, [&](size_t a, size_t b) { return std::pair(particles.id[a], a) < std::pair(particles.id[b], b); });
    forEachArray(particles, [&](auto& values) { reorder(values, order); });
}

// ---- Flat files

} // namespace

points::PointDataGrid::Ptr pointGrid(const Particles& particles, const PointGridOptions& options) {
    openvdb::initialize();
    checkArrays(particles);
    checkIds(particles);
    auto grid = points::PointDataGrid::create();
    if (particles.size() > 0) {
        const Bounds bounds(particles);
        const double voxelSize = options.voxelSize == 0 ? chosenVoxelSize(particles, bounds) : options.voxelSize;
        checkVoxelSize(voxelSize, bounds);
        const auto transform = openvdb::math::Transform::createLinearTransform(voxelSize);
        const Positions positions{particles};
        const auto index = openvdb::tools::createPointIndexGrid<openvdb::tools::PointIndexGrid>(positions, *transform);
        grid = points::createPointDataGrid<points::NullCodec, points::PointDataGrid>(*index, positions, *transform);
        if (particles.hasVelocity()) {
            points::appendAttribute<openvdb::Vec3s>(grid->tree(), options.velocity);
            points::populateAttribute(grid->tree(), index->tree(), options.velocity, Velocities{particles});
        }
        points::appendAttribute<int32_t>(grid->tree(), "id");
        points::populateAttribute(grid->tree(), index->tree(), "id", Ids{particles});
        for (const Scalar& scalar : scalarsOf(particles)) {
            points::appendAttribute<float>(grid->tree(), scalar.name);
            points::populateAttribute(grid->tree(), index->tree(), scalar.name, ScalarValues{particles, scalar});
        }
    }
    grid->setName(options.name);
    if (particles.hasVelocity()) grid->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
    return grid;
}

Particles particlesOf(const points::PointDataGrid& grid) {
    using Leaf = points::PointDataTree::LeafNodeType;
    std::vector<const Leaf*> leaves;
    std::vector<size_t> starts{0};
    std::string velocity; // its name, if there is one
    bool hasIds = false;
    std::vector<Scalar> scalars;
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
        if (leaf->getLastValue() == 0) continue;
        leaves.push_back(&*leaf);
        starts.push_back(starts.back() + leaf->getLastValue());
        for (const char* name : {"velocity", "v"})
            if (leaf->hasAttribute(name)) velocity = name;
        hasIds = hasIds || leaf->hasAttribute("id");
    }

    for (const Scalar& scalar : kScalars)
        if (!leaves.empty() && leaves.front()->hasAttribute(scalar.name) &&
            attributeOf(*leaves.front(), scalar.name).valueType() == openvdb::typeNameAsString<float>())
            scalars.push_back(scalar);
    Particles particles;
    const size_t size = starts.back();
    for (auto* values : {&particles.x, &particles.y, &particles.z}) values->resize(size);
    if (!velocity.empty())
        for (auto* values : {&particles.vx, &particles.vy, &particles.vz}) values->resize(size);
    for (const Scalar& scalar : scalars) scalar.resize(particles, size);
    particles.id.resize(size);
    if (!hasIds) std::iota(particles.id.begin(), particles.id.end(), int64_t(0));

    const auto readLeaf = [&](const Leaf& leaf, size_t start) {
        leaf.validateOffsets();
        const auto positions = handleOf<openvdb::Vec3s>(attributeOf(leaf, "P"), "P");
        openvdb::Index n = 0;
        for (openvdb::Index voxel = 0; voxel < Leaf::SIZE; ++voxel) {
            const openvdb::Vec3d corner = leaf.offsetToGlobalCoord(voxel).asVec3d();
            for (const openvdb::Index end = leaf.getValue(voxel); n < end; ++n) {
                const openvdb::Vec3d world = grid.indexToWorld(corner + openvdb::Vec3d(positions.get(n)));
                particles.x[start + n] = world.x(), particles.y[start + n] = world.y(),
                                    particles.z[start + n] = world.z();
            }
        }
        if (!velocity.empty()) {
            const auto velocities = handleOf<openvdb::Vec3s>(attributeOf(leaf, velocity), velocity);
            for (openvdb::Index k = 0; k < n; ++k) {
                const openvdb::Vec3s v = velocities.get(k);
                particles.vx[start + k] = v.x(), particles.vy[start + k] = v.y(), particles.vz[start + k] = v.z();
            }
        }
        for (const Scalar& scalar : scalars) {
            const auto values = handleOf<float>(attributeOf(leaf, scalar.name), scalar.name);
            for (openvdb::Index k = 0; k < n; ++k) scalar.set(particles, start + k, values.get(k));
        }
        if (hasIds) {
            const points::AttributeArray& ids = attributeOf(leaf, "id");
            if (ids.valueType() == openvdb::typeNameAsString<int64_t>())
                readIds<int64_t>(ids, &particles.id[start]);
            else if (ids.valueType() == openvdb::typeNameAsString<int32_t>())
                readIds<int32_t>(ids, &particles.id[start]);
            else
                throw ValueError(
                    fmt::format("the attribute 'id' of the points is of type {}; give it the type int32 or int64",
                                ids.valueType()));
        }
    };
    parallelFor(leaves.size(), 16, [&](size_t begin, size_t end) {
        for (size_t n = begin; n < end; ++n) readLeaf(*leaves[n], starts[n]);
    });
    if (particles.f.size() != particles.g.size())
        for (auto* half : {&particles.f, &particles.g}) half->clear(); // no track
    if (hasIds) sortById(particles);
    return particles;
}

void writePly(const fs::path& path, const Particles& particles) {
    checkArrays(particles);
    checkIds(particles);
    const bool velocity = particles.hasVelocity();
    const std::vector<Scalar> scalars = scalarsOf(particles);
    writeAtomically(path, [&](std::ostream& out) {
        static_assert(std::endian::native == std::endian::little, "the records are written as they are in memory");
        out << "ply\nformat binary_little_endian 1.0\nelement vertex " << particles.size() << '\n';
        for (const char* property : {"x", "y", "z"}) out << "property float " << property << '\n';
        if (velocity)
            for (const char* property : {"vx", "vy", "vz"}) out << "property float " << property << '\n';
        out << "property int id\n";
        for (const Scalar& scalar : scalars) out << "property float " << scalar.name << '\n';
        out << "end_header\n";
        writeChunks(out, particles.size(), [&](size_t begin, size_t end, std::string& piece) {
            const auto append = [&piece](auto value) {
                piece.append(reinterpret_cast<const char*>(&value), sizeof value);
            };
            for (size_t n = begin; n < end; ++n) {
                append(float(particles.x[n])), append(float(particles.y[n])), append(float(particles.z[n]));
                if (velocity) append(particles.vx[n]), append(particles.vy[n]), append(particles.vz[n]);
                append(int32_t(particles.id[n]));
                for (const Scalar& scalar : scalars) append(scalar.of(particles, n));
            }
        });
    });
}

void writeCsv(const fs::path& path, const Particles& particles) {
    checkArrays(particles);
    const bool velocity = particles.hasVelocity();
    const std::vector<Scalar> scalars = scalarsOf(particles);
    writeAtomically(path, [&](std::ostream& out) {
        out << (velocity ? "x,y,z,vx,vy,vz,id" : "x,y,z,id");
        for (const Scalar& scalar : scalars) out << ',' << scalar.name;
        out << '\n';
        writeChunks(out, particles.size(), [&](size_t begin, size_t end, std::string& piece) {
            const auto to = std::back_inserter(piece);
            for (size_t n = begin; n < end; ++n) {
                fmt::format_to(to, FMT_COMPILE("{:.9g},{:.9g},{:.9g},"), particles.x[n], particles.y[n],
                               particles.z[n]);
                if (velocity)
                    fmt::format_to(to, FMT_COMPILE("{:.9g},{:.9g},{:.9g},"), particles.vx[n], particles.vy[n],
                                   particles.vz[n]);
                fmt::format_to(to, FMT_COMPILE("{}"), particles.id[n]);
                for (const Scalar& scalar : scalars)
                    fmt::format_to(to, FMT_COMPILE(",{:.9g}"), scalar.of(particles, n));
                piece += '\n';
            }
        });
    });
}

} // namespace curlew
