// SPDX-License-Identifier: Apache-2.0
#include "Redistance.h"

#include "curlew/base/Parallel.h"
#include "curlew/vdb/Openvdb.h"

#include <openvdb/tools/SignedFloodFill.h>
#include <openvdb/util/Util.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

namespace curlew {

namespace {

using openvdb::Coord;
using Accessor = BackwardMap::Accessor;
using Entry = ClosestPoints::Entry;

const auto& kNeighbours = openvdb::util::COORD_OFFSETS; ///< All 26 neighbours.

/// Slides the closest point of an entry along the surface until the vector to the voxel is normal to the surface.
class Slider {
  public:
    /// The entry has a point on the surface. If the normal there is known, at() is already the next point.
    explicit Slider(Entry& entry) : mEntry(&entry), mAt(entry.point) {
        entry.distance = toVoxel(entry.point).length();
        if (entry.normal.lengthSqr() == 0) return;
        mBegun = true;
        mTangential = tangentialAt(entry.point, entry.normal);
        mMoving = slide();
    }

    const openvdb::Vec3d& at() const { return mAt; }
    bool moving() const { return mMoving; }
    /// Returns whether the distance has become noticeably smaller since the last call. At an edge of the surface,
    /// points zigzag with ever shorter steps.
    bool hasImproved() { return std::exchange(mLast, mEntry->distance) - mEntry->distance > kNoticeable; }
    /// Returns whether the remaining tangential distance is so small that it changes the distance only in second order.
    bool converged() const { return mTangential.length() < kSlow; }

    /// Takes the next step, given the sample at at() if it is known. Afterwards, the point may be no longer moving().
    void next(bool known, const BackwardMap::Sample& sample) { mMoving = step(known, sample); }

  private:
    // Tolerances in voxels: on the distance of the point from the surface and on that of the voxel.
    static constexpr double kOnSurface = 5e-4, kDistance = 2e-6;
    static constexpr double kSlow = 0.02, kLongest = 1, kNoticeable = 5e-3; // voxels
    static constexpr int kMaxCorrections = 4;

    openvdb::Vec3d toVoxel(const openvdb::Vec3d& point) const { return mEntry->voxel.asVec3d() - point; }
    openvdb::Vec3d tangentialAt(const openvdb::Vec3d& point, const openvdb::Vec3d& normal) const {
        return toVoxel(point) - normal * toVoxel(point).dot(normal);
    }

    bool step(bool known, const BackwardMap::Sample& sample) {
        const double slope = sample.gradient.length();
        if (!known || !(slope > 0)) return retreat(); // outside the known region
        const openvdb::Vec3d normal = sample.gradient / slope;
        const double off = sample.phi / slope;
        mAt -= normal * std::clamp(off, -kLongest, kLongest);
        // The correction leaves about off², times half a curvature.
        if (off * off > kOnSurface) return ++mCorrections <= kMaxCorrections || retreat();
        const double distance = toVoxel(mAt).length();
        if (mBegun && !(distance < mEntry->distance)) return retreat();
        const openvdb::Vec3d tangential = tangentialAt(mAt, normal);
        if (mBegun) {
            // Barzilai and Borwein (1988): the step length that would have been right for the last step.
            const openvdb::Vec3d moved = mAt - mEntry->point;
            const double change = moved.dot(mTangential - tangential);
            mPace = change > 0 ? std::clamp(moved.dot(moved) / change, 0.05, 4.0) : std::min(2 * mPace, 4.0);
        }
        mBegun = true;
        mEntry->point = mAt;
        mEntry->normal = normal;
        mEntry->distance = distance;
        mTangential = tangential;
        return slide();
    }
    bool retreat() {
        if (!mBegun) return false;
        mPace *= 0.3;
        return slide();
    }
    /// Tries the next point, unless the distance would hardly change.
    bool slide() {
        mCorrections = 0;
        const double length = mPace * mTangential.length();
        if (length * mTangential.length() < kDistance * mEntry->distance) return false;
        mAt = mEntry->point + mTangential * (mPace * std::min(kLongest / length, 1.0));
        return true;
    }

    Entry* mEntry;      // its point is the best so far
    openvdb::Vec3d mAt; // the point being tried
    openvdb::Vec3d mTangential =
        openvdb::Vec3d(1e300); // tangential part of the vector from the best point to the voxel
    double mPace = 1, mLast = std::numeric_limits<double>::infinity();
    int mCorrections = 0;
    bool mBegun = false, mMoving = true;
};

/// Slides the points of entries, which are on the surface, to the positions closest to their voxels. Their distances
/// never increase. Returns how many points did not converge.
size_t slideAll(const BackwardMap& map, std::span<Entry> entries) {
    constexpr int kMaxSteps = 40, kPatience = 6;
    const Accessor index(map.index());
    std::vector<Slider> sliders;
    std::vector<size_t> moving;
    for (Entry& entry : entries) {
        if (sliders.emplace_back(entry).moving()) moving.push_back(sliders.size() - 1);
    }
    std::vector<openvdb::Vec3d> positions;
    std::vector<BackwardMap::Sample> samples;
    std::vector<uint8_t> known;
    for (int k = 1; k <= kMaxSteps && !moving.empty(); ++k) {
        positions.clear();
        for (const size_t n : moving) positions.push_back(sliders[n].at());
        map.sample(positions, index, samples, known);
        size_t left = 0;
        for (size_t m = 0; m < moving.size(); ++m) {
            Slider& slider = sliders[moving[m]];
            slider.next(known[m] != 0, samples[m]);
            if (slider.moving() && (k % kPatience != 0 || slider.hasImproved())) moving[left++] = moving[m];
        }
        moving.resize(left);
    }
    return static_cast<size_t>(
        std::count_if(sliders.begin(), sliders.end(), [](const Slider& s) { return !s.converged(); }));
}

/// Returns the entry around a voxel whose closest point is nearest to the voxel; null if there is no entry.
const Entry* bestAround(const openvdb::Coord& voxel, const Accessor& index, const std::vector<Entry>& entries) {
    const Entry* best = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (const Coord& offset : kNeighbours) {
        const int32_t at = index.getValue(voxel + offset);
        if (at < 0) continue;
        const Entry& other = entries[static_cast<size_t>(at)];
        if (const double d = (other.point - voxel.asVec3d()).length(); d < least) {
            least = d;
            best = &other;
        }
    }
    return best;
}

} // namespace

ClosestPoints::ClosestPoints(const BackwardMap& map, const std::vector<BackwardMap::Crossing>& crossings,
                             double halfWidth, const Monitor& monitor) {
    begin(map, crossings, monitor);
    improve(map, monitor);
    for (size_t first = 0; first < mEntries.size();) {
        const size_t next = mEntries.size();
        if (!addRing(map, first, halfWidth, monitor)) break;
        first = next;
    }
}

void ClosestPoints::insert(const std::vector<Entry>& entries) {
    for (const Entry& entry : entries) {
        mIndex.setValueOn(entry.voxel, static_cast<int32_t>(mEntries.size()));
        mEntries.push_back(entry);
    }
}

/// Adds the voxels at both ends of each crossed edge, with the nearest of their crossings.
void ClosestPoints::begin(const BackwardMap& map, const std::vector<BackwardMap::Crossing>& crossings,
                          const Monitor& monitor) {
    std::vector<Entry> entries;
    openvdb::Int32Tree index(-1);
    openvdb::tree::ValueAccessor<openvdb::Int32Tree> access(index);
    const Accessor known(map.index());
    for (const auto& crossing : crossings)
        for (const int end : {0, 1}) {
            Coord voxel = crossing.voxel;
            voxel[crossing.axis] += end;
            const double distance = end == 0 ? crossing.fraction : 1 - crossing.fraction;
            const int32_t at = access.getValue(voxel);
            if (at < 0) {
                access.setValueOn(voxel, static_cast<int32_t>(entries.size()));
                entries.push_back({.voxel = voxel,
                                   .point = crossing.position(),
                                   .distance = distance,
                                   .inside = map.inside(static_cast<size_t>(known.getValue(voxel)))});
            } else if (Entry& entry = entries[static_cast<size_t>(at)]; distance < entry.distance) {
                entry.point = crossing.position();
                entry.distance = distance;
            }
        }
    mUnconverged += parallelSum(
        entries.size(), kBatch,
        [&](size_t from, size_t to) { return slideAll(map, std::span(entries).subspan(from, to - from)); }, monitor);
    insert(entries);
}

/// Replaces closest points by those of neighbours if they are closer, since another part of the surface may be.
void ClosestPoints::improve(const BackwardMap& map, const Monitor& monitor) {
    constexpr double kCloser = 1e-3; // voxels
    std::vector<Entry> improved = mEntries;
    parallelFor(
        mEntries.size(), kBatch,
        [&](size_t from, size_t to) {
            const Accessor index(mIndex);
            std::vector<Entry> changed;
            std::vector<size_t> owner;
            for (size_t n = from; n < to; ++n) {
                const Entry& entry = mEntries[n];
                const Entry* best = bestAround(entry.voxel, index, mEntries);
                if (!best || !((best->point - entry.voxel.asVec3d()).length() < entry.distance - kCloser)) continue;
                changed.push_back(entry);
                changed.back().point = best->point;
                changed.back().normal = best->normal;
                owner.push_back(n);
            }
            slideAll(map, changed);
            for (size_t m = 0; m < owner.size(); ++m) improved[owner[m]] = changed[m];
        },
        monitor);
    mEntries = std::move(improved);
}

/// Adds the voxels around those from `first` on that are within the band. Returns false if there are none.
bool ClosestPoints::addRing(const BackwardMap& map, size_t first, double halfWidth, const Monitor& monitor) {
    openvdb::MaskTree ring;
    {
        const Accessor index(mIndex);
        openvdb::tree::ValueAccessor<openvdb::MaskTree> mask(ring);
        for (size_t n = first; n < mEntries.size(); ++n) {
            if (!(mEntries[n].distance < halfWidth)) continue;
            for (const Coord& offset : kNeighbours)
                if (const Coord voxel = mEntries[n].voxel + offset; index.getValue(voxel) < 0) mask.setValueOn(voxel);
        }
    }
    std::vector<Entry> entries;
    for (auto voxel = ring.cbeginValueOn(); voxel; ++voxel) entries.push_back({.voxel = voxel.getCoord()});
    if (entries.empty()) return false;
    mUnconverged += parallelSum(
        entries.size(), kBatch,
        [&](size_t from, size_t to) {
            const Accessor known(map.index()), index(mIndex);
            for (size_t n = from; n < to; ++n) {
                Entry& entry = entries[n];
                const Entry& best = *bestAround(entry.voxel, index, mEntries);
                const int32_t at = known.getValue(entry.voxel);
                entry.point = best.point;
                entry.normal = best.normal;
                // Where φ is unknown, no surface lies between the two voxels, since φ is known around the surface.
                entry.inside = at >= 0 ? map.inside(static_cast<size_t>(at)) : best.inside;
            }
            return slideAll(map, std::span(entries).subspan(from, to - from));
        },
        monitor);
    insert(entries);
    return true;
}

openvdb::FloatGrid::Ptr ClosestPoints::grid(double halfWidth, double voxelSize) const {
    auto grid = openvdb::FloatGrid::create(static_cast<float>(halfWidth * voxelSize));
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    auto access = grid->getAccessor();
    for (const Entry& entry : mEntries) {
        if (!(entry.distance < halfWidth)) continue;
        const auto value = static_cast<float>(entry.distance * voxelSize);
        access.setValueOn(entry.voxel, entry.inside ? -value : value);
    }
    openvdb::tools::signedFloodFill(grid->tree());
    return grid;
}

} // namespace curlew
