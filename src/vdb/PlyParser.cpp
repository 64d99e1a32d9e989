// SPDX-License-Identifier: Apache-2.0
#include "MeshParser.h"
#include "curlew/base/Memory.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace curlew {

namespace {

constexpr auto kLargest = static_cast<double>(std::numeric_limits<float>::max());

enum class PlyFormat { text, little, big };

struct PlyType {
    std::string_view name, alias;
    size_t size;
    bool real, isSigned;
};

constexpr std::array<PlyType, 8> kPlyTypes{{{"char", "int8", 1, false, true},
                                            {"uchar", "uint8", 1, false, false},
                                            {"short", "int16", 2, false, true},
                                            {"ushort", "uint16", 2, false, false},
                                            {"int", "int32", 4, false, true},
                                            {"uint", "uint32", 4, false, false},
                                            {"float", "float32", 4, true, true},
                                            {"double", "float64", 8, true, true}}};

struct PlyProperty {
    std::string_view name;
    const PlyType* type;
    const PlyType* count; ///< Type of the count of a list; null if the property is not a list.
};

struct PlyElement {
    std::string_view name;
    size_t count;
    std::vector<PlyProperty> properties;
};

class PlyParser {
  public:
    PlyParser(std::string_view data, const MeshSource& source) : mRest(data), mSource(source) {}

    Polygons parse() {
        readHeader();
        const PlyElement* points = find("vertex");
        const PlyElement* faces = find("face");
        if (!faces || faces->count == 0) throw mSource.noFaces();
        checkVertex(points);
        if (std::count_if(faces->properties.begin(), faces->properties.end(), isCorners) != 1)
            throw badHeader("does not have exactly one list vertex_indices for its faces");
        mPoints = points->count;
        for (const PlyElement& element : mElements) readElements(element);
        mSource.checkPoints(mBad, mPoints);
        return std::move(mPolygons);
    }

    PlyVertices parseVertices() {
        readHeader();
        const PlyElement* points = find("vertex");
        checkVertex(points);
        const PlyElement* edges = find("edge");
        if (edges) checkProperties(*edges, kEnds);
        mPoints = points->count;
        PlyVertices vertices;
        for (const PlyProperty& property : points->properties)
            if (!property.count) vertices.table.names.emplace_back(property.name);
        // Each value takes at least one byte of the file. Damaged headers have any counts.
        const size_t valueCount = std::min(mRest.size(), points->count * vertices.table.names.size());
        const size_t edgeCount = std::min(mRest.size(), edges ? edges->count : 0);
        requireMemory(static_cast<double>(sizeof(double) * valueCount + sizeof(CurveEdge) * edgeCount),
                      fmt::format("'{}'", mSource.path.string()), "split the file");
        vertices.table.values.reserve(valueCount);
        vertices.edges.reserve(edgeCount);
        mVertices = &vertices;
        const PlyElement* last = edges ? std::max(points, edges) : points;
        for (const PlyElement* element = mElements.data(); element <= last; ++element) readElements(*element);
        return vertices;
    }

  private:
    static constexpr std::array<std::string_view, 3> kAxes{"x", "y", "z"};
    static constexpr std::array<std::string_view, 2> kEnds{"vertex1", "vertex2"};

    static bool isCorners(const PlyProperty& p) {
        return p.count && !p.type->real && (p.name == "vertex_indices" || p.name == "vertex_index");
    }

    void checkVertex(const PlyElement* points) const {
        if (!points) throw badHeader("has no element vertex");
        checkProperties(*points, kAxes);
    }

    /// Throws FileError unless the element has all of these properties.
    void checkProperties(const PlyElement& element, std::span<const std::string_view> names) const {
        for (const std::string_view name : names)
            if (std::none_of(element.properties.begin(), element.properties.end(),
                             [&](const PlyProperty& p) { return p.name == name && !p.count; }))
                throw badHeader(fmt::format("has no {} property {}", element.name, name));
    }

    FileError badHeader(const std::string& why) const {
        return mSource.error(fmt::format("its PLY header {}; it is damaged or in another format", why));
    }

    const PlyElement* find(std::string_view name) const {
        const auto found =
            std::find_if(mElements.begin(), mElements.end(), [&](const auto& e) { return e.name == name; });
        return found == mElements.end() ? nullptr : &*found;
    }

    const PlyType* typeOf(std::string_view name) const {
        for (const PlyType& type : kPlyTypes)
            if (name == type.name || name == type.alias) return &type;
        throw badHeader("has a property of an unknown type");
    }

    void readHeader() {
        std::string_view line = takeLine(mRest);
        if (takeWord(line) != "ply") throw mSource.error("it does not begin like a PLY file; give a .ply file");
        bool hasFormat = false;
        for (;;) {
            if (mRest.empty()) throw mSource.cutShort();
            line = takeLine(mRest);
            const std::string_view keyword = takeWord(line);
            if (keyword == "end_header") break;
            if (keyword == "format") {
                readFormat(takeWord(line));
                hasFormat = true;
            } else if (keyword == "element") {
                readElement(line);
            } else if (keyword == "property" && !mElements.empty()) {
                readProperty(line);
            } else if (keyword != "comment" && keyword != "obj_info") {
                throw badHeader("has a line that does not belong in it");
            }
        }
        if (!hasFormat) throw badHeader("has no format");
    }

    void readFormat(std::string_view format) {
        if (format == "ascii")
            mFormat = PlyFormat::text;
        else if (format == "binary_little_endian")
            mFormat = PlyFormat::little;
        else if (format == "binary_big_endian")
            mFormat = PlyFormat::big;
        else
            throw badHeader("has an unknown format");
    }

    void readElement(std::string_view line) {
        const std::string_view name = takeWord(line);
        int64_t count = 0;
        if (!curlew::parse(takeWord(line), count) || !std::in_range<uint32_t>(count) || find(name))
            throw badHeader("has an invalid element");
        mElements.push_back({name, size_t(count), {}});
    }

    void readProperty(std::string_view line) {
        std::string_view word = takeWord(line);
        const PlyType* count = nullptr;
        if (word == "list") {
            count = typeOf(takeWord(line));
            if (count->real) throw badHeader("has a list with an invalid count");
            word = takeWord(line);
        }
        const PlyType* type = typeOf(word);
        const std::string_view name = takeWord(line);
        if (name.empty()) throw badHeader("has a property without a name");
        std::vector<PlyProperty>& properties = mElements.back().properties;
        if (std::any_of(properties.begin(), properties.end(), [&](const PlyProperty& p) { return p.name == name; }))
            throw badHeader("has the same property twice");
        properties.push_back({name, type, count});
    }

    void readElements(const PlyElement& element) {
        if (element.properties.empty() && element.count > 0) throw badHeader("has an element without properties");
        const bool isPoint = element.name == "vertex", isFace = element.name == "face";
        const bool isEdge = element.name == "edge" && mVertices;
        for (size_t n = 0; n < element.count; ++n) {
            mSource.check(n);
            if (mFormat == PlyFormat::text) nextLine();
            openvdb::Vec3s point(0);
            CurveEdge edge{};
            for (const PlyProperty& property : element.properties) {
                if (property.count) {
                    readList(property, isFace && isCorners(property));
                } else {
                    const double value = next(*property.type);
                    if (isPoint && mVertices) mVertices->table.values.push_back(value);
                    for (size_t end = 0; end < 2 && isEdge; ++end)
                        if (property.name == kEnds[end]) edge[end] = vertexOf(value, "an edge");
                    for (int axis = 0; axis < 3 && isPoint && !mVertices; ++axis)
                        if (property.name == kAxes[static_cast<size_t>(axis)]) point[axis] = static_cast<float>(value);
                }
            }
            if (isEdge) mVertices->edges.push_back(edge);
            if (isPoint && !mVertices) {
                mBad += !point.isFinite();
                mPolygons.points.push_back(point);
            }
            if (!takeWord(mLine).empty()) throw mSource.error("one of its lines has too many numbers; it is damaged");
        }
    }

    void readList(const PlyProperty& property, bool corners) {
        const double given = next(*property.count);
        if (!(given >= 0 && given <= double(std::numeric_limits<uint32_t>::max()))) throw mSource.cutShort();
        const auto count = static_cast<uint32_t>(given);
        if (corners && count < 3)
            throw mSource.error(fmt::format("it has a face with {} vertices; it is damaged", count));
        for (uint32_t n = 0; n < count; ++n) {
            const double value = next(*property.type);
            if (corners) mPolygons.corners.push_back(vertexOf(value, "a face"));
        }
        if (corners) mPolygons.sizes.push_back(count);
    }

    /// Returns a number as the index of a vertex. Throws FileError if there is no such vertex.
    uint32_t vertexOf(double value, std::string_view part) const {
        if (!(value >= 0 && value < double(mPoints)) || value != std::floor(value))
            throw mSource.error(fmt::format("it has {} with vertex {:g}, but only points 0 to {}; it is damaged", part,
                                            value, double(mPoints) - 1));
        return static_cast<uint32_t>(value);
    }

    void nextLine() {
        do {
            if (mRest.empty()) throw mSource.cutShort();
            mLine = takeLine(mRest);
        } while (isBlank(mLine));
    }

    /// Returns the next number of the data; infinite if it is out of the range of a float.
    double next(const PlyType& type) {
        if (mFormat == PlyFormat::text) return nextWord(type);
        if (mRest.size() < type.size) throw mSource.cutShort();
        uint64_t bits = 0;
        for (size_t k = 0; k < type.size; ++k) {
            const char byte = mRest[mFormat == PlyFormat::big ? type.size - 1 - k : k];
            bits |= uint64_t(static_cast<unsigned char>(byte)) << 8 * k;
        }
        mRest.remove_prefix(type.size);
        if (type.real) {
            const double value =
                type.size == 4 ? double(std::bit_cast<float>(uint32_t(bits))) : std::bit_cast<double>(bits);
            return std::abs(value) > kLargest ? HUGE_VAL : value;
        }
        const uint64_t sign = type.isSigned ? uint64_t(1) << ((8 * type.size - 1) & 63) : 0;
        return double(int64_t(bits ^ sign) - int64_t(sign)); // integers have at most 4 bytes
    }

    double nextWord(const PlyType& type) {
        const std::string_view word = takeWord(mLine);
        if (word.empty()) throw mSource.cutShort();
        float single = 0;
        double value = 0;
        const bool isFloat = type.real && type.size == 4;
        const bool isNumber = isFloat ? curlew::parse(word, single) : curlew::parse(word, value);
        if (isFloat) value = static_cast<double>(single);
        if (!isNumber || (!type.real && value != std::floor(value)))
            throw mSource.error("it has something else where a number should be; it is damaged");
        return std::abs(value) > kLargest ? HUGE_VAL : value;
    }

    std::string_view mRest, mLine;
    const MeshSource& mSource;
    PlyFormat mFormat = PlyFormat::text;
    std::vector<PlyElement> mElements;
    Polygons mPolygons;
    PlyVertices* mVertices = nullptr; ///< Receives vertices and edges if no mesh is read.
    size_t mPoints = 0, mBad = 0;
};

} // namespace

PlyVertices parsePlyVertices(std::string_view data, const MeshSource& source) {
    return PlyParser(data, source).parseVertices();
}

Polygons parsePly(std::string_view data, const MeshSource& source) { return PlyParser(data, source).parse(); }

} // namespace curlew
