// SPDX-License-Identifier: Apache-2.0
#include "Tables.h"
#include "curlew/field/NoiseField.h"
#include "curlew/track/Advect.h"
#include "curlew/track/Neighbours.h"
#include "curlew/track/Scatter.h"
#include "curlew/vdb/GridFlow.h"
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/VelocityGrid.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <string_view>

namespace curlew::paper {

namespace {

constexpr double kPi = std::numbers::pi;
using Velocity = Vec3d (*)(const Vec3d&);
using Clock = std::chrono::steady_clock;

Vec3d abc(const Vec3d& p) {
    return {{std::sin(p[2]) + 0.43 * std::cos(p[1]), 0.7 * std::sin(p[0]) + std::cos(p[2]),
             0.43 * std::sin(p[1]) + 0.7 * std::cos(p[0])}};
}

Vec3d taylorGreen(const Vec3d& p) {
    return {{std::sin(p[0]) * std::cos(p[1]) * std::cos(p[2]), std::cos(p[0]) * std::sin(p[1]) * std::cos(p[2]),
             -2 * std::cos(p[0]) * std::cos(p[1]) * std::sin(p[2])}};
}

/// The ABC flow, turned, so that no component is constant along its own axis.
Vec3d turnedAbc(const Vec3d& p) {
    const double c = std::cos(0.6), s = std::sin(0.6), d = std::cos(0.4), e = std::sin(0.4);
    const std::array<Vec3d, 3> axes{{{{c, s, 0}}, {{-s * d, c * d, e}}, {{s * e, -c * e, d}}}};
    const Vec3d v = abc({{dot(axes[0], p), dot(axes[1], p), dot(axes[2], p)}});
    return axes[0] * v[0] + axes[1] * v[1] + axes[2] * v[2];
}

/// Returns the averages over the faces of n³ voxels in the cube from 0 to `edge`, by 3 x 3 Gauss points.
openvdb::Vec3SGrid::Ptr staggeredGrid(Velocity velocity, int n, double edge) {
    const double h = edge / n;
    const std::array<double, 3> x{-std::sqrt(0.15), 0, std::sqrt(0.15)}, w{5.0 / 18, 8.0 / 18, 5.0 / 18};
    const auto average = [&](Vec3d centre, int axis) {
        double sum = 0;
        for (size_t a = 0; a < 3; ++a)
            for (size_t b = 0; b < 3; ++b) {
                Vec3d p = centre;
                p[(axis + 1) % 3] += x[a] * h;
                p[(axis + 2) % 3] += x[b] * h;
                sum += w[a] * w[b] * velocity(p)[axis];
            }
        return static_cast<float>(sum);
    };
    auto grid = openvdb::Vec3SGrid::create();
    grid->setTransform(openvdb::math::Transform::createLinearTransform(h));
    grid->transform().postTranslate(openvdb::Vec3d(h / 2));
    grid->setGridClass(openvdb::GRID_STAGGERED);
    for (int i = 0; i <= n; ++i)
        for (int j = 0; j <= n; ++j)
            for (int k = 0; k <= n; ++k) {
                openvdb::Vec3s v;
                for (int axis = 0; axis < 3; ++axis) {
                    Vec3d face{{(i + 0.5) * h, (j + 0.5) * h, (k + 0.5) * h}};
                    face[axis] -= h / 2;
                    v[axis] = average(face, axis);
                }
                grid->tree().setValueOn({i, j, k}, v);
            }
    return grid;
}

double seconds(Clock::time_point since) { return std::chrono::duration<double>(Clock::now() - since).count(); }

struct Accuracy {
    double error = 0;      ///< Rms, relative to the rms velocity.
    double divergence = 0; ///< Rms by central differences over a quarter of a voxel, relative to the velocity gradient.
    double nanoseconds = 0;
};

Accuracy accuracyOf(const Flow& flow, Velocity exact, double edge, double voxel) {
    const Box box = Box{{{0, 0, 0}}, {{edge, edge, edge}}}.padded(-3 * voxel);
    const Points points = scatter({.box = box, .wall = {}}, 4096, 3);
    double errors = 0, squares = 0, divergences = 0, gradients = 0;
    const double step = voxel / 8;
    for (size_t k = 0; k < points.size(); ++k) {
        const Vec3d p = points.position(k), v = exact(p), e = flow.at(p).velocity - v;
        errors += dot(e, e);
        squares += dot(v, v);
        double sum = 0;
        for (int axis = 0; axis < 3; ++axis) {
            Vec3d d;
            d[axis] = step;
            const Vec3d column = (flow.at(p + d).velocity - flow.at(p - d).velocity) * (0.5 / step);
            sum += column[axis];
            gradients += dot(column, column);
        }
        divergences += sum * sum;
    }
    const auto begin = Clock::now();
    const auto batches = static_cast<int>(points.size() / kBatch);
    for (int b = 0; b < batches; ++b) {
        PointBatch batch;
        for (int i = 0; i < kBatch; ++i) batch.push(points.position(static_cast<size_t>(b * kBatch + i)));
        VecBatch<double> c;
        flow.velocity(batch, c);
    }
    return {std::sqrt(errors / squares), std::sqrt(divergences / gradients),
            1e9 * seconds(begin) / static_cast<double>(points.size())};
}

void writeAccuracy(std::ostream& out, std::vector<std::string>& broken, std::string_view name, Velocity velocity,
                   double edge, const std::vector<int>& sizes) {
    Accuracy before{};
    for (const int n : sizes) {
        const auto grid = staggeredGrid(velocity, n, edge);
        const double voxel = edge / n;
        const auto begin = Clock::now();
        const PotentialFlow made = potentialFlow({grid});
        const double took = seconds(begin);
        const Accuracy linear = accuracyOf(sampledFlow({grid}), velocity, edge, voxel),
                       cubic = accuracyOf(sampledFlow({grid}, GridSampling::cubic), velocity, edge, voxel),
                       exact = accuracyOf(made.flow, velocity, edge, voxel);
        const std::string order = before.error > 0 ? fmt::format("{:.2f}", std::log2(before.error / exact.error)) : "";
        out << fmt::format(
            "| {} | {}³ | {:.1e} | {:.1e} | {:.1e} | {} | {:.1e} | {:.1e} | {:.1e} | {:.0f} / {:.0f} / "
            "{:.0f} | {:.2f} |\n",
            name, n, linear.error, cubic.error, exact.error, order, linear.divergence, cubic.divergence,
            exact.divergence, linear.nanoseconds, cubic.nanoseconds, exact.nanoseconds, took);
        if (!(exact.error < linear.error / 4))
            broken.push_back(fmt::format("{}, {}³: the error {:.2g} is not below a quarter of the trilinear {:.2g}",
                                         name, n, exact.error, linear.error));
        if (!(exact.divergence < linear.divergence / 10))
            broken.push_back(fmt::format("{}, {}³: the divergence {:.2g} is not a tenth of the trilinear {:.2g}", name,
                                         n, exact.divergence, linear.divergence));
        before = exact;
    }
}

double meanNearest(const Points& points) {
    std::vector<Vec3d> positions;
    for (size_t k = 0; k < points.size(); ++k) positions.push_back(points.position(k));
    const auto distances = Neighbours(positions).nearestDistances();
    double sum = 0;
    for (const double d : distances) sum += d;
    return sum / static_cast<double>(distances.size());
}

void writeContained(std::ostream& out, std::vector<std::string>& broken, int n, size_t count) {
    constexpr double kFrames = 100, kFramesPerSecond = 24;
    const Wall wall{.sdf = sphereSdf(1), .side = Side::inside, .width = 0.2};
    const auto noise = [](uint64_t seed) { return noiseField<Psrd3>({.seed = seed}, {.frequency = 1.5}); };
    const Flow source = withSpeed(Flow(noise(1), bounded(noise(2), wall), Domain::of(wall)), 1);
    const double voxel = 2.0 / n;
    const auto grid = velocityGrid(source, {.voxel = voxel, .layout = Layout::staggered});
    Wall solver = wall;
    solver.width = 2 * voxel;
    const Flow exact = potentialFlow({grid}, {.wall = solver}).flow;
    struct Way {
        std::string_view name;
        Flow flow;
        AdvectOptions options;
        bool contained;
    };
    const AdvectOptions whole{.time = kFrames / kFramesPerSecond, .steps = static_cast<int>(kFrames)};
    AdvectOptions split = whole;
    split.splitting = Splitting::strang;
    const Way ways[] = {{"trilinear", sampledFlow({grid}), whole, false},
                        {"tricubic", sampledFlow({grid}, GridSampling::cubic), whole, false},
                        {"exact, as a whole", exact, whole, true},
                        {"exact, term by term", exact, split, true}};
    const Points start = scatter(source.domain(), count, 5);
    const double before = meanNearest(start);
    for (const Way& way : ways) {
        Points points = start;
        const auto begin = Clock::now();
        advect(way.flow, points, way.options);
        const double took = seconds(begin);
        size_t outside = 0;
        for (size_t k = 0; k < points.size(); ++k)
            outside += wall.sdf.distance.at<0>(points.position(k)).value > 0 ? 1 : 0;
        const double nearest = meanNearest(points) / before;
        out << fmt::format("| {} | {} | {:.3f} | {:.2f} |\n", way.name, outside, nearest, took);
        if (way.contained && outside > 0) broken.push_back(fmt::format("{}: {} points are outside", way.name, outside));
        // The mean of a uniform sample of this size varies by 0.36 / sqrt(count), a quarter of the bar at 5,000.
        if (way.contained && !(std::abs(nearest - 1) < 0.05 + 1 / std::sqrt(static_cast<double>(count))))
            broken.push_back(fmt::format("{}: the mean distance to the nearest point is {:.3f} of that of the start",
                                         way.name, nearest));
    }
}

} // namespace

std::vector<std::string> gridFlowTable(const TableRun& run, std::ostream& out) {
    std::vector<std::string> broken;
    std::vector<int> sizes{8, 16};
    if (run.scale > 0.1) sizes.push_back(32);
    if (run.scale > 0.5) sizes.push_back(64);
    out << "## A velocity grid as a flow\n\nStaggered grids of flows that are known: averages over the faces of the "
           "voxels, "
           "rounded to float. Trilinear and tricubic interpolation of the grid, and its potentials (`-flow exact=1`). "
           "Errors "
           "are rms, relative to the rms velocity, at 4,096 points at least three voxels away from the sides. "
           "Divergences are rms, "
           "by "
           "central differences over a quarter of a voxel, relative to the velocity gradient. Those of the exact flow "
           "are "
           "the error of these differences.\n\n"
           "| flow | voxels | error, trilinear | tricubic | exact | order | divergence, trilinear | tricubic | exact | "
           "ns for each point (in turn) | seconds for the potentials "
           "|\n|---|---|---|---|---|---|---|---|---|---|---|\n";
    writeAccuracy(out, broken, "ABC, turned", turnedAbc, 2 * kPi, sizes);
    writeAccuracy(out, broken, "Taylor-Green", taylorGreen, kPi, sizes);
    const auto count = static_cast<size_t>(std::max(500.0, std::round(20000 * run.scale)));
    const int n = run.scale > 0.1 ? 48 : 20;
    out << fmt::format(
        "\n{} points in the unit ball follow a noise of frequency 1.5 that was sampled on a staggered grid with {} "
        "voxels "
        "across, at an rms speed of 1, for 100 frames at 24 frames per second, in 100 RK4 steps. The distance to the "
        "nearest "
        "point is the mean over all points, relative to the start.\n\n"
        "| interpolation | outside the ball | distance to the nearest point | seconds |\n|---|---|---|---|\n",
        count, n);
    writeContained(out, broken, n, count);
    return broken;
}

} // namespace curlew::paper
