// SPDX-License-Identifier: Apache-2.0
#include "BgeoLayout.h"
#include "MeshParser.h"
#include "PointArrays.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Text.h"
#include "curlew/vdb/BgeoFile.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <numeric>
#include <optional>
#include <string_view>

namespace curlew {

namespace {

namespace fs = std::filesystem;

/// Converts a big-endian value.
template <class T>
T bigAt(const char* bytes) {
    std::array<char, sizeof(T)> value{};
    for (size_t k = 0; k < sizeof(T); ++k) value[sizeof(T) - 1 - k] = bytes[k];
    return std::bit_cast<T>(value);
}

/// Reads big-endian values. Throws FileError at the end of the data.
class BigCursor {
  public:
    BigCursor(std::string_view data, const fs::path& path) : mLeft(data), mPath(path) {}

    size_t left() const { return mLeft.size(); }

    std::string_view bytes(size_t count) {
        if (count > mLeft.size()) throw error("it is cut short or damaged; write or copy it again");
        const std::string_view taken = mLeft.substr(0, count);
        mLeft.remove_prefix(count);
        return taken;
    }

    template <class T>
    T read() {
        return bigAt<T>(bytes(sizeof(T)).data());
    }

    /// Reads a number that must not be negative.
    size_t count() {
        const auto number = read<int32_t>();
        if (number < 0) throw error("it is damaged; write or copy it again");
        return static_cast<size_t>(number);
    }

    /// Reads a text after its length: 16 bits, or 32 bits after -1.
    std::string text() {
        const auto size = read<int16_t>();
        if (size < -1) throw error("it is damaged; write or copy it again");
        return std::string(bytes(size == -1 ? count() : static_cast<size_t>(size)));
    }

    FileError error(std::string_view what) const {
        return FileError(fmt::format("'{}' cannot be read as a .bgeo: {}", mPath.string(), what));
    }

  private:
    std::string_view mLeft;
    const fs::path& mPath;
};

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

Attributes readAttributes(BigCursor& in, size_t count, size_t before) {
    Attributes attributes{.rowBytes = before};
    for (size_t k = 0; k < count; ++k) {
        Attribute a{.name = in.text()};
        a.size = in.read<uint16_t>();
        a.type = in.read<int32_t>() & 0xffff; // the upper half says how transforms change it
        a.offset = attributes.rowBytes;
        if (a.type == bgeo::kIndex) {
            for (size_t left = in.count(); left > 0; --left) in.text();
        } else if (a.type == bgeo::kFloat || a.type == bgeo::kInteger || a.type == bgeo::kVector) {
            in.bytes(4 * a.size); // defaults
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
    bool hasIds = false;
};

/// A .bgeo as it is in the file.
class Bgeo {
  public:
    Bgeo(std::string_view data, const fs::path& path) : mIn(data, path) {
        readHeader();
        mAttributes = readAttributes(mIn, mPointAttributes, 4 * sizeof(float));
        if (mPoints > mIn.left() / mAttributes.rowBytes) mIn.bytes(mIn.left() + 1); // throws
        mRows = mIn.bytes(mPoints * mAttributes.rowBytes);
        mVertexBytes = readAttributes(mIn, mVertexAttributes, 0).rowBytes;
        mPrimitive = readAttributes(mIn, mPrimitiveAttributes, 0);
        mPolylines.hasIds = mPrimitive.find("id", 1, true) != nullptr;
        for (size_t done = 0; done < mPrimitives;) done += readRun(mPrimitives - done);
        const bool anyOpen =
            std::find(mPolylines.closed.begin(), mPolylines.closed.end(), false) != mPolylines.closed.end();
        if (!mPolylines.closed.empty() && !anyOpen && !mPolylines.hasIds)
            throw mIn.error("it holds faces; write meshes as .obj or .ply");
    }

    bool hasCurves() const { return !mPolylines.closed.empty(); }

    Points points() const {
        auto bytes = static_cast<double>(Points::kPlainBytes + (mAttributes.find("v", 3) ? 3 * sizeof(float) : 0));
        for (const Scalar& scalar : kScalars)
            if (mAttributes.find(scalar.name, 1)) bytes += sizeof(double);
        requireMemory(bytes * static_cast<double>(mPoints), "the points", "split the file");
        Points p;
        takePositions(p);
        if (const Attribute* v = mAttributes.find("v", 3)) takeVectors(*v, p);
        for (const Scalar& scalar : kScalars)
            if (const Attribute* a = mAttributes.find(scalar.name, 1)) {
                scalar.resize(p, mPoints);
                for (size_t n = 0; n < mPoints; ++n) scalar.set(p, n, valueAt<float>(row(n), a->offset));
            }
        if (p.f.size() != p.g.size()) p.f.clear(), p.g.clear(); // a track needs both
        p.id.resize(mPoints);
        std::iota(p.id.begin(), p.id.end(), int64_t{0});
        if (const Attribute* id = mAttributes.find("id", 1, true))
            for (size_t n = 0; n < mPoints; ++n) p.id[n] = valueAt<int32_t>(row(n), id->offset);
        return p;
    }

    Curves curves() const {
        const size_t vertices = mPolylines.points.size();
        requireMemory(
            static_cast<double>(Curves::kVertexBytes + Points::kBytes) * static_cast<double>(vertices + mPoints),
            "the curves", "split the file");
        const Points all = points();
        Curves c;
        c.start = mPolylines.start;
        c.id = mPolylines.ids;
        const auto gather = [&](const auto& from, auto& to) {
            to.resize(from.empty() ? 0 : vertices);
            for (size_t v = 0; v < to.size(); ++v) to[v] = from[mPolylines.points[v]];
        };
        gather(all.x, c.x), gather(all.y, c.y), gather(all.z, c.z);
        gather(all.vx, c.vx), gather(all.vy, c.vy), gather(all.vz, c.vz);
        gather(all.f, c.f), gather(all.g, c.g);
        for (auto* values : {&c.vx, &c.vy, &c.vz}) values->resize(vertices); // 0 if there are no velocities
        for (const bool closed : mPolylines.closed) {
            c.upstream.push_back(closed ? CurveEnd::closed : CurveEnd::limit);
            c.downstream.push_back(c.upstream.back());
        }
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

  private:
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
            mIn.bytes(mVertexBytes);
        }
        const std::string_view row = mIn.bytes(mPrimitive.rowBytes);
        const Attribute* id = mPrimitive.find("id", 1, true);
        mPolylines.ids.push_back(id ? valueAt<int32_t>(row, id->offset)
                                    : static_cast<int64_t>(mPolylines.closed.size()));
        mPolylines.start.push_back(mPolylines.points.size());
        mPolylines.closed.push_back(form == bgeo::kClosed);
    }

    void skipParticles() {
        for (size_t left = mIn.count(); left > 0; --left) {
            readIndex();
            mIn.bytes(mVertexBytes);
        }
        mIn.bytes(mPrimitive.rowBytes);
    }

    std::string_view row(size_t n) const { return mRows.substr(n * mAttributes.rowBytes, mAttributes.rowBytes); }

    void takePositions(Points& p) const {
        for (auto* values : {&p.x, &p.y, &p.z}) values->resize(mPoints);
        size_t bad = 0;
        for (size_t n = 0; n < mPoints; ++n) {
            p.x[n] = static_cast<double>(valueAt<float>(row(n), 0));
            p.y[n] = static_cast<double>(valueAt<float>(row(n), 4));
            p.z[n] = static_cast<double>(valueAt<float>(row(n), 8));
            bad += !(std::isfinite(p.x[n]) && std::isfinite(p.y[n]) && std::isfinite(p.z[n]));
        }
        if (bad > 0)
            throw mIn.error(fmt::format(
                "{} of its {} points have a coordinate that is not a finite number; repair them", bad, mPoints));
    }

    void takeVectors(const Attribute& v, Points& p) const {
        for (auto* values : {&p.vx, &p.vy, &p.vz}) values->resize(mPoints);
        for (size_t n = 0; n < mPoints; ++n) {
            p.vx[n] = valueAt<float>(row(n), v.offset);
            p.vy[n] = valueAt<float>(row(n), v.offset + 4);
            p.vz[n] = valueAt<float>(row(n), v.offset + 8);
        }
    }

    bool isScalar(const Attribute& a) const {
        return std::any_of(kScalars.begin(), kScalars.end(),
                           [&](const Scalar& scalar) { return &a == mAttributes.find(scalar.name, 1); });
    }

    /// Sets the lengths of the curves, and the distance or time at each vertex from its attribute, if there is one.
    void measure(Curves& c) const {
        c.along.resize(c.vertices());
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
            c.gap.push_back(0);
        }
    }

    BigCursor mIn;
    size_t mPoints = 0, mPrimitives = 0;
    size_t mPointAttributes = 0, mVertexAttributes = 0, mPrimitiveAttributes = 0;
    Attributes mAttributes, mPrimitive;
    size_t mVertexBytes = 0;
    std::string_view mRows;
    Polylines mPolylines;
};

} // namespace

BgeoContent readBgeo(const fs::path& path) {
    const std::string data = contentOf(path);
    const Bgeo file(data, path);
    BgeoContent content{.geometry = {}, .skipped = file.skipped()};
    if (file.hasCurves())
        content.geometry = file.curves();
    else
        content.geometry = file.points();
    return content;
}

bool bgeoHasCurves(const fs::path& path) {
    const std::string data = contentOf(path);
    return Bgeo(data, path).hasCurves();
}

} // namespace curlew
