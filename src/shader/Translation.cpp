// SPDX-License-Identifier: Apache-2.0
#include "Translation.h"

#include <algorithm>
#include <cctype>
#include <utility>

namespace curlew {

namespace {

using Words = std::vector<std::pair<std::string_view, std::string_view>>;

const Words kHlsl{{"vec2", "float2"},           {"vec3", "float3"},     {"vec4", "float4"},
                  {"uvec2", "uint2"},           {"roundEven", "round"}, {"uintBitsToFloat", "asfloat"},
                  {"floatBitsToUint", "asuint"}};

const Words kWgsl{{"float", "f32"},
                  {"int", "i32"},
                  {"uint", "u32"},
                  {"vec2", "vec2f"},
                  {"vec3", "vec3f"},
                  {"vec4", "vec4f"},
                  {"uvec2", "vec2u"},
                  {"roundEven", "round"},
                  {"uintBitsToFloat", "bitcast<f32>"},
                  {"floatBitsToUint", "bitcast<u32>"}};

bool isOfWord(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; }

/// Returns the word that begins there; empty if none does.
std::string_view wordAt(std::string_view text, size_t begin) {
    size_t end = begin;
    while (end < text.size() && isOfWord(text[end])) ++end;
    return text.substr(begin, end - begin);
}

std::string withWords(std::string_view text, const Words& words) {
    std::string result;
    for (size_t at = 0; at < text.size();) {
        const std::string_view word = wordAt(text, at);
        if (word.empty()) {
            result += text[at++];
            continue;
        }
        const auto known = std::find_if(words.begin(), words.end(), [&](const auto& w) { return w.first == word; });
        result += known == words.end() ? word : known->second;
        at += word.size();
    }
    return result;
}

/// `type name` at the beginning of a text.
struct Declared {
    std::string_view type, name;
    size_t end = 0; ///< 0 if the text begins with something else.

    explicit Declared(std::string_view text) : type(wordAt(text, 0)) {
        const bool known = std::any_of(kWgsl.begin(), kWgsl.end(), [&](const auto& w) { return w.first == type; });
        if (!(known || type == "bool" || type.starts_with("FlowReals")) || text.substr(type.size(), 1) != " ") return;
        name = wordAt(text, type.size() + 1);
        if (!name.empty()) end = type.size() + 1 + name.size();
    }
};

/// Returns a line of code in the order of WGSL: the type of a variable after its name.
std::string reordered(std::string_view line) {
    const size_t indent = std::min(line.find_first_not_of(' '), line.size());
    const std::string_view code = line.substr(indent);
    const std::string spaces(line.substr(0, indent));
    const Declared declared(code);
    const auto of = [](const Declared& d) { return std::string(d.name) + ": " + std::string(d.type); };
    if (declared.end && code.substr(declared.end).starts_with(" ="))
        return spaces + "var " + of(declared) + std::string(code.substr(declared.end));
    if (declared.end && code[declared.end] == '(') {
        const size_t close = code.find(')');
        std::string parameters;
        for (size_t at = declared.end + 1; at < close;) {
            const Declared parameter(code.substr(at, close - at));
            parameters += of(parameter);
            at += parameter.end;
            if (code[at] == ',') parameters += ", ";
            at += code[at] == ',' ? 2 : 0;
        }
        return "fn " + std::string(declared.name) + "(" + parameters + ") -> " + std::string(declared.type) +
               std::string(code.substr(close + 1));
    }
    constexpr std::string_view kLoop = "for (int ", kNext = "; ++";
    if (!code.starts_with(kLoop)) return std::string(line);
    const std::string_view counter = wordAt(code, kLoop.size());
    const size_t next = code.find(kNext);
    return spaces + "for (var " + std::string(counter) + ": int" +
           std::string(code.substr(kLoop.size() + counter.size(), next - kLoop.size() - counter.size())) + "; " +
           std::string(counter) + "++" + std::string(code.substr(next + kNext.size() + counter.size()));
}

} // namespace

std::string translated(const std::string& glsl, Dialect dialect) {
    if (dialect != Dialect::hlsl && dialect != Dialect::wgsl) return glsl;
    if (dialect == Dialect::hlsl) return withWords(glsl, kHlsl);
    std::string result;
    for (size_t begin = 0; begin < glsl.size();) {
        const size_t end = std::min(glsl.find('\n', begin), glsl.size());
        result += withWords(reordered(std::string_view(glsl).substr(begin, end - begin)), kWgsl);
        if (end < glsl.size()) result += '\n';
        begin = end + 1;
    }
    return result;
}

} // namespace curlew
