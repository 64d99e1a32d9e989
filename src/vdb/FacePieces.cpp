// SPDX-License-Identifier: Apache-2.0
#include "FacePieces.h"

#include "WindingMoments.h"
#include "curlew/base/Parallel.h"
#include "curlew/vdb/Openvdb.h"

#include <algorithm>
#include <cmath>

namespace curlew {

namespace {

using openvdb::Coord;
using winding::Triangle;
using winding::triangleOf;

constexpr size_t kChunk = 64;      ///< In triangles.
constexpr double kPieceEdge = 1.5; ///< Maximum edge length of a piece, voxels.
constexpr int kHalvings = 2;       ///< How often the edges of a piece are halved where kept and hidden pieces meet.
constexpr double kBeside = 0.02;   ///< Distance from a face at which its two sides are sampled, voxels.

/// Calls use(piece) for n² equal parts of a triangle.
template <class Use>
void cut(const Triangle& triangle, int n, const Use& use) {
    const Vec3d a = triangle.corner[0], u = (triangle.corner[1] - a) * (1.0 / n),
                v = (triangle.corner[2] - a) * (1.0 / n);
    const auto at = [&](int i, int j) { return a + u * static_cast<double>(i) + v * static_cast<double>(j); };
    if (n == 1) return use(triangle);
    for (int i = 0; i < n; ++i)
        for (int j = 0; i + j < n; ++j) {
            use(Triangle{at(i, j), at(i + 1, j), at(i, j + 1)});
            if (i + j + 1 < n) use(Triangle{at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
        }
}

int partsOf(const Triangle& triangle, double voxel) {
    double longest = 0;
    for (size_t k = 0; k < 3; ++k)
        longest = std::max(longest, length(triangle.corner[k] - triangle.corner[(k + 1) % 3]));
    return static_cast<int>(std::clamp(std::ceil(longest / (kPieceEdge * voxel)), 1.0, 1e4));
}

/// Masks of the cells that contain kept and hidden pieces.
struct Cells {
    openvdb::MaskTree kept, hidden;

    static Coord of(const Vec3d& p, double voxel) {
        return Coord::floor(openvdb::Vec3d(p[0] / voxel, p[1] / voxel, p[2] / voxel));
    }
};

bool around(const openvdb::tree::ValueAccessor<const openvdb::MaskTree>& cells, const Coord& cell) {
    for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y)
            for (int z = -1; z <= 1; ++z)
                if (cells.isValueOn(cell.offsetBy(x, y, z))) return true;
    return false;
}

void append(Mesh& surface, const std::vector<Triangle>& pieces) {
    for (const Triangle& piece : pieces) {
        const auto first = static_cast<openvdb::Index32>(surface.points.size());
        for (const Vec3d& p : piece.corner) surface.points.emplace_back(openvdb::Vec3d(p[0], p[1], p[2]));
        surface.triangles.emplace_back(first, first + 1, first + 2);
    }
}

} // namespace

FacePieces::FacePieces(const Mesh& mesh, double voxel, const Bounds& isBoundary, const Monitor& monitor) {
    const size_t count = mesh.triangles.size(), chunks = (count + kChunk - 1) / kChunk;
    // Returns whether exactly one side of a face is inside, at `place`.
    const auto boundsAt = [&](const Triangle& face, const Vec3d& place) {
        const Vec3d area = face.area();
        const double size = length(area);
        if (!(size > 0)) return false;
        const Vec3d step = area * (kBeside * voxel / size);
        return isBoundary(place, step);
    };
    const auto bounds = [&](const Triangle& piece) { return boundsAt(piece, piece.middle()); };
    // Uses a piece as a whole if its corners agree with its middle, where it is `keep`; otherwise splits it.
    const auto split = [&](const auto& self, const Triangle& piece, bool keep, int halvings, const auto& use) -> void {
        bool alike = true;
        for (size_t k = 0; k < 3 && alike && halvings > 0; ++k)
            alike = boundsAt(piece, piece.corner[k] * 0.9 + piece.middle() * 0.1) == keep;
        if (alike || halvings == 0) return use(piece, keep);
        cut(piece, 2, [&](const Triangle& part) { self(self, part, bounds(part), halvings - 1, use); });
    };

    // For each piece whether it is kept, one triangle after another.
    std::vector<std::vector<uint8_t>> sorts(chunks);
    parallelFor(
        count, kChunk,
        [&](size_t begin, size_t end) {
            std::vector<uint8_t>& sort = sorts[begin / kChunk];
            for (size_t n = begin; n < end; ++n) {
                const Triangle triangle = triangleOf(mesh, n);
                cut(triangle, partsOf(triangle, voxel), [&](const Triangle& piece) { sort.push_back(bounds(piece)); });
            }
        },
        monitor);

    Cells cells;
    double area = 0, hiddenArea = 0;
    {
        openvdb::tree::ValueAccessor<openvdb::MaskTree> kept(cells.kept), hidden(cells.hidden);
        for (size_t chunk = 0; chunk < chunks; ++chunk) {
            size_t k = 0;
            for (size_t n = chunk * kChunk; n < std::min(count, (chunk + 1) * kChunk); ++n) {
                const Triangle triangle = triangleOf(mesh, n);
                cut(triangle, partsOf(triangle, voxel), [&](const Triangle& piece) {
                    const double size = length(piece.area());
                    const bool keep = sorts[chunk][k++] != 0;
                    area += size;
                    hiddenArea += keep ? 0 : size;
                    (keep ? kept : hidden).setValueOn(Cells::of(piece.middle(), voxel));
                });
            }
        }
    }
    mHidden = area > 0 ? hiddenArea / area : 0;
    if (hiddenArea == 0) {
        mSurface.points = mesh.points;
        mSurface.triangles = mesh.triangles;
        return;
    }

    std::vector<std::vector<Triangle>> pieces(chunks);
    parallelFor(
        count, kChunk,
        [&](size_t begin, size_t end) {
            const openvdb::tree::ValueAccessor<const openvdb::MaskTree> kept(cells.kept), hidden(cells.hidden);
            const size_t chunk = begin / kChunk;
            size_t k = 0;
            for (size_t n = begin; n < end; ++n) {
                const Triangle triangle = triangleOf(mesh, n);
                std::vector<Triangle> own;
                bool whole = true;
                cut(triangle, partsOf(triangle, voxel), [&](const Triangle& piece) {
                    const bool keep = sorts[chunk][k++] != 0;
                    const Coord cell = Cells::of(piece.middle(), voxel);
                    if (!around(keep ? hidden : kept, cell)) {
                        whole = whole && keep;
                        if (keep) own.push_back(piece);
                        return;
                    }
                    split(split, piece, keep, kHalvings, [&](const Triangle& part, bool keepPart) {
                        whole = whole && keepPart;
                        if (keepPart) own.push_back(part);
                    });
                });
                if (whole) own = {triangle};
                pieces[chunk].insert(pieces[chunk].end(), own.begin(), own.end());
            }
        },
        monitor);
    for (const auto& chunk : pieces) append(mSurface, chunk);
}

} // namespace curlew
