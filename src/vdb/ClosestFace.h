// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "IndexMesh.h"
#include "TriangleDistances.h"
#include "VertexFaces.h"
#include "curlew/math/Dispatch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace curlew {

/// Looks for the face closest to a position, in voxels.
class ClosestFace {
  public:
    ClosestFace(const IndexMesh& mesh, const Vec3d& position) : mMesh(mesh), mPosition(position) {}

    /// Adds a face to those that compare() looks at, unless it is one of the first that were added.
    void add(size_t face) {
        const auto end = mSeen.begin() + mCount;
        if (std::find(mSeen.begin(), end, face) != end) return;
        if (mCount < mSeen.size()) mSeen[mCount++] = face;
        mMesh.forTriangles(face, [&](const std::array<Vec3d, 3>& corner, const std::array<size_t, 3>& numbers) {
            if (mTriangles.size == kBatch) compare();
            const int n = mTriangles.size++;
            mFaces[static_cast<size_t>(n)] = face;
            mCorners[static_cast<size_t>(n)] = numbers;
            for (size_t k = 0; k < 3; ++k) mTriangles.corner[k].set(n, corner[k] - mPosition);
        });
    }

    /// Compares the faces that were added.
    void compare() {
        TriangleKernel::Result result;
        runKernel<TriangleKernel, double>(std::as_const(mTriangles), result);
        for (size_t n = 0; n < static_cast<size_t>(mTriangles.size); ++n) {
            if (!(result.square[n] < mSquare)) continue;
            mSquare = result.square[n];
            mFace = mFaces[n];
            mInterior = result.corner[n] == ClosestPoint<double>::kInterior;
            if (!mInterior) mVertex = mMesh.vertex(mFace, mCorners[n][static_cast<size_t>(result.corner[n])]);
        }
        mTriangles.size = 0;
    }

    /// Adds the faces at the vertices of those that were added so far.
    void addAround(const VertexFaces& faces) {
        const size_t count = mCount;
        for (size_t n = 0; n < count; ++n)
            for (size_t k = 0; k < mMesh.vertexCount(mSeen[n]); ++k) addAt(mMesh.vertex(mSeen[n], k), faces);
    }

    /// Walks over the mesh from face to face, as long as that leads closer. From a point on an edge, looks at all faces
    /// at the nearest vertex.
    void descend(const VertexFaces& faces) {
        for (double before = 2 * mSquare; mSquare < before && !mInterior;) {
            before = mSquare;
            addAt(mVertex, faces);
            compare();
        }
    }

    /// In voxels; infinite if no face has been added.
    double distance() const { return std::sqrt(mSquare); }
    size_t face() const { return mFace; }

  private:
    /// More faces meet in the middle of a fan. They are slivers, and to compare each position near it with all of them
    /// would take too long.
    static constexpr size_t kMostFaces = 48;

    /// Adds the faces at a vertex, unless it is the middle of a fan.
    void addAt(openvdb::Index32 vertex, const VertexFaces& faces) {
        if (const auto found = faces.at(vertex); found.size() <= kMostFaces)
            for (const openvdb::Index32 face : found) add(face);
    }

    const IndexMesh& mMesh;
    Vec3d mPosition;
    Triangles mTriangles; ///< Those not compared yet, their faces, and their corners among those of the face.
    std::array<size_t, kBatch> mFaces;
    std::array<std::array<size_t, 3>, kBatch> mCorners;
    std::array<size_t, 64> mSeen;
    size_t mCount = 0; ///< Of those seen.
    double mSquare = std::numeric_limits<double>::infinity();
    size_t mFace = 0;
    openvdb::Index32 mVertex = 0; ///< If the closest point is on an edge of the face, the vertex nearest to it.
    bool mInterior = true;
};

} // namespace curlew
