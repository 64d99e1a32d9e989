// SPDX-License-Identifier: Apache-2.0
#include "BgeoInput.h"
#include "BgeoLayout.h"
#include "PointArrays.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"
#include "curlew/base/Text.h"
#include "curlew/base/UninitializedArray.h"
#include "curlew/vdb/BgeoFile.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace curlew {

namespace {

namespace fs = std::filesystem;

struct Attribute {
    std::string name;
    int32_t type = bgeo::kFloat;
    size_t size = 0;   ///< Components, 4 bytes each.
    size_t offset = 0; ///< Bytes before it in a row.
};

struct Attributes {
    std::vector<Attribute> all = {};
    size_t rowBytes = 0;

    const Attribute* find(std::string_view name, size_t size, bool integer = false) const {
        for (const Attribute& a : all)
            if (a.name == name && a.size == size && (a.type == bgeo::kInteger) == integer && a.type != bgeo::kIndex)
                return &a;
        return nullptr;
    }
};

Attributes readAttributes(BgeoInput& in, size_t count, size_t before) {
    Attributes attributes{.rowBytes = before};
    for (size_t k = 0; k < count; ++k) {
        Attribute a{.name = in.text()};
        a.size = in.read<uint16_t>();
        a.type = in.read<int32_t>() & 0xffff; // the upper half says how transforms change it
        a.offset = attributes.rowBytes;
        if (a.type == bgeo::kIndex) {
            for (size_t left = in.count(); left > 0; --left) in.text();
        } else if (a.type == bgeo::kFloat || a.type == bgeo::kInteger || a.type == bgeo::kVector) {
            in.skip(4 * a.size); // defaults
        } else {
            throw in.error(fmt::format("its attribute '{}' is of a type that is not read; delete the attribute",
                                       printable(a.name)));
        }
        attributes.rowBytes += 4 * a.size;
        attributes.all.push_back(std::move(a));
    }
    return attributes;
}

template <class T>
T valueAt(std::string_view row, size_t offset) {
    return bigAt<T>(row.data() + offset);
}

/// The vertices of all polygons.
struct Polylines {
    std::vector<uint32_t> points;
    std::vector<size_t> start{0};
    std::vector<bool> closed;
    std::vector<int64_t> ids;
    bool hasIds = false, anyOpen = false;
};

/// A .bgeo as it is in the file.
class Bgeo {
  public:
    explicit Bgeo(const fs::path& path) : mIn(path) {
        readHeader();
        mAttributes = readAttributes(mIn, mPointAttributes, 4 * sizeof(float));
        mRowsAt = mIn.position();
        if (mPoints > mIn.left() / mAttributes.rowBytes) throw mIn.cutShort();
        mIn.skip(mPoints * mAttributes.rowBytes);
        mVertexBytes = readAttributes(mIn, mVertexAttributes, 0).rowBytes;
        mPrimitive = readAttributes(mIn, mPrimitiveAttributes, 0);
        mPolylines.hasIds = mPrimitive.find("id", 1, true) != nullptr;
    }

    /// Reads the primitives up to the first curve. Returns whether there is one. Call once, and nothing else.
    bool findCurves() {
        readPrimitives([this] { return hasCurves() && !hasFacesOnly(); });
        return hasCurves();
    }

    BgeoContent content() {
        readPrimitives([] { return false; });
        BgeoContent content{.geometry = {}, .skipped = skipped()};
        if (hasCurves())
            content.geometry = curves();
        else
            content.geometry = points();
        return content;
    }

  private:
    /// Reads primitives until `enough` is true.
    template <class Enough>
    void readPrimitives(const Enough& enough) {
        for (size_t done = 0; done < mPrimitives && !enough();) done += readRun(mPrimitives - done);
        if (hasFacesOnly()) throw mIn.error("it holds faces; write meshes as .obj or .ply");
    }

    /// Whether all polygons so far are closed and have no ids.
    bool hasFacesOnly() const { return hasCurves() && !mPolylines.anyOpen && !mPolylines.hasIds; }
    bool hasCurves() const { return !mPolylines.closed.empty(); }

    Points points() {
        auto bytes = static_cast<double>(Points::kPlainBytes + (mAttributes.find("v", 3) ? 3 * sizeof(float) : 0));
        for (const Scalar& scalar : kScalars)
            if (mAttributes.find(scalar.name, 1)) bytes += sizeof(double);
        requireRowsAnd(bytes * static_cast<double>(mPoints), "the points");
        readRows();
        const auto rowOf = [](size_t n) { return n; };
        Points p;
        takeMotion(p, mPoints, rowOf);
        for (const Scalar& scalar : kScalars)
            if (const Attribute* a = mAttributes.find(scalar.name, 1)) {
                scalar.resize(p, mPoints);
                forValues(mPoints, [&](size_t n) { scalar.set(p, n, valueAt<float>(row(n), a->offset)); });
            }
        if (p.f.size() != p.g.size()) p.f.clear(), p.g.clear(); // a track needs both
        p.id.resize(mPoints);
        std::iota(p.id.begin(), p.id.end(), int64_t{0});
        if (const Attribute* id = mAttributes.find("id", 1, true))
            forValues(mPoints, [&](size_t n) { p.id[n] = valueAt<int32_t>(row(n), id->offset); });
        return p;
    }

    Curves curves() {
        const size_t vertices = mPolylines.points.size();
        constexpr size_t kCurveBytes = 2 * sizeof(CurveEnd) + 2 * sizeof(double); // beyond what has been read
        requireRowsAnd(static_cast<double>(Curves::kVertexBytes * vertices + kCurveBytes * mPolylines.closed.size()),
                       "the curves");
        readRows();
        const auto rowOf = [&](size_t v) { return mPolylines.points[v]; };
        Curves c;
        c.start = std::move(mPolylines.start);
        c.id = std::move(mPolylines.ids);
        takeMotion(c, vertices, rowOf);
        for (auto* values : {&c.vx, &c.vy, &c.vz}) values->resize(vertices); // 0 if there are no velocities
        const Attribute *f = mAttributes.find("f", 1), *g = mAttributes.find("g", 1);
        if (f && g) {
            c.f.resize(vertices), c.g.resize(vertices);
            forValues(vertices, [&](size_t v) {
                c.f[v] = static_cast<double>(valueAt<float>(row(rowOf(v)), f->offset));
                c.g[v] = static_cast<double>(valueAt<float>(row(rowOf(v)), g->offset));
            });
        }
        c.upstream.reserve(c.size());
        for (const bool closed : mPolylines.closed) c.upstream.push_back(closed ? CurveEnd::closed : CurveEnd::limit);
        c.downstream = c.upstream;
        measure(c);
        return c;
    }

    std::vector<std::string> skipped() const {
        std::vector<std::string> names;
        for (const Attribute& a : mAttributes.all)
            if (&a != mAttributes.find("v", 3) && &a != mAttributes.find("id", 1, true) && !isScalar(a) &&
                !(hasCurves() && (&a == mAttributes.find("length", 1) || &a == mAttributes.find("time", 1))))
                names.push_back(printable(a.name));
        return names;
    }

    void readHeader() {
        const std::string_view magic = mIn.bytes(5);
        if (magic.substr(0, 4) == "\x7fNSJ" || magic.substr(0, 4) == "scf1")
            throw mIn.error("it is in the format of Houdini 12 and later; save it as .bhclassic or .ply");
        if (magic != "BgeoV") throw mIn.error("it is another kind of file");
        if (const auto version = mIn.read<int32_t>(); version != bgeo::kVersion)
            throw mIn.error(fmt::format("it has version {}, not {}", version, bgeo::kVersion));
        mPoints = mIn.count();
        mPrimitives = mIn.count();
        mIn.count(), mIn.count(); // groups, which follow everything that is read
        mPointAttributes = mIn.count();
        mVertexAttributes = mIn.count();
        mPrimitiveAttributes = mIn.count();
        mIn.count(); // attributes of the whole
    }

    /// Reads one primitive or a run of them. Returns how many.
    size_t readRun(size_t most) {
        auto type = mIn.read<int32_t>();
        size_t count = 1;
        if (type == bgeo::kRun) {
            count = mIn.read<uint16_t>();
            type = mIn.read<int32_t>();
        }
        if (count == 0 || count > most) throw mIn.error("it is damaged; write or copy it again");
        for (size_t k = 0; k < count; ++k) {
            if (type == bgeo::kPolygon)
                readPolygon();
            else if (type == bgeo::kParticles)
                skipParticles();
            else
                throw mIn.error("it holds primitives other than polygons; convert them to polygons or points");
        }
        return count;
    }

    size_t readIndex() {
        const size_t index = bgeo::hasWideIndices(mPoints) ? mIn.read<uint32_t>() : mIn.read<uint16_t>();
        if (index >= mPoints) throw mIn.error("a polygon uses a point that does not exist");
        return index;
    }

    void readPolygon() {
        const size_t vertices = mIn.count();
        const char form = mIn.bytes(1)[0];
        if (form != bgeo::kClosed && form != bgeo::kOpen) throw mIn.error("it is damaged; write or copy it again");
        for (size_t v = 0; v < vertices; ++v) {
            mPolylines.points.push_back(static_cast<uint32_t>(readIndex()));
            mIn.skip(mVertexBytes);
        }
        const std::string_view row = mIn.bytes(mPrimitive.rowBytes);
        const Attribute* id = mPrimitive.find("id", 1, true);
        mPolylines.ids.push_back(id ? valueAt<int32_t>(row, id->offset)
                                    : static_cast<int64_t>(mPolylines.closed.size()));
        mPolylines.start.push_back(mPolylines.points.size());
        mPolylines.closed.push_back(form == bgeo::kClosed);
        mPolylines.anyOpen = mPolylines.anyOpen || form == bgeo::kOpen;
    }

    void skipParticles() {
        for (size_t left = mIn.count(); left > 0; --left) {
            readIndex();
            mIn.skip(mVertexBytes);
        }
        mIn.skip(mPrimitive.rowBytes);
    }

    void requireRowsAnd(double bytes, const char* what) const {
        requireMemory(bytes + static_cast<double>(mPoints * mAttributes.rowBytes), what, "split the file");
    }

    void readRows() {
        const size_t bytes = mPoints * mAttributes.rowBytes;
        mRows = uninitializedArray<char>(bytes);
        mIn.moveTo(mRowsAt);
        mIn.copy(mRows.get(), bytes);
    }

    std::string_view row(size_t n) const { return {&mRows[n * mAttributes.rowBytes], mAttributes.rowBytes}; }

    /// Calls `take` with the indices below `count`, on all threads.
    template <class Take>
    static void forValues(size_t count, const Take& take) {
        parallelFor(count, kGrain, [&](size_t begin, size_t end) {
            for (size_t n = begin; n < end; ++n) take(n);
        });
    }

    /// Sets the positions of points or curves, and their velocities, if the file has them; value n is in row rowOf(n).
    template <class Geometry, class RowOf>
    void takeMotion(Geometry& to, size_t count, const RowOf& rowOf) const {
        requireFinitePositions();
        for (auto* values : {&to.x, &to.y, &to.z}) values->resize(count);
        const Attribute* v = mAttributes.find("v", 3);
        if (v)
            for (auto* values : {&to.vx, &to.vy, &to.vz}) values->resize(count);
        forValues(count, [&](size_t n) {
            const std::string_view from = row(rowOf(n));
            to.x[n] = static_cast<double>(valueAt<float>(from, 0));
            to.y[n] = static_cast<double>(valueAt<float>(from, 4));
            to.z[n] = static_cast<double>(valueAt<float>(from, 8));
            if (!v) return;
            to.vx[n] = valueAt<float>(from, v->offset);
            to.vy[n] = valueAt<float>(from, v->offset + 4);
            to.vz[n] = valueAt<float>(from, v->offset + 8);
        });
    }

    void requireFinitePositions() const {
        const auto bad = parallelSum(mPoints, kGrain, [&](size_t begin, size_t end) {
            size_t count = 0;
            for (size_t n = begin; n < end; ++n)
                count += !(std::isfinite(valueAt<float>(row(n), 0)) && std::isfinite(valueAt<float>(row(n), 4)) &&
                           std::isfinite(valueAt<float>(row(n), 8)));
            return count;
        });
        if (bad > 0)
            throw mIn.error(fmt::format(
                "{} of its {} points have a coordinate that is not a finite number; repair them", bad, mPoints));
    }

    bool isScalar(const Attribute& a) const {
        return std::any_of(kScalars.begin(), kScalars.end(),
                           [&](const Scalar& scalar) { return &a == mAttributes.find(scalar.name, 1); });
    }

    /// Sets the lengths of the curves, and the distance or time at each vertex from its attribute, if there is one.
    void measure(Curves& c) const {
        c.along.resize(c.vertices());
        c.length.reserve(c.size());
        c.gap.resize(c.size());
        const Attribute* time = mAttributes.find("time", 1);
        const Attribute* along = time ? time : mAttributes.find("length", 1);
        c.by = time ? StepBy::time : StepBy::length;
        for (size_t k = 0; k < c.size(); ++k) {
            double length = 0;
            for (size_t v = c.start[k]; v < c.start[k + 1]; ++v) {
                if (v > c.start[k]) length += curlew::length(c.position(v) - c.position(v - 1));
                c.along[v] =
                    along ? static_cast<double>(valueAt<float>(row(mPolylines.points[v]), along->offset)) : length;
            }
            if (c.closed(k) && c.start[k + 1] > c.start[k])
                length += curlew::length(c.position(c.start[k]) - c.position(c.start[k + 1] - 1));
            c.length.push_back(length);
        }
    }

    static constexpr size_t kGrain = 1 << 14; // rows

    BgeoInput mIn;
    size_t mPoints = 0, mPrimitives = 0;
    size_t mPointAttributes = 0, mVertexAttributes = 0, mPrimitiveAttributes = 0;
    Attributes mAttributes, mPrimitive;
    size_t mVertexBytes = 0;
    size_t mRowsAt = 0;             ///< Position in the file.
    UninitializedArray<char> mRows; ///< One per point, as they are in the file.
    Polylines mPolylines;
};

} // namespace

BgeoContent readBgeo(const fs::path& path) { return Bgeo(path).content(); }

bool bgeoHasCurves(const fs::path& path) { return Bgeo(path).findCurves(); }

} // namespace curlew
