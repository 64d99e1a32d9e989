// SPDX-License-Identifier: Apache-2.0
#include "Spirv.h"

#include <glslang/Include/glslang_c_interface.h>
#include <glslang/Public/resource_limits_c.h>

#include <memory>
#include <stdexcept>

namespace curlew {

namespace {

/// glslang, which is ready while this exists.
struct Compiler {
    Compiler() {
        if (!glslang_initialize_process()) throw std::runtime_error("glslang cannot be initialised");
    }
    ~Compiler() { glslang_finalize_process(); }
    Compiler(const Compiler&) = delete;
    Compiler& operator=(const Compiler&) = delete;
};

template <class T>
using Owned = std::unique_ptr<T, void (*)(T*)>;

} // namespace

std::vector<uint32_t> spirvOf(const std::string& glsl) {
    static const Compiler compiler;
    glslang_input_t input{};
    input.language = GLSLANG_SOURCE_GLSL;
    input.stage = GLSLANG_STAGE_COMPUTE;
    input.client = GLSLANG_CLIENT_VULKAN;
    input.client_version = GLSLANG_TARGET_VULKAN_1_1;
    input.target_language = GLSLANG_TARGET_SPV;
    input.target_language_version = GLSLANG_TARGET_SPV_1_3;
    input.code = glsl.c_str();
    input.default_version = 450;
    input.default_profile = GLSLANG_NO_PROFILE;
    input.messages = GLSLANG_MSG_DEFAULT_BIT;
    input.resource = glslang_default_resource();
    const Owned<glslang_shader_t> shader(glslang_shader_create(&input), glslang_shader_delete);
    const Owned<glslang_program_t> program(glslang_program_create(), glslang_program_delete);
    if (!glslang_shader_preprocess(shader.get(), &input) || !glslang_shader_parse(shader.get(), &input))
        throw std::runtime_error(glslang_shader_get_info_log(shader.get()));
    glslang_program_add_shader(program.get(), shader.get());
    if (!glslang_program_link(program.get(), GLSLANG_MSG_SPV_RULES_BIT | GLSLANG_MSG_VULKAN_RULES_BIT))
        throw std::runtime_error(glslang_program_get_info_log(program.get()));
    glslang_program_SPIRV_generate(program.get(), GLSLANG_STAGE_COMPUTE);
    std::vector<uint32_t> words(glslang_program_SPIRV_get_size(program.get()));
    glslang_program_SPIRV_get(program.get(), words.data());
    return words;
}

} // namespace curlew
