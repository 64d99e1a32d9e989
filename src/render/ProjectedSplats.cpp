// SPDX-License-Identifier: Apache-2.0
#include "ProjectedSplats.h"

#include "ProjectKernel.h"
#include "curlew/base/Parallel.h"
#include "curlew/math/Dispatch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace curlew::detail {

namespace {

/// Positions one after the other as a camera sees them.
class SeenPositions {
  public:
    static constexpr size_t kMost = 512;

    SeenPositions(const Splats& splats, const Camera& camera) : mSplats(splats), mCamera(camera) {}

    size_t size() const { return mSize; }
    bool inFront(size_t n) const { return mDepth[n] > 0; }
    SplatVertex operator[](size_t n) const { return {mX[n], mY[n], mDepth[n], mValue[n]}; }

    void clear() { mSize = 0; }
    /// Adds at most kMost positions in all.
    void add(size_t first, size_t count) {
        const double *x = &mSplats.x[first], *y = &mSplats.y[first], *z = &mSplats.z[first];
        const size_t ahead = std::min(count + kMost, mSplats.x.size() - first);
        for (size_t k = count; k < ahead; k += 8) { // a line of the cache
            __builtin_prefetch(x + k);
            __builtin_prefetch(y + k);
            __builtin_prefetch(z + k);
        }
        const ProjectKernel::Job job{x, y, z, count, &mX[mSize], &mY[mSize], &mDepth[mSize]};
        constexpr size_t kMostLanes = 16;
        if (count < kMostLanes)
            ProjectKernel::run<double>(mCamera, job);
        else
            runKernel<ProjectKernel, double>(mCamera, job);
        addValues(first, count);
        std::iota(&mFrom[mSize], &mFrom[mSize] + count, first);
        mSize += count;
    }
    /// Returns whether only one end of the edge from a position to the next one is in front of the camera.
    bool isCut(size_t n) const {
        return inFront(n) != inFront(n + 1) && std::isfinite(mDepth[n]) && std::isfinite(mDepth[n + 1]);
    }
    /// Returns where such an edge gets there.
    SplatVertex cut(size_t n) const {
        constexpr double kNear = 1e-6; // of the depth of the end in front
        const Vec3d p = place(n), q = place(n + 1);
        const double before = mCamera.project(p).depth, behind = mCamera.project(q).depth;
        const double part = (kNear * std::max(before, behind) - before) / (behind - before);
        const auto at = mCamera.project(p + (q - p) * part);
        return {static_cast<float>(at.x), static_cast<float>(at.y), static_cast<float>(at.depth),
                std::lerp(mValue[n], mValue[n + 1], static_cast<float>(part))};
    }

    /// Computes the distances between neighbours.
    void measure() {
        // A straight line in space is straight in pixels and the reciprocal of the depth, which is scaled to pixels
        // here.
        const float scale = static_cast<float>(mCamera.focal()) * mDepth[0];
        for (size_t n = 0; n < mSize; ++n) mNearness[n] = scale / mDepth[n];
        for (size_t n = 1; n < mSize; ++n) mLength[n] = std::sqrt(squaredDistance(n - 1, n));
    }
    /// Returns how many edges in a row, from that position on, may be drawn as one; 0 if the first reaches behind the
    /// camera. A path of length p is no farther than h from the line between its ends if their distance l satisfies
    /// p² - l² <= 4 h²: an ellipse with these as foci contains it. Values are on a straight line but for an error e if
    /// it is not too steep or flat for any of them ± e.
    size_t straight(size_t first) const {
        constexpr float kHeight = 1.0F / 16, kError = 1.0F / 256; // pixels, and part of the colour map
        float path = mLength[first + 1], least = -HUGE_VALF, most = HUGE_VALF;
        size_t end = first + 1;
        if (!inFront(first) || !inFront(end)) return 0;
        while (end + 1 < mSize && end - first < std::numeric_limits<uint8_t>::max()) {
            const auto slope = [&](float offset) { return (mValue[end] - mValue[first] + offset) / path; };
            least = std::max(least, slope(-kError));
            most = std::min(most, slope(kError));
            path += mLength[end + 1];
            const float change = mValue[end + 1] - mValue[first];
            const float bend = path * path - squaredDistance(first, end + 1);
            // One branch, which is cheaper than to stop at the first that does not hold.
            if (!(static_cast<int>(inFront(end + 1)) & static_cast<int>(path <= ProjectedSplats::kShort) &
                  static_cast<int>(change >= least * path) & static_cast<int>(change <= most * path) &
                  static_cast<int>(bend <= 4 * kHeight * kHeight)))
                break;
            ++end;
        }
        return end - first;
    }

  private:
    using Numbers = std::array<float, kMost>;

    Vec3d place(size_t n) const {
        const size_t k = mFrom[n];
        return {{mSplats.x[k], mSplats.y[k], mSplats.z[k]}};
    }
    void addValues(size_t first, size_t count) {
        if (mSplats.values.empty()) {
            std::fill_n(&mValue[mSize], count, 0.0F);
            return;
        }
        const auto lower = static_cast<double>(mSplats.scale.lower);
        const double range = static_cast<double>(mSplats.scale.upper) - lower;
        for (size_t k = 0; k < count; ++k) {
            const double value = (static_cast<double>(mSplats.values[first + k]) - lower) / range;
            mValue[mSize + k] = std::isfinite(value) ? static_cast<float>(std::clamp(value, -1e6, 1e6)) : 0;
        }
    }
    float squaredDistance(size_t a, size_t b) const {
        const float x = mX[b] - mX[a], y = mY[b] - mY[a], z = mNearness[b] - mNearness[a];
        return x * x + y * y + z * z;
    }

    const Splats& mSplats;
    const Camera& mCamera;
    size_t mSize = 0;
    std::array<size_t, kMost> mFrom;                    ///< Their indices.
    Numbers mX, mY, mDepth, mValue, mNearness, mLength; ///< The length is that to the position before.
};

/// Writes the vertices of polylines, and joins their edges.
class PolylineWriter {
  public:
    PolylineWriter(const Splats& splats, const Camera& camera, SplatVertex* vertices, uint8_t* standsFor)
        : mSplats(splats), mSeen(splats, camera), mVertices(vertices), mStandsFor(standsFor) {}

    void write(size_t line) {
        const size_t first = mSplats.start[line], last = mSplats.start[line + 1];
        if (first == last) return;
        const bool closed = !mSplats.closed.empty() && mSplats.closed[line] != 0;
        mSeen.clear();
        for (size_t k = first; k < last;) { // in parts that share a position
            const size_t count = std::min(last - k, SeenPositions::kMost - 1 - mSeen.size());
            mSeen.add(k, count);
            k += count;
            if (k == last && closed) mSeen.add(first, 1);
            writeEdges();
            mSeen.clear();
            if (k < last) mSeen.add(k - 1, 1);
        }
        mStandsFor[mCount++] = 0;
    }
    size_t count() const { return mCount; }

  private:
    /// Writes all positions but the last, whose vertex is written as that of the next edge, if there is one.
    void writeEdges() {
        mSeen.measure();
        size_t n = 0;
        while (n + 1 < mSeen.size()) {
            const size_t edges = mSeen.straight(n);
            const bool cuts = mSeen.isCut(n), leaves = cuts && mSeen.inFront(n);
            add(cuts && !leaves ? mSeen.cut(n) : mSeen[n], cuts ? 1 : edges);
            if (leaves) add(mSeen.cut(n), 0);
            n += std::max<size_t>(edges, 1);
        }
        mVertices[mCount] = mSeen[n];
    }

    void add(const SplatVertex& vertex, size_t standsFor) {
        mVertices[mCount] = vertex;
        mStandsFor[mCount++] = static_cast<uint8_t>(standsFor);
    }

    const Splats& mSplats;
    SeenPositions mSeen;
    SplatVertex* mVertices;
    uint8_t* mStandsFor;
    size_t mCount = 0;
};

} // namespace

size_t mostVertices(const Splats& splats) {
    return splats.start.empty() ? splats.x.size() : 2 * splats.x.size() + splats.start.size() - 1;
}

ProjectedSplats::ProjectedSplats(const Splats& splats, const Camera& camera, const Monitor& monitor)
    : mFocal(static_cast<float>(camera.focal())) {
    splats.start.empty() ? projectPoints(splats, camera, monitor) : projectPolylines(splats, camera, monitor);
}

void ProjectedSplats::projectPoints(const Splats& splats, const Camera& camera, const Monitor& monitor) {
    const size_t count = splats.x.size(), most = std::max(kShortestRun, count / kMostRuns + 1);
    for (size_t begin = 0; begin < count; begin += most) mRuns.push_back({begin, std::min(begin + most, count)});
    mVertices = uninitializedArray<SplatVertex>(count + 1);
    mStandsFor = uninitializedArray<uint8_t>(count);
    parallelFor(
        count, most,
        [&](size_t begin, size_t end) {
            SeenPositions seen(splats, camera);
            for (; begin < end; begin += seen.size()) {
                seen.clear();
                seen.add(begin, std::min(end - begin, SeenPositions::kMost));
                for (size_t n = 0; n < seen.size(); ++n) {
                    mVertices[begin + n] = seen[n];
                    mStandsFor[begin + n] = seen.inFront(n) ? 1 : 0;
                }
            }
        },
        monitor);
}

void ProjectedSplats::projectPolylines(const Splats& splats, const Camera& camera, const Monitor& monitor) {
    const size_t lines = splats.start.size() - 1, all = mostVertices(splats);
    const size_t least = std::max(kShortestRun, all / kMostRuns + 1);
    std::vector<size_t> firstLine; // of each run
    for (size_t line = 0, next = 0; line < lines; ++line)
        if (splats.start[line] >= next || line == 0) {
            firstLine.push_back(line);
            next = splats.start[line] + least;
        }
    mRuns.resize(firstLine.size());
    firstLine.push_back(lines);
    mVertices = uninitializedArray<SplatVertex>(all + 1);
    mStandsFor = uninitializedArray<uint8_t>(all);
    parallelFor(
        mRuns.size(), 1,
        [&](size_t from, size_t to) {
            for (size_t run = from; run < to; ++run) {
                const size_t line0 = firstLine[run], begin = 2 * splats.start[line0] + line0; // if all before take most
                PolylineWriter writer(splats, camera, &mVertices[begin], &mStandsFor[begin]);
                for (size_t line = firstLine[run]; line < firstLine[run + 1]; ++line) writer.write(line);
                mRuns[run] = {begin, begin + writer.count()};
            }
        },
        monitor);
}

} // namespace curlew::detail
