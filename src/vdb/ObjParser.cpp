// SPDX-License-Identifier: Apache-2.0
#include "MeshParser.h"

#include <algorithm>
#include <array>

namespace curlew {

namespace {

class ObjParser {
  public:
    ObjParser(std::string_view text, const MeshSource& source) : mRest(text), mSource(source) {}

    Polygons parse() {
        while (!mRest.empty()) {
            mSource.check(++mLine);
            std::string_view line = takeLine(mRest);
            line = line.substr(0, line.find('#'));
            const std::string_view keyword = takeWord(line);
            if (keyword == "v")
                addPoint(line);
            else if (keyword == "f")
                addFace(line);
        }
        if (mPolygons.sizes.empty()) throw mSource.noFaces();
        if (mLargest > points())
            throw mSource.badLine(
                mLineOfLargest, fmt::format("has a face with vertex {}, but there are {} points", mLargest, points()));
        mSource.checkPoints(mBad, mPolygons.points.size());
        numberByUse();
        return std::move(mPolygons);
    }

  private:
    int64_t points() const { return static_cast<int64_t>(mPolygons.points.size()); }

    /// Reads three coordinates, optionally followed by a weight or a colour.
    void addPoint(std::string_view line) {
        std::array<float, 4> numbers{};
        size_t words = 0;
        for (std::string_view word = takeWord(line); !word.empty(); word = takeWord(line), ++words) {
            float value = 0;
            if (!curlew::parse(word, value))
                throw mSource.badLine(mLine, "has a point with a coordinate that is not a number");
            if (words < numbers.size()) numbers[words] = value;
        }
        if (words != 3 && words != 4 && words != 6)
            throw mSource.badLine(
                mLine, fmt::format("has a point with {} numbers (3, 4 with a weight, 6 with a colour)", words));
        openvdb::Vec3s point(numbers.data());
        if (words == 4)
            for (int axis = 0; axis < 3; ++axis) point[axis] /= numbers[3];
        mBad += !point.isFinite();
        mPolygons.points.push_back(point);
    }

    /// Reads a face. Vertex indices count from 1, or backwards from -1, the newest point. UV and normal indices follow
    /// after slashes and are ignored.
    void addFace(std::string_view line) {
        uint32_t corners = 0;
        for (std::string_view word = takeWord(line); !word.empty(); word = takeWord(line), ++corners) {
            int64_t index = 0;
            if (!curlew::parse(word.substr(0, word.find('/')), index) ||
                word.find_first_not_of("-0123456789/") != std::string_view::npos)
                throw mSource.badLine(mLine, "has a face with an entry that is not a vertex");
            if (index == 0 || index < -points())
                throw mSource.badLine(mLine, fmt::format("has a face with vertex {}", index));
            if (index > mLargest) mLargest = index, mLineOfLargest = mLine;
            mPolygons.corners.push_back(static_cast<uint32_t>(index > 0 ? index - 1 : points() + index));
        }
        if (corners < 3) throw mSource.badLine(mLine, fmt::format("has a face with {} vertices", corners));
        mPolygons.sizes.push_back(corners);
    }

    /// Renumbers points in the order in which faces use them.
    void numberByUse() {
        constexpr uint32_t kNone = ~uint32_t(0);
        std::vector<uint32_t> numbers(mPolygons.points.size(), kNone);
        std::vector<openvdb::Vec3s> used;
        for (uint32_t& corner : mPolygons.corners) {
            uint32_t& number = numbers[corner];
            if (number == kNone) {
                number = static_cast<uint32_t>(used.size());
                used.push_back(mPolygons.points[corner]);
            }
            corner = number;
        }
        mPolygons.points = std::move(used);
    }

    std::string_view mRest;
    const MeshSource& mSource;
    Polygons mPolygons;
    size_t mLine = 0, mLineOfLargest = 0, mBad = 0;
    int64_t mLargest = 0;
};

} // namespace

void unifyLines(std::string& text) {
    constexpr std::string_view kSpecial = "\r\\#";
    for (size_t n = text.find_first_of(kSpecial); n < text.size(); n = text.find_first_of(kSpecial, n + 1)) {
        if (text[n] == '#') { // a comment is not continued
            n = std::min(text.find_first_of("\r\n", n), text.size()) - 1;
            continue;
        }
        if (text[n] == '\r') text[n] = n + 1 < text.size() && text[n + 1] == '\n' ? ' ' : '\n';
        const size_t next = std::min(text.find_first_not_of('\r', n + 1), text.size());
        if (text[n] == '\\' && next < text.size() && text[next] == '\n') std::fill(&text[n], &text[next] + 1, ' ');
    }
}

Polygons parseObj(std::string text, const MeshSource& source) {
    if (text.find('\0') != std::string::npos) throw source.error("it is not text; give a Wavefront .obj file");
    unifyLines(text);
    return ObjParser(text, source).parse();
}

} // namespace curlew
