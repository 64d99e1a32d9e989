// SPDX-License-Identifier: Apache-2.0
#include "curlew/vdb/UsdFile.h"

#include "ChunkedWriter.h"
#include "CurveArrays.h"
#include "DenseBox.h"
#include "FiniteChecks.h"
#include "PointArrays.h"
#include "curlew/base/AtomicFile.h"
#include "curlew/vdb/Openvdb.h"

#include <fmt/compile.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <set>
#include <string_view>
#include <utility>

namespace curlew {

namespace {

namespace fs = std::filesystem;
using openvdb::GridBase;

/// Returns a name that a prim can have: letters, digits and _, not beginning with a digit.
std::string identifierOf(const std::string& text) {
    std::string name;
    for (const char c : text)
        name += std::isalnum(static_cast<unsigned char>(c)) && static_cast<signed char>(c) > 0 ? c : '_';
    if (name.empty() || std::isdigit(static_cast<unsigned char>(name.front()))) name.insert(name.begin(), '_');
    return name;
}

/// Returns the name of the default prim: that of the file without its frame.
std::string primNameOf(const fs::path& path) {
    return identifierOf(path.filename().replace_extension().stem().string());
}

std::string inQuotes(std::string_view text) {
    std::string result = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') result += '\\';
        if (static_cast<unsigned char>(c) < ' ')
            result += fmt::format("\\x{:02x}", static_cast<unsigned char>(c)); // a line end would end the string
        else
            result += c;
    }
    return result + '"';
}

std::string headerOf(const std::string& prim, const UsdOptions& options) {
    std::string text = fmt::format("#usda 1.0\n(\n    defaultPrim = {}\n", inQuotes(prim));
    if (options.fps)
        text += fmt::format("    endTimeCode = {}\n    framesPerSecond = {}\n", options.last, *options.fps);
    text += fmt::format("    metersPerUnit = {}\n", options.metresPerUnit);
    if (options.fps)
        text += fmt::format("    startTimeCode = {}\n    timeCodesPerSecond = {}\n", options.first, *options.fps);
    return text + fmt::format("    upAxis = \"{}\"\n)\n\n", options.zUp ? "Z" : "Y");
}

// ---- Attributes

/// Appends element n of an array to a text.
using Append = std::function<void(size_t n, std::string& text)>;

/// The value of an attribute at a frame.
struct UsdValue {
    double frame;
    size_t count;
    Append append;
};

void writeArray(std::ostream& out, const UsdValue& value) {
    out << '[';
    writeChunks(out, value.count, [&](size_t begin, size_t end, std::string& text) {
        for (size_t n = begin; n < end; ++n) {
            if (n > 0) text += ", ";
            value.append(n, text);
        }
    });
    out << ']';
}

/// Writes `type[] name = […]`, or its time samples. `more` follows in parentheses.
void writeAttribute(std::ostream& out, const std::string& indent, std::string_view declaration,
                    const std::vector<UsdValue>& values, bool timed, std::string_view more = "") {
    const auto end = [&] {
        if (!more.empty()) out << " (\n" << indent << "    " << more << '\n' << indent << ')';
        out << '\n';
    };
    if (!timed) {
        out << indent << declaration << " = ";
        writeArray(out, values.front());
        return end();
    }
    if (!more.empty()) { // an attribute's metadata needs a declaration of its own beside time samples
        out << indent << declaration;
        end();
    }
    out << indent << declaration << ".timeSamples = {\n";
    for (const UsdValue& value : values) {
        out << indent << "    " << fmt::format("{}", value.frame) << ": ";
        writeArray(out, value);
        out << ",\n";
    }
    out << indent << "}\n";
}

template <class T>
Append vectorOf(const std::vector<T>& x, const std::vector<T>& y, const std::vector<T>& z) {
    return [&](size_t n, std::string& text) {
        fmt::format_to(std::back_inserter(text), FMT_COMPILE("({}, {}, {})"), static_cast<float>(x[n]),
                       static_cast<float>(y[n]), static_cast<float>(z[n]));
    };
}

template <class T>
Append numberOf(const std::vector<T>& values) {
    return [&](size_t n, std::string& text) {
        if constexpr (std::is_same_v<T, double>)
            fmt::format_to(std::back_inserter(text), FMT_COMPILE("{}"), static_cast<float>(values[n]));
        else
            fmt::format_to(std::back_inserter(text), FMT_COMPILE("{}"), values[n]);
    };
}

/// The lower and the upper corner of what has these positions and this radius.
template <class Geometry>
UsdValue extentOf(double frame, const Geometry& g, float radius) {
    std::array<std::array<float, 3>, 2> corners{};
    const auto range = [&](const std::vector<double>& values, size_t axis) {
        if (values.empty()) return;
        const auto [least, most] = std::minmax_element(values.begin(), values.end());
        corners[0][axis] = static_cast<float>(*least) - radius, corners[1][axis] = static_cast<float>(*most) + radius;
    };
    range(g.x, 0), range(g.y, 1), range(g.z, 2);
    return {frame, 2, [corners](size_t n, std::string& text) {
                text += fmt::format("({}, {}, {})", corners[n][0], corners[n][1], corners[n][2]);
            }};
}

/// A quarter of the distance between neighbours if the points filled their box evenly.
template <class Geometry>
float widthOf(const Geometry& g) {
    double volume = 1;
    for (const auto* values : {&g.x, &g.y, &g.z}) {
        if (values->empty()) return 0.01f;
        const auto [least, most] = std::minmax_element(values->begin(), values->end());
        volume *= std::max(*most - *least, 1e-3);
    }
    return static_cast<float>(0.25 * std::cbrt(volume / static_cast<double>(g.x.size())));
}

template <class Geometry>
class PrimWriter {
  public:
    PrimWriter(std::ostream& out, std::string indent, const std::vector<UsdSample<Geometry>>& samples, bool timed)
        : mOut(out), mIndent(std::move(indent)), mSamples(samples), mTimed(timed) {}

    /// Writes an attribute whose values `array` returns as a function of the geometry: a count and an Append.
    template <class Array>
    void add(std::string_view declaration, const Array& array, std::string_view more = "") {
        std::vector<UsdValue> values;
        for (const auto& sample : mSamples) {
            auto [count, append] = array(*sample.geometry);
            values.push_back({sample.frame, count, std::move(append)});
        }
        writeAttribute(mOut, mIndent, declaration, values, mTimed, more);
    }

    /// The same for an attribute that the geometry has for each vertex or point, if `has` returns true for all samples.
    template <class Has, class Array>
    void addIf(const Has& has, std::string_view declaration, const Array& array, std::string_view more = "") {
        if (std::all_of(mSamples.begin(), mSamples.end(), [&](const auto& sample) { return has(*sample.geometry); }))
            add(declaration, array, more);
    }

    void addExtent() {
        std::vector<UsdValue> values;
        for (const auto& sample : mSamples) values.push_back(extentOf(sample.frame, *sample.geometry, 0.5F * width()));
        writeAttribute(mOut, mIndent, "float3[] extent", values, mTimed);
    }

    void addWidth() {
        mOut << mIndent << fmt::format("float[] widths = [{}] (\n", width()) << mIndent
             << "    interpolation = \"constant\"\n"
             << mIndent << ")\n";
    }

  private:
    float width() const { return widthOf(*mSamples.front().geometry); }

    std::ostream& mOut;
    std::string mIndent;
    const std::vector<UsdSample<Geometry>>& mSamples;
    bool mTimed;
};

using Array = std::pair<size_t, Append>;
constexpr std::string_view kPerVertex = "interpolation = \"vertex\"", kPerCurve = "interpolation = \"uniform\"";

template <class Geometry>
void check(const fs::path& path, const std::vector<UsdSample<Geometry>>& samples, std::string_view what) {
    if (samples.empty()) throw ValueError(fmt::format("there is nothing to write to '{}'", path.string()));
    for (const auto& sample : samples) {
        checkArrays(*sample.geometry);
        requireFinite(*sample.geometry, what);
    }
}

/// Adds what points and the vertices of curves have in common.
template <class Geometry>
void addMotion(PrimWriter<Geometry>& prim) {
    prim.addExtent();
    prim.add("point3f[] points", [](const Geometry& g) { return Array(g.x.size(), vectorOf(g.x, g.y, g.z)); });
    prim.addIf([](const Geometry& g) { return g.vx.size() == g.x.size(); }, "vector3f[] velocities",
               [](const Geometry& g) { return Array(g.x.size(), vectorOf(g.vx, g.vy, g.vz)); });
}

template <class Geometry>
void addTrack(PrimWriter<Geometry>& prim) {
    const auto tracked = [](const Geometry& g) { return g.hasTrack(); };
    prim.addIf(
        tracked, "float[] primvars:f", [](const Geometry& g) { return Array(g.f.size(), numberOf(g.f)); }, kPerVertex);
    prim.addIf(
        tracked, "float[] primvars:g", [](const Geometry& g) { return Array(g.g.size(), numberOf(g.g)); }, kPerVertex);
}

// ---- Curves

/// Returns the open or the closed curves that have vertices.
Curves chosenCurves(const Curves& c, bool closed) {
    Curves chosen;
    chosen.by = c.by;
    for (size_t k = 0; k < c.size(); ++k) {
        if (c.closed(k) != closed || c.start[k + 1] == c.start[k]) continue;
        const auto copy = [&, begin = static_cast<std::ptrdiff_t>(c.start[k]),
                           end = static_cast<std::ptrdiff_t>(c.start[k + 1])](const auto& from, auto& to) {
            if (!from.empty()) to.insert(to.end(), from.begin() + begin, from.begin() + end);
        };
        copy(c.x, chosen.x), copy(c.y, chosen.y), copy(c.z, chosen.z);
        copy(c.vx, chosen.vx), copy(c.vy, chosen.vy), copy(c.vz, chosen.vz);
        copy(c.f, chosen.f), copy(c.g, chosen.g);
        chosen.start.push_back(chosen.x.size());
        chosen.id.push_back(c.id[k]);
    }
    return chosen;
}

void writeCurvesPrim(std::ostream& out, const std::vector<UsdSample<Curves>>& samples, bool closed, bool timed) {
    std::vector<UsdSample<Curves>> chosen;
    bool any = false;
    for (const auto& sample : samples) {
        chosen.push_back({sample.frame, std::make_shared<const Curves>(chosenCurves(*sample.geometry, closed))});
        any = any || chosen.back().geometry->size() > 0;
    }
    if (!any) return;
    out << fmt::format(
        "\n    def BasisCurves \"{}\"\n    {{\n        uniform token type = \"linear\"\n"
        "        uniform token wrap = \"{}\"\n",
        closed ? "closed" : "open", closed ? "periodic" : "nonperiodic");
    PrimWriter<Curves> prim(out, "        ", chosen, timed);
    prim.add("int[] curveVertexCounts", [](const Curves& c) {
        return Array(c.size(), [&c](size_t k, std::string& text) {
            fmt::format_to(std::back_inserter(text), FMT_COMPILE("{}"), c.start[k + 1] - c.start[k]);
        });
    });
    addMotion(prim);
    prim.addWidth();
    prim.add(
        "int64[] primvars:id", [](const Curves& c) { return Array(c.size(), numberOf(c.id)); }, kPerCurve);
    addTrack(prim);
    out << "    }\n";
}

// ---- Volumes

std::string dataTypeOf(const GridBase& grid) {
    static const std::map<std::string, std::string> types{
        {"float", "float"}, {"double", "double"}, {"int32", "int"},     {"int64", "int64"},
        {"bool", "bool"},   {"vec3s", "float3"},  {"vec3d", "double3"}, {"vec3i", "int3"}};
    const auto found = types.find(grid.valueType());
    if (found == types.end())
        throw ValueError(fmt::format("{} is of type {}, which has no name in USD", titleOf(grid), grid.valueType()));
    if (!grid.saveFloatAsHalf()) return found->second;
    return found->second == "float" ? "half" : found->second == "float3" ? "half3" : found->second;
}

const char* classOf(const GridBase& grid) {
    switch (grid.getGridClass()) {
        case openvdb::GRID_LEVEL_SET:
            return "levelSet";
        case openvdb::GRID_FOG_VOLUME:
            return "fogVolume";
        case openvdb::GRID_STAGGERED:
            return "staggered";
        default:
            return "unknown";
    }
}

/// Returns an asset path relative to the layer's folder.
std::string assetPath(const fs::path& layer, const fs::path& file) {
    const fs::path folder = fs::absolute(layer).parent_path();
    std::string path =
        fs::absolute(file).lexically_normal().lexically_relative(folder.lexically_normal()).generic_string();
    if (!path.starts_with("../")) path.insert(0, "./");
    // @@@ encloses paths that contain @.
    return path.find('@') == std::string::npos ? fmt::format("@{}@", path) : fmt::format("@@@{}@@@", path);
}

void writeAsset(std::ostream& out, const GridBase& grid, const std::string& prim, const fs::path& layer,
                const std::vector<UsdAsset>& assets, bool timed) {
    out << fmt::format(
        "\n    def OpenVDBAsset \"{}\"\n    {{\n        token fieldClass = \"{}\"\n"
        "        token fieldDataType = \"{}\"\n        token fieldName = {}\n",
        prim, classOf(grid), dataTypeOf(grid), inQuotes(grid.getName()));
    if (!timed) {
        out << fmt::format("        asset filePath = {}\n", assetPath(layer, assets.front().file));
    } else {
        out << "        asset filePath.timeSamples = {\n";
        for (const UsdAsset& asset : assets)
            out << fmt::format("            {}: {},\n", asset.frame, assetPath(layer, asset.file));
        out << "        }\n";
    }
    if (grid.valueType().starts_with("vec3")) out << "        token vectorDataRoleHint = \"Vector\"\n";
    out << "    }\n";
}

} // namespace

void writeUsda(const fs::path& path, const std::vector<UsdSample<Points>>& samples, const UsdOptions& options,
               const std::function<bool()>& cancelled) {
    check(path, samples, "point");
    const std::string name = primNameOf(path);
    const auto write = [&](std::ostream& out) {
        out << headerOf(name, options) << fmt::format("def Points \"{}\"\n{{\n", name);
        PrimWriter<Points> prim(out, "    ", samples, options.fps.has_value());
        addMotion(prim);
        prim.add("int64[] ids", [](const Points& p) { return Array(p.size(), numberOf(p.id)); });
        prim.addWidth();
        for (const auto& [attribute, values] :
             {std::pair("age", &Points::age), std::pair("life", &Points::life), std::pair("fade", &Points::fade)})
            prim.addIf([values = values](const Points& p) { return (p.*values).size() == p.size(); },
                       fmt::format("float[] primvars:{}", attribute),
                       [values = values](const Points& p) { return Array(p.size(), numberOf(p.*values)); }, kPerVertex);
        addTrack(prim);
        out << "}\n";
    };
    writeAtomically(path, write, cancelled);
}

void writeUsda(const fs::path& path, const std::vector<UsdSample<Curves>>& samples, const UsdOptions& options,
               const std::function<bool()>& cancelled) {
    check(path, samples, "vertex");
    const std::string name = primNameOf(path);
    const auto write = [&](std::ostream& out) {
        out << headerOf(name, options) << fmt::format("def Xform \"{}\"\n{{", name);
        for (const bool closed : {false, true}) writeCurvesPrim(out, samples, closed, options.fps.has_value());
        out << "}\n";
    };
    writeAtomically(path, write, cancelled);
}

void writeUsda(const fs::path& path, const std::vector<GridBase::ConstPtr>& grids, const std::vector<UsdAsset>& assets,
               const UsdOptions& options, const std::function<bool()>& cancelled) {
    if (grids.empty() || assets.empty())
        throw ValueError(fmt::format("'{}' would refer to no grids; give the .vdb that holds them", path.string()));
    const std::string name = primNameOf(path);
    std::vector<std::string> prims;
    std::set<std::string> names;
    for (const GridBase::ConstPtr& grid : grids) {
        prims.push_back(identifierOf(grid->getName()));
        if (!names.insert(prims.back()).second)
            throw ValueError(fmt::format("two grids are called '{}', so '{}' cannot refer to both; rename one",
                                         grid->getName(), path.string()));
    }
    const auto write = [&](std::ostream& out) {
        out << headerOf(name, options) << fmt::format("def Volume \"{}\"\n{{\n", name);
        for (const std::string& prim : prims) out << fmt::format("    rel field:{} = </{}/{}>\n", prim, name, prim);
        for (size_t k = 0; k < grids.size(); ++k)
            writeAsset(out, *grids[k], prims[k], path, assets, options.fps.has_value());
        out << "}\n";
    };
    writeAtomically(path, write, cancelled);
}

} // namespace curlew
