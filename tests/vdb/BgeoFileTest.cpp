// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/BgeoFile.h"
#include "support/HostObjects.h"

#include <algorithm>

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;
using Folder = ScratchFolder;

namespace {

/// Appends big-endian values, as the format's documentation has them, independently of the writer.
class Bytes {
  public:
    template <class T>
    Bytes& operator<<(T value) {
        std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
        std::reverse(bytes.begin(), bytes.end());
        text += bytes;
        return *this;
    }
    Bytes& word(const std::string& word) {
        text += word;
        return *this;
    }
    /// A declaration: the name with its length, the size, the type, and zeros for the default.
    Bytes& attribute(const std::string& name, uint16_t size, int32_t type) {
        *this << static_cast<uint16_t>(name.size());
        word(name) << size << type;
        for (int k = 0; k < size; ++k) *this << int32_t{0};
        return *this;
    }
    Bytes& header(int32_t points, int32_t primitives, int32_t pointAttributes, int32_t primitiveAttributes) {
        word("BgeoV");
        return *this << int32_t{5} << points << primitives << int32_t{0} << int32_t{0} << pointAttributes << int32_t{0}
                     << primitiveAttributes << int32_t{0};
    }
    std::string text;
};

void requireSame(const Points& a, const Points& b) {
    CHECK((a.x == b.x && a.y == b.y && a.z == b.z && a.id == b.id));
    CHECK((a.vx == b.vx && a.vy == b.vy && a.vz == b.vz));
    CHECK((a.age == b.age && a.life == b.life && a.fade == b.fade && a.f == b.f && a.g == b.g));
}

} // namespace

TEST_CASE("BgeoFile: points have the documented bytes", "[vdb]") {
    const Folder folder;
    Points p = Points::at({{{1, 2, 3}}});
    p.id = {9};
    p.vx = {4}, p.vy = {5}, p.vz = {6};
    writeBgeo(folder / "a.bgeo", p);
    Bytes expected;
    expected.header(1, 0, 2, 0).attribute("v", 3, 5).attribute("id", 1, 1)
        << 1.0f << 2.0f << 3.0f << 1.0f << 4.0f << 5.0f << 6.0f << int32_t{9};
    expected.word(std::string("\0\xff", 2));
    CHECK((bytesOf(folder / "a.bgeo") == expected.text));
}

TEST_CASE("BgeoFile: curves are open and closed polygons with the documented bytes", "[vdb]") {
    const Folder folder;
    Curves c = curvesOfSizes({2, 1});
    c.f.clear(), c.g.clear();
    writeBgeo(folder / "a.bgeo", c);
    Bytes expected;
    expected.header(3, 2, 2, 1).attribute("v", 3, 5).attribute("length", 1, 0);
    for (size_t v = 0; v < 3; ++v)
        expected << static_cast<float>(c.x[v]) << static_cast<float>(c.y[v]) << static_cast<float>(c.z[v]) << 1.0f
                 << c.vx[v] << c.vy[v] << c.vz[v] << static_cast<float>(c.along[v]);
    expected.attribute("id", 1, 1) << int32_t{1} << int32_t{2} << ':' << uint16_t{0} << uint16_t{1} << int32_t{100};
    expected << int32_t{1} << int32_t{1} << '<' << uint16_t{2} << int32_t{99};
    expected.word(std::string("\0\xff", 2));
    CHECK((bytesOf(folder / "a.bgeo") == expected.text));
}

TEST_CASE("BgeoFile: points and curves are read back as written", "[vdb]") {
    const Folder folder;
    const Points p = particlesWithEverything(100);
    writeBgeo(folder / "p.bgeo", p);
    CHECK(!bgeoHasCurves(folder / "p.bgeo"));
    const BgeoContent points = readBgeo(folder / "p.bgeo");
    CHECK(points.skipped.empty());
    requireSame(std::get<Points>(points.geometry), p);

    const auto sizes =
        GENERATE(std::vector<size_t>{4, 3, 1}, std::vector<size_t>{70000, 3}); // indices of 16 and 32 bits
    const Curves c = curvesOfSizes(sizes);
    writeBgeo(folder / "c.bgeo", c);
    CHECK(bgeoHasCurves(folder / "c.bgeo"));
    const Curves read = std::get<Curves>(readBgeo(folder / "c.bgeo").geometry);
    CHECK(
        (read.x == c.x && read.y == c.y && read.z == c.z && read.vx == c.vx && read.f == c.f && read.along == c.along));
    CHECK((read.start == c.start && read.id == c.id && read.downstream == c.downstream));
    writeBgeo(folder / "d.bgeo", read);
    CHECK((bytesOf(folder / "c.bgeo") == bytesOf(folder / "d.bgeo")));
}

TEST_CASE("BgeoFile: reads runs of polygons, index attributes and particle systems of others", "[vdb]") {
    const Folder folder;
    Bytes run;
    run.header(3, 2, 1, 0) << uint16_t{4};
    run.word("kind") << uint16_t{1} << int32_t{4} << int32_t{1} << uint16_t{3}; // an index into one string
    run.word("abc");
    for (int n = 0; n < 3; ++n) run << static_cast<float>(n) << 0.0f << 0.0f << 1.0f << int32_t{0};
    run << int32_t{-1} << uint16_t{2} << int32_t{1};
    run << int32_t{2} << ':' << uint16_t{2} << uint16_t{0};
    run << int32_t{3} << '<' << uint16_t{0} << uint16_t{1} << uint16_t{2};
    run.word(std::string("\0\xff", 2));
    const BgeoContent content = readBgeo(store(folder / "run.bgeo", run.text));
    CHECK(content.skipped == std::vector<std::string>{"kind"});
    const Curves c = std::get<Curves>(content.geometry);
    CHECK(c.start == std::vector<size_t>{0, 2, 5});
    CHECK(c.x == std::vector<double>{2, 0, 0, 1, 2});
    CHECK((!c.closed(0) && c.closed(1)));
    CHECK(c.along == std::vector<double>{0, 2, 0, 1, 2});
    CHECK(c.length == std::vector<double>{2, 4});

    Bytes particles;
    particles.header(2, 1, 0, 0) << 1.0f << 2.0f << 3.0f << 1.0f << 4.0f << 5.0f << 6.0f << 1.0f;
    particles << int32_t{0x8000} << int32_t{2} << uint16_t{0} << uint16_t{1};
    const Points p = std::get<Points>(readBgeo(store(folder / "p.bgeo", particles.text)).geometry);
    CHECK(p.position(1) == Vec3d{{4, 5, 6}});
    CHECK(p.id == std::vector<int64_t>{0, 1});
}

TEST_CASE("BgeoFile: damaged and unsupported files are refused", "[vdb]") {
    const Folder folder;
    const auto complaint = [&](const std::string& bytes) {
        return messageOf([&] { readBgeo(store(folder / "b.bgeo", bytes)); });
    };
    writeBgeo(folder / "a.bgeo", curvesOfSizes({4, 3}));
    const std::string good = bytesOf(folder / "a.bgeo");
    for (size_t size = 5; size + 2 < good.size(); size += 7) {
        CAPTURE(size);
        CHECK_THAT(complaint(good.substr(0, size)), ContainsSubstring("cut short or damaged"));
    }
    CHECK_THAT(complaint("\x7fNSJb and more"), ContainsSubstring("Houdini 12"));
    CHECK_THAT(complaint("something else"), ContainsSubstring("another kind of file"));
    Bytes faces;
    faces.header(3, 1, 0, 0);
    for (int n = 0; n < 12; ++n) faces << 1.0f;
    faces << int32_t{1} << int32_t{3} << '<' << uint16_t{0} << uint16_t{1} << uint16_t{2};
    CHECK_THAT(complaint(faces.text), ContainsSubstring("it holds faces"));
    CHECK_THAT(messageOf([&] { bgeoHasCurves(store(folder / "b.bgeo", faces.text)); }),
               ContainsSubstring("it holds faces"));
    Bytes outside;
    outside.header(1, 1, 0, 0) << 1.0f << 1.0f << 1.0f << 1.0f << int32_t{1} << int32_t{1} << ':' << uint16_t{1};
    CHECK_THAT(complaint(outside.text), ContainsSubstring("does not exist"));
    Bytes many;
    many.header(2000000000, 0, 0, 0) << 1.0f;
    CHECK_THAT(complaint(many.text), ContainsSubstring("cut short"));
    Bytes sphere;
    sphere.header(1, 1, 0, 0) << 1.0f << 1.0f << 1.0f << 1.0f << int32_t{0x20};
    CHECK_THAT(complaint(sphere.text), ContainsSubstring("other than polygons"));
    Bytes infinite;
    infinite.header(1, 0, 0, 0) << std::numeric_limits<float>::infinity() << 1.0f << 1.0f << 1.0f;
    CHECK_THAT(complaint(infinite.text), ContainsSubstring("not a finite number"));
    Points large = particlesWithEverything(1);
    large.id = {int64_t{1} << 40};
    CHECK_THAT(messageOf([&] { writeBgeo(folder / "c.bgeo", large); }), ContainsSubstring("32 bits"));
}
