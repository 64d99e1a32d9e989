#include "MeshChecks.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

namespace curlew {

namespace {

// ---- Words and numbers

bool isBlank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

/// Takes the next line off the text, without its end.
std::string_view takeLine(std::string_view& text) {
    const size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    return line;
}

/// Takes the next word off the line; empty at its end.
std::string_view takeWord(std::string_view& line) {
    const auto begin = std::find_if_not(line.begin(), line.end(), isBlank);
    const auto end = std::find_if(begin, line.end(), isBlank);
    const std::string_view word(begin, end);
    line.remove_prefix(size_t(end - line.begin()));
    return word;
}

constexpr double kLargest = std::numeric_limits<float>::max();

/// Whether the whole word is a number; one beyond the range of a float counts as infinite.
bool parse(std::string_view word, double& value) {
    if (word.starts_with('+')) word.remove_prefix(1);
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc::result_out_of_range) value = HUGE_VAL;
    if (std::abs(value) > kLargest) value = HUGE_VAL;
    return error != std::errc::invalid_argument && end == word.data() + word.size();
}

bool parse(std::string_view word, int64_t& value) {
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size();
}

// ---- OBJ

/// Joins continued lines and gives all lines the same end.
void unifyLines(std::string& text) {
    for (size_t n = 0; n < text.size(); ++n) {
        if (text[n] == '\r') text[n] = n + 1 < text.size() && text[n + 1] == '\n' ? ' ' : '\n';
        const size_t next = std::min(text.find_first_not_of('\r', n + 1), text.size());
        if (text[n] == '\\' && next < text.size() && text[next] == '\n') std::fill(&text[n], &text[next] + 1, ' ');
    }
}

/// Checks the points and faces of an OBJ and makes comments of all other lines: UVs and normals split points, groups
/// split the mesh, and materials name further files. Returns the number of faces, as all these checks do.
size_t prepareObj(std::string& text, const MeshSource& source) {
    if (text.find('\0') != std::string::npos) throw source.error("it is not text; give a Wavefront .obj file");
    unifyLines(text);
    size_t number = 0, faces = 0, bad = 0, lineOfLargest = 0;
    int64_t points = 0, largest = 0;
    const auto checkPoint = [&](std::string_view line) {
        size_t words = 0;
        bool finite = true;
        for (std::string_view word = takeWord(line); !word.empty(); word = takeWord(line), ++words) {
            double value = 0;
            if (!parse(word, value)) throw source.badLine(number, "has a point with something that is not a number");
            finite = finite && (words > 2 || std::isfinite(value));
        }
        if (words != 3 && words != 4 && words != 6)
            throw source.badLine(number,
                                 fmt::format("has a point of {} numbers (3, 4 with a weight, 6 with a colour)", words));
        bad += !finite;
        ++points;
    };
    const auto checkFace = [&](std::string_view line) {
        size_t corners = 0;
        for (std::string_view word = takeWord(line); !word.empty(); word = takeWord(line), ++corners) {
            int64_t index = 0;
            if (!parse(word.substr(0, word.find('/')), index) ||
                word.find_first_not_of("-0123456789/") != std::string_view::npos)
                throw source.badLine(number, "has a face with something that is not a corner");
            if (index == 0 || index < -points)
                throw source.badLine(number, fmt::format("has a face with the corner {}", index));
            if (index > largest) largest = index, lineOfLargest = number;
        }
        if (corners < 3) throw source.badLine(number, fmt::format("has a face of {} corners", corners));
        ++faces;
    };
    for (std::string_view rest = text; !rest.empty();) {
        ++number;
        std::string_view line = takeLine(rest);
        char* const begin = text.data() + (line.data() - text.data());
        const size_t comment = std::min(line.find('#'), line.size());
        std::fill(begin + comment, begin + line.size(), ' '); // Assimp takes one behind a face for corners
        line = line.substr(0, comment);
        const std::string_view keyword = takeWord(line);
        if (keyword.empty()) continue;
        if (keyword == "v")
            checkPoint(line);
        else if (keyword == "f")
            checkFace(line);
        else
            text[size_t(keyword.data() - text.data())] = '#';
        std::swap(*begin, begin[keyword.data() - begin]); // Assimp passes over lines that are indented
    }
    if (faces == 0) throw source.noFaces();
    if (largest > points)
        throw source.badLine(lineOfLargest,
                             fmt::format("has a face with the corner {}, and there are {} points", largest, points));
    source.checkFinite(bad, size_t(points));
    return faces;
}

// ---- STL

size_t checkTextStl(std::string_view text, const MeshSource& source) {
    if (!text.starts_with("solid") || text.find('\0') != std::string_view::npos)
        throw source.error(
            "it is neither a text STL nor a binary one of the size that it says; write or copy it again");
    size_t number = 0, facets = 0, points = 0, bad = 0;
    bool closed = false;
    while (!text.empty()) {
        ++number;
        std::string_view line = takeLine(text);
        const std::string_view keyword = takeWord(line);
        if (keyword.empty()) continue;
        closed = keyword == "endsolid";
        if (keyword == "facet") {
            if (points != 3 * facets++)
                throw source.badLine(number, "begins a facet where the last one has no three points");
        } else if (keyword == "vertex") {
            bool finite = true;
            for (int axis = 0; axis < 3; ++axis) {
                double value = 0;
                if (!parse(takeWord(line), value)) throw source.badLine(number, "has a point without three numbers");
                finite = finite && std::isfinite(value);
            }
            bad += !finite;
            if (++points > 3 * facets) throw source.badLine(number, "has a point too many");
        } else if (keyword != "solid" && keyword != "outer" && keyword != "endloop" && keyword != "endfacet" &&
                   !closed) {
            throw source.badLine(number, "begins with no keyword of STL");
        }
    }
    if (!closed || points != 3 * facets) throw source.cutShort();
    if (facets == 0) throw source.noFaces();
    source.checkFinite(bad, points);
    return facets;
}

/// A binary STL has 80 bytes of anything, a count of triangles and 50 bytes for each.
size_t checkStl(std::string_view data, const MeshSource& source) {
    uint32_t count = 0;
    if (data.size() >= 84) std::memcpy(&count, data.data() + 80, sizeof count);
    return data.size() == 84 + size_t(50) * count ? count : checkTextStl(data, source);
}

// ---- PLY

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
    const PlyType* count; ///< Null unless it is a list.
};

struct PlyElement {
    std::string_view name;
    size_t count;
    std::vector<PlyProperty> properties;
};

/// Walks through all of a PLY.
class PlyCheck {
  public:
    PlyCheck(std::string_view data, const MeshSource& source) : mRest(data), mSource(source) {}

    size_t check() {
        readHeading();
        const PlyElement* points = find("vertex");
        const PlyElement* faces = find("face");
        if (!faces || faces->count == 0) throw mSource.noFaces();
        if (!points) throw badHeading("has no element vertex");
        for (const std::string_view axis : {"x", "y", "z"})
            if (std::none_of(points->properties.begin(), points->properties.end(),
                             [&](const PlyProperty& p) { return p.name == axis && !p.count; }))
                throw badHeading(fmt::format("has no property {} of a vertex", axis));
        if (std::none_of(faces->properties.begin(), faces->properties.end(), isCorners))
            throw badHeading("has no list vertex_indices of a face");
        for (const PlyElement& element : mElements) checkElement(element, points->count);
        mSource.checkFinite(mBad, points->count);
        return faces->count;
    }

  private:
    static bool isCorners(const PlyProperty& p) {
        return p.count && !p.type->real && (p.name == "vertex_indices" || p.name == "vertex_index");
    }

    FileError badHeading(const std::string& why) const {
        return mSource.error(fmt::format("its PLY heading {}; it is damaged or of another kind", why));
    }

    const PlyElement* find(std::string_view name) const {
        const auto found =
            std::find_if(mElements.begin(), mElements.end(), [&](const auto& e) { return e.name == name; });
        return found == mElements.end() ? nullptr : &*found;
    }

    const PlyType* typeOf(std::string_view name) const {
        for (const PlyType& type : kPlyTypes)
            if (name == type.name || name == type.alias) return &type;
        throw badHeading("has a property of an unknown type");
    }

    void readHeading() {
        std::string_view line = takeLine(mRest);
        if (takeWord(line) != "ply") throw mSource.error("it does not begin as a PLY; give a .ply file");
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
                throw badHeading("has a line that is no part of one");
            }
        }
        if (!hasFormat) throw badHeading("has no format");
    }

    void readFormat(std::string_view format) {
        if (format == "ascii")
            mFormat = PlyFormat::text;
        else if (format == "binary_little_endian")
            mFormat = PlyFormat::little;
        else if (format == "binary_big_endian")
            mFormat = PlyFormat::big;
        else
            throw badHeading("has an unknown format");
    }

    void readElement(std::string_view line) {
        const std::string_view name = takeWord(line);
        int64_t count = 0;
        if (!parse(takeWord(line), count) || !std::in_range<uint32_t>(count) || find(name))
            throw badHeading("has an unusable element");
        mElements.push_back({name, size_t(count), {}});
    }

    void readProperty(std::string_view line) {
        std::string_view word = takeWord(line);
        const PlyType* count = nullptr;
        if (word == "list") {
            count = typeOf(takeWord(line));
            if (count->real) throw badHeading("has a list with an unusable count");
            word = takeWord(line);
        }
        const PlyType* type = typeOf(word);
        const std::string_view name = takeWord(line);
        if (name.empty()) throw badHeading("has a property without a name");
        std::vector<PlyProperty>& properties = mElements.back().properties;
        if (std::any_of(properties.begin(), properties.end(), [&](const PlyProperty& p) { return p.name == name; }))
            throw badHeading("has a property twice");
        properties.push_back({name, type, count});
    }

    void checkElement(const PlyElement& element, size_t points) {
        if (element.properties.empty() && element.count > 0) throw badHeading("has an element without properties");
        for (size_t n = 0; n < element.count; ++n) {
            if (mFormat == PlyFormat::text) nextLine();
            bool finite = true;
            for (const PlyProperty& property : element.properties) {
                if (property.count) {
                    checkList(property, element.name == "face" && isCorners(property), points);
                } else {
                    const double value = next(*property.type);
                    const bool isAxis = property.name == "x" || property.name == "y" || property.name == "z";
                    finite = finite && (!isAxis || std::isfinite(value));
                }
            }
            mBad += element.name == "vertex" && !finite;
            if (!takeWord(mLine).empty()) throw mSource.error("a line of it has too many numbers; it is damaged");
        }
    }

    void checkList(const PlyProperty& property, bool corners, size_t points) {
        const double given = next(*property.count);
        if (!(given >= 0 && given <= double(std::numeric_limits<uint32_t>::max()))) throw mSource.cutShort();
        const auto count = size_t(given);
        if (corners && count < 3) throw mSource.error(fmt::format("it has a face of {} corners; it is damaged", count));
        for (size_t n = 0; n < count; ++n) {
            const double value = next(*property.type);
            if (corners && !(value >= 0 && value < double(points)))
                throw mSource.error(fmt::format("it has a face with the corner {:g}, and points 0 to {}; it is damaged",
                                                value, double(points) - 1));
        }
    }

    void nextLine() {
        do {
            if (mRest.empty()) throw mSource.cutShort();
            mLine = takeLine(mRest);
        } while (std::all_of(mLine.begin(), mLine.end(), isBlank));
    }

    /// The next number of the data.
    double next(const PlyType& type) {
        double value = 0;
        if (mFormat == PlyFormat::text) {
            const std::string_view word = takeWord(mLine);
            if (word.empty()) throw mSource.cutShort();
            if (!parse(word, value) || (!type.real && value != std::floor(value)))
                throw mSource.error("it has something that is not a number where there should be one; it is damaged");
            return value;
        }
        if (mRest.size() < type.size) throw mSource.cutShort();
        uint64_t bits = 0;
        for (size_t k = 0; k < type.size; ++k) {
            const char byte = mRest[mFormat == PlyFormat::big ? type.size - 1 - k : k];
            bits |= uint64_t(static_cast<unsigned char>(byte)) << 8 * k;
        }
        mRest.remove_prefix(type.size);
        if (type.real) {
            value = type.size == 4 ? double(std::bit_cast<float>(uint32_t(bits))) : std::bit_cast<double>(bits);
            return std::abs(value) > kLargest ? HUGE_VAL : value;
        }
        const uint64_t sign = type.isSigned ? uint64_t(1) << ((8 * type.size - 1) & 63) : 0;
        return double(int64_t(bits ^ sign) - int64_t(sign)); // integers have 4 bytes at most
    }

    std::string_view mRest, mLine;
    const MeshSource& mSource;
    PlyFormat mFormat = PlyFormat::text;
    std::vector<PlyElement> mElements;
    size_t mBad = 0;
};

} // namespace

size_t checkMesh(std::string& content, std::string_view extension, const MeshSource& source) {
    if (extension == "obj") return prepareObj(content, source);
    if (extension == "ply") return PlyCheck(content, source).check();
    return checkStl(content, source);
}

} // namespace curlew
