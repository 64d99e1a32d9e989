// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/app/registry/Options.h"
#include "curlew/app/run/Context.h"

namespace curlew::app {

/// The extensions of files of shaders: GLSL, HLSL, WGSL.
inline constexpr std::array<std::string_view, 3> kShaderEndings{".glsl", ".hlsl", ".wgsl"};
/// The extension of pages for a browser.
inline constexpr std::string_view kPageEnding = ".html";

/// The options of -write for shaders.
std::vector<Option> shaderOptions();

/// Throws ValueError if these options are given without such a file. `endings`: the formats of the files.
void checkShaderOptions(const Arguments& a, const std::vector<std::string>& endings);

/// Writes the newest flow as functions of a shader, and the data of its level sets to FILE.bin.
void writeShaderFile(const Context& c, const Arguments& a, const std::string& file);

/// Writes a page that shows the newest flow in a browser.
void writePageFile(const Context& c, const Arguments& a, const std::string& file);

} // namespace curlew::app
