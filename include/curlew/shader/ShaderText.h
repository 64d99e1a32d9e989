// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/math/Symbol.h"

#include <string>
#include <string_view>
#include <vector>

namespace curlew {

/// The languages in which recorded functions can be written.
enum class Dialect {
    glsl,   ///< GLSL 4.50: OpenGL and Vulkan.
    glslEs, ///< GLSL ES 3.00 (WebGL 2).
    hlsl,   ///< HLSL, shader model 5 or later: Direct3D, Unreal, Unity, Vulkan.
    wgsl,   ///< WGSL (WebGPU).
};
/// In the order of the enumerators.
inline constexpr std::array<std::string_view, 4> kDialectNames{"glsl", "es", "hlsl", "wgsl"};

/// A recorded function that a shader may call. Its parameters and results are reals, grouped into vectors; more than
/// four results are a structure FlowRealsN with members r0, r1, ….
struct ShaderEntry {
    struct Parameter {
        std::string name;
        size_t size; ///< 1 … 4 components
    };
    size_t function; ///< Of the module.
    std::string name, comment;
    std::vector<Parameter> parameters;
};

/// How a shader computes the coordinates from which the lattice cells of noises are subtracted.
enum class ShaderCoordinates {
    doubles, ///< In double (shaderFloat64 in Vulkan): GLSL 4.50 only.
    pairs,   ///< As pairs of floats with 48 bits. GPUs for games compute with doubles at 1/32 or 1/64 of their speed.
};
/// In the order of the enumerators.
inline constexpr std::array<std::string_view, 2> kShaderCoordinateNames{"doubles", "pairs"};

/// Where a shader finds the tables of noises.
enum class ShaderTables {
    text, ///< As constant arrays in the text. Drivers for GPUs handle them well.
    data, ///< In the last buffers. Drivers that run on the processor take minutes to compile constant arrays.
};
/// In the order of the enumerators.
inline constexpr std::array<std::string_view, 2> kShaderTableNames{"text", "data"};

/// Where a host binds the buffers of a shader. In GLSL and HLSL, macros override these. ES has textures instead.
struct ShaderBindings {
    unsigned group = 0; ///< In Vulkan: the set.
    unsigned first = 0; ///< Binding of the first buffer; the others follow.
};

/// Text, and the data that it reads.
struct ShaderText {
    std::string text;
    std::vector<SymbolBuffer> buffers;
};

/// Returns the text of these functions and of all that they call: one self-contained text in which every global name
/// begins with "flow" or "Flow". Throws ValueError if a function uses an operation that the dialect does not have, or
/// if it would become too long for a compiler, which puts every call in line. `coordinates` is for GLSL 4.50; in the
/// other dialects, coordinates are pairs.
ShaderText shaderText(const SymbolModule& module, const std::vector<ShaderEntry>& entries, Dialect dialect,
                      ShaderTables tables = ShaderTables::text, const ShaderBindings& bindings = {},
                      ShaderCoordinates coordinates = ShaderCoordinates::doubles);

/// Returns the number of operations of a function and of all that it calls, for every call.
size_t operationsOf(const SymbolModule& module, size_t function);

} // namespace curlew
