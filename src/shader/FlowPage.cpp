// SPDX-License-Identifier: Apache-2.0
#include "curlew/shader/FlowPage.h"

#include "PackedWords.h"
#include "PageText.h"
#include "Syntax.h"
#include "Translation.h"
#include "curlew/base/Require.h"
#include "curlew/field/Dimensions.h"
#include "curlew/shader/FlowShader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace curlew {

namespace {

constexpr size_t kMostCoefficients = size_t{1} << 23; // 4096 rows of a texture, which every device has
constexpr size_t kRounded = size_t{1} << 16;          // longer arrays are rounded
constexpr float kLevels = 65535;                      // of rounded numbers

std::string escaped(const std::string& text) {
    std::string safe;
    for (const char c : text) safe += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : std::string(1, c);
    return safe;
}

/// Returns the head of the page with the title and the command in their places.
std::string headOf(const FlowPageOptions& options) {
    const std::string title = escaped(options.title), command = escaped(options.command);
    const std::string_view head = kPageHead;
    std::string text;
    for (size_t at = 0; at < head.size();) {
        const auto replaced = [&](std::string_view name, const std::string& by) {
            if (!head.substr(at).starts_with(name)) return false;
            text += by;
            at += name.size();
            return true;
        };
        if (!replaced("$TITLE", title) && !replaced("$COMMAND", command)) text += head[at++];
    }
    return text;
}

/// An element that holds data, which no browser runs.
std::string element(const std::string& id, const std::string& content) {
    return fmt::format("<script type=\"text/plain\" id=\"{}\">{}</script>\n", id, content);
}

/// Members of the object `look`, and elements with data.
struct Parts {
    std::string members, elements;

    template <class T>
    void add(std::string_view name, const T& value) {
        members += fmt::format("{}: {}, ", name, value);
    }
    template <class T, int N>
    void add(std::string_view name, const Vec<T, N>& v) {
        members += fmt::format("{}: [{:.9g}], ", name, fmt::join(v.c, ", "));
    }

    /// Returns the entry of a buffer in the list of them.
    std::string buffer(const SymbolBuffer& buffer) {
        std::vector<uint32_t> words = *buffer.data;
        float lower = 0, step = 0;
        if (buffer.type == SymbolType::real && words.size() > kRounded) {
            const auto real = [](uint32_t word) { return std::bit_cast<float>(word); };
            const auto [least, most] = std::minmax_element(words.begin(), words.end(),
                                                           [&](uint32_t a, uint32_t b) { return real(a) < real(b); });
            lower = real(*least);
            step = (real(*most) - lower) / kLevels;
            for (uint32_t& word : words)
                word = step > 0 ? static_cast<uint32_t>(std::lround((real(word) - lower) / step)) : 0;
        }
        elements += element(buffer.name, packedWords(words));
        return fmt::format(R"({{name: "{}", type: "{}", count: {}, lower: {}, step: {}}})", buffer.name,
                           elementOf(buffer), words.size(), lower, step);
    }

    /// The wall's surface, rounded to 65,536 positions along the longest edge of the box and its margin.
    void surface(const FlowPageOptions& options, const Vec3d& lower, double edge) {
        const double margin = 0.1 * edge, unit = (edge + 2 * margin) / static_cast<double>(kLevels);
        std::vector<uint32_t> grid;
        for (int axis = 0; axis < 3; ++axis)
            for (const auto& p : options.points) {
                const double x = (static_cast<double>(p[axis]) - lower[axis] + margin) / unit;
                grid.push_back(static_cast<uint32_t>(std::lround(std::clamp(x, 0.0, static_cast<double>(kLevels)))));
            }
        elements += element("points", packedWords(grid)) + element("corners", packedWords(options.corners));
        add("margin", margin);
        add("unit", unit);
    }
};

void requireRoom(const std::vector<SymbolBuffer>& buffers) {
    for (const SymbolBuffer& buffer : buffers)
        if (buffer.data->size() > kMostCoefficients)
            throw ValueError(
                fmt::format("the level set has {} coefficients, more than the {} that a page can hold; "
                            "use larger voxels",
                            buffer.data->size(), kMostCoefficients));
}

template <int N>
std::string sideOf(const FlowN<N>& flow) {
    if (!flow.domain().wall) return "";
    const Side side = flow.domain().wall->side;
    return side == Side::inside ? "inside" : side == Side::outside ? "outside" : "both";
}

} // namespace

template <int N>
std::string flowPage(const FlowN<N>& flow, const FlowPageOptions& options, const Monitor& monitor) {
    const auto textIn = [&](Dialect dialect) {
        return flowShader(flow, {.dialect = dialect, .tables = ShaderTables::data, .parts = true}, monitor);
    };
    const ShaderText shader = textIn(Dialect::glslEs);
    requireRoom(shader.buffers);
    const FlowRmsN<N> rms = rmsOf(flow, monitor);
    if (!(rms.speed > 0)) throw ValueError("the flow does not move");
    Vec3d lower, upper, origin, middle;
    double longest = 0;
    for (int axis = 0; axis < std::min(N, 3); ++axis) {
        origin[axis] = static_cast<double>(static_cast<float>(flow.domain().box.center()[axis]));
        lower[axis] = flow.domain().box.lower[axis] - origin[axis];
        upper[axis] = flow.domain().box.upper[axis] - origin[axis];
        middle[axis] = 0.5 * (lower[axis] + upper[axis]);
        longest = std::max(longest, upper[axis] - lower[axis]);
    }
    const double diagonal = length(upper - lower);
    Parts parts;
    parts.add("dimension", N);
    parts.add("tracks", flow.hasTracks());
    parts.add("side", fmt::format("\"{}\"", sideOf(flow)));
    parts.add("origin", origin);
    parts.add("lower", lower);
    parts.add("upper", upper);
    parts.add("middle", middle);
    parts.add("size", diagonal);
    parts.add("span", N == 2 ? 1.2 * longest : 0.9 * diagonal);
    parts.add("rms", rms.speed);
    parts.add("potentials", Vec<double, 2>{{rms.potentials[0], N == 3 ? rms.potentials[size_t{N - 2}] : 1.0}});
    parts.add("duration", 2 * diagonal / rms.speed); // particles travel about two diagonals
    parts.add("points", options.points.size());
    parts.add("triangles", options.corners.size() / 3);
    if (!options.corners.empty()) parts.surface(options, lower + origin, longest);
    std::vector<std::string> buffers;
    for (const SymbolBuffer& buffer : shader.buffers) buffers.push_back(parts.buffer(buffer));

    std::string page = headOf(options);
    const std::string shared(kPageShared);
    page += element("functions", shader.text) + element("functions-wgsl", textIn(Dialect::wgsl).text);
    page += element("shared", shared) + element("shared-wgsl", translated(shared, Dialect::wgsl)) + parts.elements;
    page +=
        fmt::format("<script>const look = {{{}buffers: [{}]}};</script>\n", parts.members, fmt::join(buffers, ", "));
    return page.append(kPagePrograms).append(kPageParticles).append(kPageWebGl).append(kPageWebGpu).append(kPageView);
}

#define CURLEW_INSTANTIATE(N) template std::string flowPage(const FlowN<N>&, const FlowPageOptions&, const Monitor&);
CURLEW_FOR_FLOW_DIMENSIONS(CURLEW_INSTANTIATE)
#undef CURLEW_INSTANTIATE

} // namespace curlew
