// SPDX-License-Identifier: Apache-2.0
#include "curlew/render/Surface.h"

#include "SurfaceModel.h"
#include "curlew/base/Error.h"
#include "curlew/base/Random.h"
#include "curlew/field/ForEachBatch.h"
#include "curlew/vdb/Openvdb.h"

#include <openvdb/tools/LevelSetFilter.h>

#include <optional>

namespace curlew {

namespace {

constexpr int kMaxSteps = 4096; // maximum steps of a ray through a field; only a ray along the surface takes hundreds
constexpr int kRefinements = 40;

/// The interval of a ray inside a box.
struct Part {
    double begin, end;
    int axis; ///< Axis of the face where it enters; -1: it begins inside.
};

std::optional<Part> partIn(const Box& box, const Ray& ray) {
    Part part{0, std::numeric_limits<double>::infinity(), -1};
    for (int axis = 0; axis < 3; ++axis) {
        const double o = ray.origin[axis], d = ray.direction[axis];
        if (d == 0) {
            if (o < box.lower[axis] || o > box.upper[axis]) return {};
            continue;
        }
        const double a = (box.lower[axis] - o) / d, b = (box.upper[axis] - o) / d;
        if (std::min(a, b) > part.begin) {
            part.begin = std::min(a, b);
            part.axis = axis;
        }
        part.end = std::min(part.end, std::max(a, b));
    }
    if (!(part.begin < part.end)) return {};
    return part;
}

/// The state of a ray that marches through a field.
struct March {
    size_t index;
    Part part;
    double t;
    double side = 0;    ///< The sign, 1 or -1, of the field where the ray began; 0: unknown.
    double below = 0;   ///< The last t on this side.
    double beyond = -1; ///< The first t on the other side; negative: none yet.
    int steps = 0;
};

/// The zero set of a field minus a value.
class FieldSurface final : public Surface::Model {
  public:
    FieldSurface(ScalarField field, double value, double lipschitz, const Box& box, bool solid)
        : mField(std::move(field)), mValue(value), mLipschitz(lipschitz), mBox(box), mSolid(solid) {}

    void intersect(std::span<const Ray> rays, double resolution, std::span<RayHit> hits) const override {
        std::vector<March> marches;
        for (size_t i = 0; i < rays.size(); ++i) {
            hits[i] = {};
            if (const auto part = partIn(mBox, rays[i]))
                marches.push_back({.index = i, .part = *part, .t = part->begin, .below = part->begin});
        }
        JetBatch<double, 1> jets;
        while (!marches.empty()) {
            size_t left = 0;
            for (size_t begin = 0; begin < marches.size(); begin += kBatch) {
                const size_t end = std::min<size_t>(begin + kBatch, marches.size());
                const auto at = [&](size_t k) {
                    const Ray& ray = rays[marches[k].index];
                    return ray.origin + ray.direction * marches[k].t;
                };
                mField.eval(batchOf(PointsBy{end, at}, begin, end), jets);
                for (size_t k = begin; k < end; ++k) {
                    March march = marches[k];
                    const auto jet = jets[static_cast<int>(k - begin)];
                    if (advance(march, jet, rays[march.index], resolution, hits[march.index])) marches[left++] = march;
                }
            }
            marches.resize(left);
        }
    }

  private:
    /// Advances a ray to its next sample, given the field's jet at the current one. Returns false if the ray is done.
    bool advance(March& march, const Jet<double, 3, 1>& jet, const Ray& ray, double resolution, RayHit& hit) const {
        const double value = jet.value - mValue;
        if (march.side == 0) {
            march.side = value < 0 ? -1 : 1;
            if (mSolid && value < 0 && march.part.axis >= 0) { // cut by the box
                hit.distance = march.t;
                hit.normal[march.part.axis] = ray.direction[march.part.axis] > 0 ? -1 : 1;
                return false;
            }
        }
        const double height = march.side * value, slope = march.side * dot(jet.gradient, ray.direction);
        if (!(++march.steps < kMaxSteps)) return false;
        if (march.beyond >= 0) return refine(march, height, slope, jet, ray, resolution, hit);
        if (height <= 0) {
            march.beyond = march.t;
            march.steps = 0;
            return refine(march, height, slope, jet, ray, resolution, hit);
        }
        march.below = march.t;
        const double least = slope < 0 ? std::min(-height / slope, resolution) : resolution;
        march.t += std::max(height / mLipschitz, std::max(least, 1e-3 * resolution));
        if (std::isnan(height) || march.below >= march.part.end) return false;
        march.t = std::min(march.t, march.part.end);
        return true;
    }

    /// Newton's method between two samples on different sides, with bisection if a step would leave the interval.
    static bool refine(March& march, double height, double slope, const Jet<double, 3, 1>& jet, const Ray& ray,
                       double resolution, RayHit& hit) {
        (height > 0 ? march.below : march.beyond) = march.t;
        double next = slope != 0 ? march.t - height / slope : march.t;
        const bool converged = std::abs(next - march.t) <= 1e-9 * resolution || height == 0;
        if (converged || march.steps >= kRefinements || march.beyond - march.below <= 1e-12 * march.beyond) {
            hit = {.distance = march.t, .normal = facing(jet.gradient, ray.direction)};
            return false;
        }
        if (!(next > march.below && next < march.beyond)) next = 0.5 * (march.below + march.beyond);
        march.t = next;
        return true;
    }

    ScalarField mField;
    double mValue, mLipschitz;
    Box mBox;
    bool mSolid;
};

/// Returns 1.5 times the steepest gradient of random samples.
double lipschitzOf(const ScalarField& field, const Box& box) {
    constexpr int kSamples = 4096;
    double steepest = 0;
    PointBatch points;
    JetBatch<double, 1> jets;
    for (uint64_t i = 0; i < kSamples; ++i) {
        Vec3d p = box.lower;
        for (int axis = 0; axis < 3; ++axis)
            p[axis] += box.size()[axis] * randomUniform(0, i, static_cast<uint64_t>(axis));
        points.push(p);
        if (!points.full()) continue;
        field.eval(points, jets);
        for (int k = 0; k < points.size; ++k) steepest = std::max(steepest, length(jets[k].gradient));
        points.size = 0;
    }
    if (!(steepest > 0)) throw ValueError("the field is the same everywhere in the box, so it has no surface there");
    return 1.5 * steepest;
}

const Box& checked(const Box& box) {
    if (!box.finite()) throw ValueError("the surface is infinite; give a box");
    for (int axis = 0; axis < 3; ++axis)
        if (!(box.size()[axis] > 0)) throw ValueError("the box of the surface is empty");
    return box;
}

/// Pads a box slightly, so that it does not cut a surface that touches it.
Box loose(const Box& box) { return box.padded(1e-6 * length(box.size())); }

} // namespace

Surface::Surface(const Sdf& sdf, const Box& box)
    : mBox(checked(box)), mModel(std::make_shared<FieldSurface>(sdf.distance, 0, sdf.lipschitz, loose(box), true)) {}

Surface::Surface(const ScalarField& field, double value, const Box& box, bool solid)
    : mBox(checked(box)),
      mModel(std::make_shared<FieldSurface>(field, value, lipschitzOf(field, box), loose(box), solid)) {}

Surface::Surface(const LevelSet& levelSet) {
    if (levelSet.grid->tree().empty()) throw ValueError("the level set is empty");
    const Sdf sdf = sdfOf(levelSet);
    mBox = checked(sdf.bounds);
    mModel = levelSetModel(levelSet, sdf.distance);
}

Surface::Surface(const Mesh& mesh) : mModel(meshModel(mesh)) {
    mBox = {Vec3d{{1, 1, 1}} * HUGE_VAL, Vec3d{{1, 1, 1}} * -HUGE_VAL};
    for (const auto& p : mesh.points)
        for (int axis = 0; axis < 3; ++axis) {
            mBox.lower[axis] = std::min(mBox.lower[axis], static_cast<double>(p[axis]));
            mBox.upper[axis] = std::max(mBox.upper[axis], static_cast<double>(p[axis]));
        }
}

double Surface::rayOffset() const { return mModel->rayOffset(); }

void Surface::intersect(std::span<const Ray> rays, double resolution, std::span<RayHit> hits) const {
    mModel->intersect(rays, resolution, hits);
}

void Surface::occluded(std::span<const Ray> rays, double resolution, std::span<uint8_t> flags) const {
    mModel->occluded(rays, resolution, flags);
}

LevelSet smoothed(const LevelSet& levelSet, int voxels) {
    if (voxels == 0) return levelSet;
    const auto grid = levelSet.grid->deepCopy();
    openvdb::tools::LevelSetFilter<openvdb::FloatGrid>(*grid).gaussian(voxels);
    return {.grid = grid, .mesh = nullptr};
}

} // namespace curlew
