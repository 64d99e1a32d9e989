// SPDX-License-Identifier: Apache-2.0
#include "VulkanRunner.h"

#include "curlew/base/Sanitizer.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#ifdef CURLEW_VULKAN
#include <sanitizer/lsan_interface.h>
#include <unistd.h>
#include <vulkan/vulkan.h>
#endif

namespace curlew::test {

#ifndef CURLEW_VULKAN

std::string whyNoVulkan() { return "the tests were built without Vulkan (libvulkan-dev)"; }
std::vector<float> runShader(const ShaderRun&) { throw std::runtime_error(whyNoVulkan()); }

#else

namespace {

constexpr const char* kDriver = "/usr/share/vulkan/icd.d/lvp_icd.x86_64.json";

bool hasCommand(const std::string& name) { return std::system(("command -v " + name + " > /dev/null").c_str()) == 0; }

void require(VkResult result, const char* what) {
    if (result != VK_SUCCESS) throw std::runtime_error(std::string(what) + " failed: " + std::to_string(result));
}

std::string contents(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

/// Compiles the text to SPIR-V and validates it.
std::vector<uint32_t> compiled(const std::string& text, bool hlsl) {
    const auto folder = std::filesystem::temp_directory_path() / ("curlew_shader_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder);
    const std::string source = folder / "shader.comp", binary = folder / "shader.spv", log = folder / "log";
    std::ofstream(source) << text;
    const std::string command = std::string("glslangValidator -V ") + (hlsl ? "-D -e main " : "") + source + " -o " +
                                binary + " > " + log + " 2>&1 && spirv-val --target-env vulkan1.1 " + binary + " >> " +
                                log + " 2>&1";
    const bool fine = std::system(command.c_str()) == 0;
    const std::string words = contents(binary), messages = contents(log);
    if (!fine) throw std::runtime_error(messages);
    std::filesystem::remove_all(folder);
    std::vector<uint32_t> code(words.size() / 4);
    std::copy_n(words.data(), code.size() * 4, reinterpret_cast<char*>(code.data()));
    return code;
}

/// The software device, with a compute queue.
class Device {
  public:
    Device() {
        const VkApplicationInfo application{.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO,
                                            .pNext = nullptr,
                                            .pApplicationName = "test",
                                            .applicationVersion = 1,
                                            .pEngineName = nullptr,
                                            .engineVersion = 0,
                                            .apiVersion = VK_API_VERSION_1_1};
        VkInstanceCreateInfo instance{};
        instance.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
        instance.pApplicationInfo = &application;
        require(vkCreateInstance(&instance, nullptr, &mInstance), "vkCreateInstance");
        uint32_t count = 1;
        const VkResult found = vkEnumeratePhysicalDevices(mInstance, &count, &mPhysical);
        if (count == 0 || (found != VK_SUCCESS && found != VK_INCOMPLETE))
            throw std::runtime_error("there is no Vulkan device");
        const float priority = 1;
        VkDeviceQueueCreateInfo queue{};
        queue.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
        queue.queueCount = 1;
        queue.pQueuePriorities = &priority;
        VkPhysicalDeviceFeatures features{};
        features.shaderFloat64 = VK_TRUE;
        VkDeviceCreateInfo device{};
        device.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
        device.queueCreateInfoCount = 1;
        device.pQueueCreateInfos = &queue;
        device.pEnabledFeatures = &features;
        require(vkCreateDevice(mPhysical, &device, nullptr, &mDevice), "vkCreateDevice");
        vkGetDeviceQueue(mDevice, 0, 0, &mQueue);
    }
    ~Device() {
        vkDestroyDevice(mDevice, nullptr);
        vkDestroyInstance(mInstance, nullptr);
    }
    Device(const Device&) = delete;
    Device& operator=(const Device&) = delete;

    operator VkDevice() const { return mDevice; } // NOLINT: that is what it is
    VkQueue queue() const { return mQueue; }

    /// Returns the first type of host memory that is allowed.
    uint32_t memoryType(uint32_t allowed) const {
        VkPhysicalDeviceMemoryProperties properties;
        vkGetPhysicalDeviceMemoryProperties(mPhysical, &properties);
        constexpr VkMemoryPropertyFlags kHost =
            VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
        for (uint32_t k = 0; k < properties.memoryTypeCount; ++k)
            if ((allowed >> k & 1u) && (properties.memoryTypes[k].propertyFlags & kHost) == kHost) return k;
        throw std::runtime_error("there is no host memory");
    }

  private:
    VkInstance mInstance{};
    VkPhysicalDevice mPhysical{};
    VkDevice mDevice{};
    VkQueue mQueue{};
};

/// Words that the device and the host share.
class Buffer {
  public:
    Buffer(const Device& device, size_t words) : mDevice(device), mBytes(std::max<size_t>(words, 1) * 4) {
        VkBufferCreateInfo info{};
        info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
        info.size = mBytes;
        info.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
        require(vkCreateBuffer(device, &info, nullptr, &mBuffer), "vkCreateBuffer");
        VkMemoryRequirements needs;
        vkGetBufferMemoryRequirements(device, mBuffer, &needs);
        VkMemoryAllocateInfo allocate{};
        allocate.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
        allocate.allocationSize = needs.size;
        allocate.memoryTypeIndex = device.memoryType(needs.memoryTypeBits);
        require(vkAllocateMemory(device, &allocate, nullptr, &mMemory), "vkAllocateMemory");
        require(vkBindBufferMemory(device, mBuffer, mMemory, 0), "vkBindBufferMemory");
        void* data = nullptr;
        require(vkMapMemory(device, mMemory, 0, mBytes, 0, &data), "vkMapMemory");
        mData = static_cast<uint32_t*>(data);
    }
    ~Buffer() {
        vkDestroyBuffer(mDevice, mBuffer, nullptr);
        vkFreeMemory(mDevice, mMemory, nullptr);
    }
    Buffer(const Buffer&) = delete;
    Buffer& operator=(const Buffer&) = delete;

    uint32_t* data() const { return mData; }
    VkDescriptorBufferInfo info() const { return {mBuffer, 0, mBytes}; }

  private:
    VkDevice mDevice;
    size_t mBytes;
    VkBuffer mBuffer{};
    VkDeviceMemory mMemory{};
    uint32_t* mData = nullptr;
};

constexpr uint32_t kGroup = 64;

/// Runs compiled code on buffers.
void dispatch(const Device& device, const std::vector<uint32_t>& code, const std::deque<Buffer>& buffers,
              uint32_t groups) {
    VkShaderModuleCreateInfo moduleInfo{};
    moduleInfo.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
    moduleInfo.codeSize = code.size() * 4;
    moduleInfo.pCode = code.data();
    VkShaderModule module{};
    require(vkCreateShaderModule(device, &moduleInfo, nullptr, &module), "vkCreateShaderModule");

    std::vector<VkDescriptorSetLayoutBinding> bindings;
    for (uint32_t k = 0; k < buffers.size(); ++k)
        bindings.push_back({k, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr});
    VkDescriptorSetLayoutCreateInfo setInfo{};
    setInfo.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
    setInfo.bindingCount = static_cast<uint32_t>(bindings.size());
    setInfo.pBindings = bindings.data();
    VkDescriptorSetLayout setLayout{};
    require(vkCreateDescriptorSetLayout(device, &setInfo, nullptr, &setLayout), "vkCreateDescriptorSetLayout");
    VkPipelineLayoutCreateInfo layoutInfo{};
    layoutInfo.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
    layoutInfo.setLayoutCount = 1;
    layoutInfo.pSetLayouts = &setLayout;
    VkPipelineLayout layout{};
    require(vkCreatePipelineLayout(device, &layoutInfo, nullptr, &layout), "vkCreatePipelineLayout");
    VkComputePipelineCreateInfo pipelineInfo{};
    pipelineInfo.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
    pipelineInfo.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    pipelineInfo.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
    pipelineInfo.stage.module = module;
    pipelineInfo.stage.pName = "main";
    pipelineInfo.layout = layout;
    VkPipeline pipeline{};
    require(vkCreateComputePipelines(device, VK_NULL_HANDLE, 1, &pipelineInfo, nullptr, &pipeline),
            "vkCreateComputePipelines");

    const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, static_cast<uint32_t>(buffers.size())};
    VkDescriptorPoolCreateInfo poolInfo{};
    poolInfo.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
    poolInfo.maxSets = 1;
    poolInfo.poolSizeCount = 1;
    poolInfo.pPoolSizes = &size;
    VkDescriptorPool pool{};
    require(vkCreateDescriptorPool(device, &poolInfo, nullptr, &pool), "vkCreateDescriptorPool");
    VkDescriptorSetAllocateInfo allocate{};
    allocate.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO;
    allocate.descriptorPool = pool;
    allocate.descriptorSetCount = 1;
    allocate.pSetLayouts = &setLayout;
    VkDescriptorSet set{};
    require(vkAllocateDescriptorSets(device, &allocate, &set), "vkAllocateDescriptorSets");
    for (uint32_t k = 0; k < buffers.size(); ++k) {
        const VkDescriptorBufferInfo info = buffers[k].info();
        VkWriteDescriptorSet write{};
        write.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
        write.dstSet = set;
        write.dstBinding = k;
        write.descriptorCount = 1;
        write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        write.pBufferInfo = &info;
        vkUpdateDescriptorSets(device, 1, &write, 0, nullptr);
    }

    VkCommandPoolCreateInfo commandsInfo{};
    commandsInfo.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
    VkCommandPool commands{};
    require(vkCreateCommandPool(device, &commandsInfo, nullptr, &commands), "vkCreateCommandPool");
    VkCommandBufferAllocateInfo commandInfo{};
    commandInfo.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
    commandInfo.commandPool = commands;
    commandInfo.commandBufferCount = 1;
    VkCommandBuffer command{};
    require(vkAllocateCommandBuffers(device, &commandInfo, &command), "vkAllocateCommandBuffers");
    VkCommandBufferBeginInfo begin{};
    begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
    require(vkBeginCommandBuffer(command, &begin), "vkBeginCommandBuffer");
    vkCmdBindPipeline(command, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
    vkCmdBindDescriptorSets(command, VK_PIPELINE_BIND_POINT_COMPUTE, layout, 0, 1, &set, 0, nullptr);
    vkCmdDispatch(command, groups, 1, 1);
    require(vkEndCommandBuffer(command), "vkEndCommandBuffer");
    VkSubmitInfo submit{};
    submit.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
    submit.commandBufferCount = 1;
    submit.pCommandBuffers = &command;
    require(vkQueueSubmit(device.queue(), 1, &submit, VK_NULL_HANDLE), "vkQueueSubmit");
    require(vkQueueWaitIdle(device.queue()), "vkQueueWaitIdle");

    vkDestroyCommandPool(device, commands, nullptr);
    vkDestroyDescriptorPool(device, pool, nullptr);
    vkDestroyPipeline(device, pipeline, nullptr);
    vkDestroyPipelineLayout(device, layout, nullptr);
    vkDestroyDescriptorSetLayout(device, setLayout, nullptr);
    vkDestroyShaderModule(device, module, nullptr);
}

/// The shader's last lines: the body, in a function that returns early if there is nothing to do.
std::string bodyOf(const ShaderRun& run) {
    return "    if (i >= " + std::to_string(run.count) + "u) return;\n" + run.body + "}\n";
}

std::string inGlsl(const ShaderRun& run) {
    return "#version 450\n"
           "#define FLOW_SET 0\n"
           "#define FLOW_BINDING 2\n"
           "layout(local_size_x = " +
           std::to_string(kGroup) +
           ") in;\n"
           "layout(std430, binding = 0) readonly buffer Inputs { float inputs[]; };\n"
           "layout(std430, binding = 1) writeonly buffer Outputs { float outputs[]; };\n" +
           run.functions + "void main() {\n    uint i = gl_GlobalInvocationID.x;\n" + bodyOf(run);
}

std::string inHlsl(const ShaderRun& run) {
    return "#define FLOW_SET 0\n"
           "#define FLOW_BINDING 2\n"
           "#define vec2 float2\n"
           "#define vec3 float3\n"
           "#define vec4 float4\n"
           "static uint opaqueZero;\n"
           "#define flowZero opaqueZero\n"
           "[[vk::binding(0)]] StructuredBuffer<float> inputs;\n"
           "[[vk::binding(1)]] RWStructuredBuffer<float> outputs;\n" +
           run.functions + "[numthreads(" + std::to_string(kGroup) +
           ", 1, 1)] void main(uint3 id : SV_DispatchThreadID) {\n"
           "    uint i = id.x;\n"
           "    opaqueZero = uint(inputs[0] > 1e30);\n" +
           bodyOf(run);
}

/// While it exists, memory that is allocated counts as no leak. Drivers are unloaded before the search for leaks, so it
/// cannot tell whose they are.
struct IgnoreLeaks {
    IgnoreLeaks() {
        if constexpr (kAddressSanitizer) __lsan_disable();
    }
    ~IgnoreLeaks() {
        if constexpr (kAddressSanitizer) __lsan_enable();
    }
    IgnoreLeaks(const IgnoreLeaks&) = delete;
    IgnoreLeaks& operator=(const IgnoreLeaks&) = delete;
};

} // namespace

std::string whyNoVulkan() {
    if (!std::filesystem::exists(kDriver)) return "there is no software device for Vulkan (mesa-vulkan-drivers)";
    if (!hasCommand("glslangValidator")) return "there is no glslangValidator (glslang-tools)";
    if (!hasCommand("spirv-val")) return "there is no spirv-val (spirv-tools)";
    return {};
}

std::vector<float> runShader(const ShaderRun& run) {
    setenv("VK_ICD_FILENAMES", kDriver, 1);
    const std::vector<uint32_t> code = compiled(run.hlsl ? inHlsl(run) : inGlsl(run), run.hlsl);
    const IgnoreLeaks ignore;
    const Device device;
    std::deque<Buffer> buffers;
    std::copy_n(reinterpret_cast<const uint32_t*>(run.inputs.data()), run.inputs.size(),
                buffers.emplace_back(device, run.inputs.size()).data());
    buffers.emplace_back(device, run.count * run.outputSize);
    for (const SymbolBuffer& buffer : run.buffers)
        std::copy(buffer.data->begin(), buffer.data->end(), buffers.emplace_back(device, buffer.data->size()).data());
    dispatch(device, code, buffers, (static_cast<uint32_t>(run.count) + kGroup - 1) / kGroup);
    std::vector<float> outputs(run.count * run.outputSize);
    std::copy_n(buffers[1].data(), outputs.size(), reinterpret_cast<uint32_t*>(outputs.data()));
    return outputs;
}

#endif

} // namespace curlew::test
