// SPDX-License-Identifier: Apache-2.0
#include "ShaderFiles.h"

#include "curlew/base/AtomicFile.h"
#include "curlew/shader/FlowShader.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <ostream>

namespace curlew::app {

using namespace options;

std::vector<Option> shaderOptions() {
    return {choice("dialect", kDialectNames,
                   "language of a .glsl: glsl is GLSL 4.50 for OpenGL and Vulkan, es is GLSL ES 3.00 for WebGL 2"),
            choice("tables", kShaderTableNames,
                   "where a .glsl has the tables of noises: text: in itself; data: in FILE.bin, for drivers that run "
                   "shaders on the processor"),
            integer("corrections", "2", 1, 10, "corrections back onto the track after each step of a .glsl"),
            vector("origin", "", "world units",
                   "position from which a .glsl measures its own (default: the centre of the flow's box)")};
}

void checkShaderOptions(const Arguments& a, const std::vector<std::string>& endings) {
    for (const Option& option : shaderOptions())
        if (a.given(option.name) && std::find(endings.begin(), endings.end(), kShaderEnding) == endings.end())
            throw ValueError(fmt::format("{}= is only for {}", option.name, kShaderEnding));
}

void writeShaderFile(const Context& c, const Arguments& a, const std::string& file) {
    const std::string data = file + ".bin";
    FlowShaderOptions options{.dialect = a.choice<Dialect>("dialect"),
                              .tables = a.choice<ShaderTables>("tables"),
                              .corrections = a.integer<int>("corrections"),
                              .dataFile = std::filesystem::path(data).filename().string()};
    if (a.given("origin")) options.origin = a.vector("origin");
    const ShaderText shader =
        std::visit([&](const auto& flow) { return flowShader(flow, options, c.follow("write")); }, c.anyFlow("what"));
    // Otherwise the file is a temporary one, whose contents go elsewhere.
    const bool named = std::find(a.words().begin(), a.words().end(), file) != a.words().end();
    if (!shader.buffers.empty() && !named)
        throw ValueError(fmt::format(
            "this shader has a data file beside it, NAME{0}.bin, so its name must end with {0}", kShaderEnding));
    if (!shader.buffers.empty())
        writeAtomically(data, [&](std::ostream& out) {
            for (const SymbolBuffer& buffer : shader.buffers)
                out.write(reinterpret_cast<const char*>(buffer.data->data()), // NOLINT: the words' bytes
                          static_cast<std::streamsize>(buffer.data->size() * sizeof(uint32_t)));
        });
    writeAtomically(file, [&](std::ostream& out) { out << shader.text; });
}

} // namespace curlew::app
