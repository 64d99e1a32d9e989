// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/Openvdb.h"
#include "curlew/vdb/UsdFile.h"
#include "support/HostObjects.h"

#include <map>
#include <memory>

using namespace curlew;
using namespace curlew::test;
using Catch::Matchers::ContainsSubstring;
using Folder = ScratchFolder;

namespace {

/// A prim of a layer: its attributes and relationships as text without blanks, and its children.
struct Prim {
    std::string type;
    std::map<std::string, std::string> attributes;
    std::map<std::string, Prim> children;
};

/// A reader of the part of the .usda grammar that the writer uses: prims, attributes with values or time samples,
/// metadata in parentheses. It fails on everything else.
class UsdaReader {
  public:
    explicit UsdaReader(std::string text) : mText(std::move(text)) {}

    Prim read() {
        REQUIRE(mText.substr(0, 10) == "#usda 1.0\n");
        mAt = 10;
        Prim root;
        root.attributes["metadata"] = enclosed();
        while (skipBlanks(), mAt < mText.size()) readPrim(root);
        return root;
    }

  private:
    void skipBlanks() {
        while (mAt < mText.size() && std::isspace(static_cast<unsigned char>(mText[mAt]))) ++mAt;
    }
    std::string word() {
        skipBlanks();
        const size_t begin = mAt;
        while (mAt < mText.size() && !std::isspace(static_cast<unsigned char>(mText[mAt]))) ++mAt;
        return mText.substr(begin, mAt - begin);
    }
    /// Takes a value up to the end of the line, or of the brackets that it opens. Removes blanks.
    std::string enclosed() {
        skipBlanks();
        std::string taken;
        int depth = 0;
        bool inText = false, inPath = false, triple = false; // a path between @@@ may contain @
        for (; mAt < mText.size(); ++mAt) {
            const char c = mText[mAt];
            if (c == '"') inText = !inText;
            if (c == '@' && !(inPath && triple && mText.compare(mAt, 3, "@@@") != 0)) {
                if (!inPath) triple = mText.compare(mAt, 3, "@@@") == 0;
                inPath = !inPath;
                if (triple) taken += mText.substr(mAt, 2);
                if (triple) mAt += 2;
            }
            const bool plain = !inText && !inPath;
            if (plain && (c == '(' || c == '[' || c == '{')) ++depth;
            if (plain && (c == ')' || c == ']' || c == '}')) --depth;
            REQUIRE(depth >= 0);
            if (!std::isspace(static_cast<unsigned char>(c)) || !plain) taken += c;
            if (plain && c == '\n' && depth == 0) break;
        }
        REQUIRE((depth == 0 && !inText && !inPath));
        return taken;
    }
    void readPrim(Prim& parent) {
        REQUIRE(word() == "def");
        const std::string type = word(), name = word();
        REQUIRE((name.size() > 2 && name.front() == '"' && name.back() == '"'));
        Prim& prim = parent.children[name.substr(1, name.size() - 2)];
        prim.type = type;
        REQUIRE(word() == "{");
        for (skipBlanks(); mText[mAt] != '}'; skipBlanks()) {
            if (mText.compare(mAt, 4, "def ") == 0)
                readPrim(prim);
            else
                readAttribute(prim);
        }
        ++mAt;
    }
    void readAttribute(Prim& prim) {
        std::string type = word();
        if (type == "uniform") type = word();
        const std::string name = word();
        skipBlanks();
        if (mText[mAt] == '=') {
            ++mAt;
            prim.attributes[type + " " + name] = enclosed();
        } else {
            prim.attributes[type + " " + name + " metadata"] = enclosed();
        }
    }

    std::string mText;
    size_t mAt = 0;
};

Prim readUsda(const std::filesystem::path& path) { return UsdaReader(bytesOf(path)).read(); }

template <class T>
std::shared_ptr<const T> shared(T value) {
    return std::make_shared<const T>(std::move(value));
}

const UsdOptions kTwoFrames{.fps = 24, .first = 1, .last = 2};

} // namespace

TEST_CASE("UsdFile: points have velocities, ids and time samples", "[vdb]") {
    const Folder folder;
    writeUsda(folder / "dust.usda",
              std::vector<UsdSample<Points>>{{1, shared(particlesWithEverything(2))},
                                             {2, shared(particlesWithEverything(3))}},
              kTwoFrames);
    const Prim layer = readUsda(folder / "dust.usda");
    CHECK(
        layer.attributes.at("metadata") ==
        "(defaultPrim=\"dust\"endTimeCode=2framesPerSecond=24metersPerUnit=1startTimeCode=1timeCodesPerSecond=24upAxis="
        "\"Y\")");
    const Prim& dust = layer.children.at("dust");
    CHECK(dust.type == "Points");
    CHECK(dust.attributes.at("point3f[] points.timeSamples") ==
          "{1:[(0,0,-0),(1,0.5,-1)],2:[(0,0,-0),(1,0.5,-1),(2,1,-2)],}");
    CHECK(dust.attributes.at("vector3f[] velocities.timeSamples") ==
          "{1:[(1,0,-2),(1,1,-2)],2:[(1,0,-2),(1,1,-2),(1,2,-2)],}");
    CHECK(dust.attributes.at("int64[] ids.timeSamples") == "{1:[5,8],2:[5,8,11],}");
    CHECK(dust.attributes.at("float[] primvars:life.timeSamples") == "{1:[inf,2],2:[inf,2,inf],}");
    CHECK(dust.attributes.at("float[] primvars:life metadata") == "(interpolation=\"vertex\")");
    CHECK(dust.attributes.at("float3[] extent.timeSamples") ==
          "{1:[(-0.07874507,-0.07874507,-1.0787451),(1.0787451,0.57874507,0.07874507)],"
          "2:[(-0.07874507,-0.07874507,-2.0787451),(2.0787451,1.0787451,0.07874507)],}"); // with half the width
    CHECK(dust.attributes.at("float[] widths").find("](interpolation=\"constant\")") != std::string::npos);
}

TEST_CASE("UsdFile: a still has no time and the host's axes and unit", "[vdb]") {
    const Folder folder;
    Points p = Points::at({{{1, 2, 3}}});
    writeUsda(folder / "9 a.0001.usda", std::vector<UsdSample<Points>>{{7, shared(p)}},
              {.zUp = true, .metresPerUnit = 0.01});
    const Prim layer = readUsda(folder / "9 a.0001.usda");
    CHECK(layer.attributes.at("metadata") == "(defaultPrim=\"_9_a\"metersPerUnit=0.01upAxis=\"Z\")");
    const Prim& prim = layer.children.at("_9_a");
    CHECK(prim.attributes.at("point3f[] points") == "[(1,2,3)]");
    CHECK(prim.attributes.count("vector3f[] velocities") == 0);
}

TEST_CASE("UsdFile: open and closed curves are two prims", "[vdb]") {
    const Folder folder;
    writeUsda(folder / "lines.usda", std::vector<UsdSample<Curves>>{{1, shared(curvesOfSizes({2, 3, 0, 0, 1}))}});
    const Prim lines = readUsda(folder / "lines.usda").children.at("lines");
    CHECK(lines.type == "Xform");
    REQUIRE(lines.children.size() == 2);
    const Prim &open = lines.children.at("open"), &closed = lines.children.at("closed");
    CHECK((open.type == "BasisCurves" && closed.type == "BasisCurves"));
    CHECK(open.attributes.at("token type") == "\"linear\"");
    CHECK(open.attributes.at("token wrap") == "\"nonperiodic\"");
    CHECK(closed.attributes.at("token wrap") == "\"periodic\"");
    CHECK(open.attributes.at("int[] curveVertexCounts") == "[2,1]");
    CHECK(closed.attributes.at("int[] curveVertexCounts") == "[3]");
    CHECK(open.attributes.at("point3f[] points") == "[(0,0,-0),(1,0,-1),(5,4,-5)]");
    CHECK(closed.attributes.at("vector3f[] velocities") == "[(2,1,0.5),(3,1,0.5),(4,1,0.5)]");
    CHECK(open.attributes.at("int64[] primvars:id") == "[100,96](interpolation=\"uniform\")");
    CHECK(closed.attributes.at("float[] primvars:f") == "[2,3,4](interpolation=\"vertex\")");
}

TEST_CASE("UsdFile: a volume refers to the grids of a sequence", "[vdb]") {
    const Folder folder;
    auto density = openvdb::FloatGrid::create();
    density->setName("density");
    density->setGridClass(openvdb::GRID_FOG_VOLUME);
    auto faces = rampGrid();
    faces->setGridClass(openvdb::GRID_STAGGERED);
    faces->setSaveFloatAsHalf(true);
    writeUsda(folder / "smoke.usda", {density, faces},
              {{1, folder / "smoke.0001.vdb"}, {2, folder / "a@b" / "smoke.0002.vdb"}}, kTwoFrames);
    const Prim smoke = readUsda(folder / "smoke.usda").children.at("smoke");
    CHECK(smoke.type == "Volume");
    CHECK(smoke.attributes.at("rel field:density") == "</smoke/density>");
    CHECK(smoke.attributes.at("rel field:vel") == "</smoke/vel>");
    const Prim &fog = smoke.children.at("density"), &vel = smoke.children.at("vel");
    CHECK((fog.type == "OpenVDBAsset" && vel.type == "OpenVDBAsset"));
    CHECK(fog.attributes.at("asset filePath.timeSamples") == "{1:@./smoke.0001.vdb@,2:@@@./a@b/smoke.0002.vdb@@@,}");
    CHECK(fog.attributes.at("token fieldClass") == "\"fogVolume\"");
    CHECK(fog.attributes.at("token fieldDataType") == "\"float\"");
    CHECK(fog.attributes.at("token fieldName") == "\"density\"");
    CHECK(fog.attributes.count("token vectorDataRoleHint") == 0);
    CHECK(vel.attributes.at("token fieldClass") == "\"staggered\"");
    CHECK(vel.attributes.at("token fieldDataType") == "\"half3\"");
    CHECK(vel.attributes.at("token vectorDataRoleHint") == "\"Vector\"");
}

TEST_CASE("UsdFile: refuses values that other programs cannot read", "[vdb]") {
    const Folder folder;
    Points p = particlesWithEverything(2);
    p.y[1] = std::numeric_limits<double>::quiet_NaN();
    CHECK_THAT(messageOf([&] {
                   writeUsda(folder / "a.usda", std::vector<UsdSample<Points>>{{1, shared(p)}});
               }),
               ContainsSubstring("point 1 has a position"));
    CHECK_THAT(messageOf([&] { writeUsda(folder / "a.usda", std::vector<UsdSample<Curves>>{}); }),
               ContainsSubstring("nothing"));
    CHECK_THAT(messageOf([&] {
                   writeUsda(folder / "a.usda", {rampGrid(), rampGrid()}, {{1, "a.vdb"}});
               }),
               ContainsSubstring("two grids are called 'vel'"));
    CHECK_THAT(messageOf([&] { writeUsda(folder / "a.usda", {rampGrid()}, {}); }), ContainsSubstring("give the .vdb"));
    CHECK(folder.files() == 0);
}

TEST_CASE("UsdFile: control characters in names are escaped", "[vdb]") {
    const Folder folder;
    const std::vector<openvdb::GridBase::ConstPtr> grids{rampGrid("a\n\tb \"c\"")};
    writeUsda(folder / "a.usda", grids, std::vector<UsdAsset>{{1, folder / "a.vdb"}});
    CHECK_THAT(bytesOf(folder / "a.usda"), ContainsSubstring(R"(fieldName = "a\x0a\x09b \"c\"")"));
}
