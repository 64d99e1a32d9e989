// SPDX-License-Identifier: Apache-2.0
#include "Spirv.h"
#include "Vulkan.h"
#include "curlew/base/Memory.h"
#include "curlew/base/Parallel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <unordered_map>

VULKAN_HPP_DEFAULT_DISPATCH_LOADER_DYNAMIC_STORAGE

namespace curlew {

namespace {

vk::raii::Context openLoader() {
    try {
        return {};
    } catch (const std::exception&) {
        throw GpuError("there is no Vulkan on this machine: install its loader (Debian: libvulkan1) and a driver");
    }
}

vk::raii::Instance openInstance(const vk::raii::Context& context) {
    const vk::ApplicationInfo application("curlew", 1, nullptr, 0, VK_API_VERSION_1_1);
    try {
        return {context, vk::InstanceCreateInfo({}, &application)};
    } catch (const vk::SystemError&) {
        throw GpuError("Vulkan has no driver on this machine: install that of your GPU");
    }
}

/// Returns Vulkan and its drivers, loaded once. They are never unloaded: at the end of the program, drivers end before
/// static objects do.
const vk::raii::Instance& loaded() {
    static const auto& context = *new vk::raii::Context(openLoader());            // NOLINT
    static const auto& instance = *new vk::raii::Instance(openInstance(context)); // NOLINT
    return instance;
}

std::vector<vk::raii::PhysicalDevice> devicesOf(const vk::raii::Instance& instance) {
    std::vector<vk::raii::PhysicalDevice> all;
    try {
        for (auto& device : vk::raii::PhysicalDevices(instance))
            if (device.getProperties().apiVersion >= VK_API_VERSION_1_1) all.push_back(std::move(device));
    } catch (const vk::SystemError&) {
        // Some drivers say so if there is no device.
    }
    if (all.empty()) throw GpuError("there is no device with a driver for Vulkan 1.1 on this machine");
    return all;
}

GpuInfo infoOf(const vk::raii::PhysicalDevice& device) {
    const auto properties = device.getProperties();
    GpuInfo info{.name = std::string(properties.deviceName.data()),
                 .software = properties.deviceType == vk::PhysicalDeviceType::eCpu,
                 .doubles = device.getFeatures().shaderFloat64 == VK_TRUE};
    const auto memory = device.getMemoryProperties();
    for (uint32_t k = 0; k < memory.memoryHeapCount; ++k)
        if (memory.memoryHeaps[k].flags & vk::MemoryHeapFlagBits::eDeviceLocal)
            info.memory = std::max<size_t>(info.memory, memory.memoryHeaps[k].size);
    return info;
}

vk::raii::PhysicalDevice deviceAt(const vk::raii::Instance& instance, size_t number) {
    auto all = devicesOf(instance);
    if (number >= all.size())
        throw GpuError(fmt::format("there is no GPU number {}; this machine has {}, from 0 on", number, all.size()));
    return std::move(all[number]);
}

uint32_t computeFamily(const vk::raii::PhysicalDevice& device) {
    const auto families = device.getQueueFamilyProperties();
    for (uint32_t k = 0; k < families.size(); ++k)
        if (families[k].queueFlags & vk::QueueFlagBits::eCompute) return k;
    throw GpuError("this GPU has no queue for computations");
}

vk::raii::Device openDevice(const vk::raii::PhysicalDevice& physical, uint32_t family) {
    const float priority = 1;
    const vk::DeviceQueueCreateInfo queue({}, family, 1, &priority);
    vk::PhysicalDeviceFeatures features;
    features.shaderFloat64 = physical.getFeatures().shaderFloat64;
    return {physical, vk::DeviceCreateInfo({}, queue, {}, {}, &features)};
}

/// Returns the first type of memory that is allowed and has these properties, if any.
std::optional<uint32_t> memoryType(const Gpu::Vulkan& vulkan, uint32_t allowed, vk::MemoryPropertyFlags wanted) {
    const auto properties = vulkan.physical.getMemoryProperties();
    for (uint32_t k = 0; k < properties.memoryTypeCount; ++k)
        if ((allowed >> k & 1u) && (properties.memoryTypes[k].propertyFlags & wanted) == wanted) return k;
    return std::nullopt;
}

constexpr auto kOnDevice = vk::MemoryPropertyFlagBits::eDeviceLocal;
constexpr auto kOnHost = vk::MemoryPropertyFlagBits::eHostVisible | vk::MemoryPropertyFlagBits::eHostCoherent;

vk::raii::Buffer makeBuffer(const Gpu::Vulkan& vulkan, size_t bytes, vk::BufferUsageFlags usage) {
    return {vulkan.device, vk::BufferCreateInfo({}, bytes, usage)};
}

vk::raii::DeviceMemory allocate(const Gpu::Vulkan& vulkan, const vk::raii::Buffer& buffer,
                                std::initializer_list<vk::MemoryPropertyFlags> preferred) {
    const auto needs = buffer.getMemoryRequirements();
    for (const auto wanted : preferred)
        if (const auto type = memoryType(vulkan, needs.memoryTypeBits, wanted)) {
            vk::raii::DeviceMemory memory(vulkan.device, vk::MemoryAllocateInfo(needs.size, *type));
            buffer.bindMemory(*memory, 0);
            return memory;
        }
    throw GpuError("this GPU has no memory that the host can reach");
}

vk::raii::CommandBuffer makeCommands(const Gpu::Vulkan& vulkan) {
    const vk::CommandBufferAllocateInfo allocate(*vulkan.commands, vk::CommandBufferLevel::ePrimary, 1);
    return std::move(vk::raii::CommandBuffers(vulkan.device, allocate).front());
}

/// Calls use(begin, end) for parts of the units, in parallel.
template <class Use>
void inParallel(size_t units, size_t wordsEach, const Use& use) {
    constexpr size_t kWordsAtOnce = 1 << 16;
    parallelFor(units, std::max<size_t>(kWordsAtOnce / wordsEach, 1), use);
}

} // namespace

std::vector<GpuInfo> gpus() {
    std::vector<GpuInfo> all;
    for (const auto& device : devicesOf(loaded())) all.push_back(infoOf(device));
    return all;
}

size_t preferredGpu(const std::vector<GpuInfo>& all) {
    const auto first = std::find_if(all.begin(), all.end(), [](const GpuInfo& gpu) { return !gpu.software; });
    return first == all.end() ? 0 : static_cast<size_t>(first - all.begin());
}

Gpu::Vulkan::Vulkan(size_t number)
    : physical(deviceAt(loaded(), number)),
      info(infoOf(physical)),
      family(computeFamily(physical)),
      device(openDevice(physical, family)),
      queue(device, family, 0),
      commands(device, vk::CommandPoolCreateInfo(vk::CommandPoolCreateFlagBits::eResetCommandBuffer, family)),
      clock(device, vk::QueryPoolCreateInfo({}, vk::QueryType::eTimestamp, 2)),
      limits(physical.getProperties().limits) {
    if (physical.getQueueFamilyProperties()[family].timestampValidBits > 0)
        tick = 1e-9 * static_cast<double>(limits.timestampPeriod);
    for (int k = 0; k < 2; ++k) staging.emplace_back(*this);
}

Staging::Staging(const Gpu::Vulkan& gpu)
    : buffer(makeBuffer(gpu, sizeof(uint32_t) * kWords,
                        vk::BufferUsageFlagBits::eTransferSrc | vk::BufferUsageFlagBits::eTransferDst)),
      memory(allocate(gpu, buffer, {kOnHost | vk::MemoryPropertyFlagBits::eHostCached, kOnHost})),
      data(static_cast<uint32_t*>(memory.mapMemory(0, VK_WHOLE_SIZE))),
      command(makeCommands(gpu)),
      fence(gpu.device.createFence({})) {}

size_t Gpu::Vulkan::mostAtOnce(size_t wordsEach) const {
    return std::min({size_t{1} << 22, kGroup * size_t{limits.maxComputeWorkGroupCount[0]},
                     size_t{limits.maxStorageBufferRange} / (sizeof(uint32_t) * wordsEach)});
}

std::shared_ptr<const GpuProgram> Gpu::Vulkan::program(const std::string& glsl, size_t buffers, size_t constants) {
    constexpr size_t kKept = 16;
    const std::lock_guard lock(mCompiling);
    const auto found =
        std::find_if(mPrograms.begin(), mPrograms.end(), [&](const Compiled& one) { return one.glsl == glsl; });
    Compiled newest = found != mPrograms.end()
                          ? *found
                          : Compiled{glsl, std::make_shared<const GpuProgram>(*this, glsl, buffers, constants)};
    if (found != mPrograms.end())
        mPrograms.erase(found);
    else if (mPrograms.size() == kKept)
        mPrograms.erase(mPrograms.begin());
    mPrograms.push_back(newest);
    return newest.program;
}

Gpu::Gpu(size_t number) : mVulkan(std::make_unique<Vulkan>(number)) {}
Gpu::~Gpu() = default;

std::shared_ptr<Gpu> Gpu::open(size_t number) {
    static std::mutex mutex;
    // Never destroyed, like what they use (see loaded()).
    static auto& all = *new std::unordered_map<size_t, std::shared_ptr<Gpu>>; // NOLINT(cppcoreguidelines-owning-memory)
    const std::lock_guard lock(mutex);
    auto& gpu = all[number];
    if (gpu) return gpu;
    // With less, drivers crash: Mesa's on the processor while it compiles programs.
    constexpr double kDriver = 600e6;
    requireMemory(kDriver, "the driver of a GPU", "end other programs, or use device=cpu");
    translatingErrors(fmt::format("GPU number {} cannot be opened", number), [&] { gpu.reset(new Gpu(number)); });
    return gpu;
}

const GpuInfo& Gpu::info() const { return mVulkan->info; }
double Gpu::busy() const { return mVulkan->busySeconds; }

GpuBuffer::GpuBuffer(Gpu::Vulkan& gpu, size_t words) : mGpu(&gpu), mBuffer(nullptr), mMemory(nullptr) {
    const size_t bytes = sizeof(uint32_t) * std::max<size_t>(words, 1);
    if (bytes > gpu.limits.maxStorageBufferRange)
        throw ResourceError(fmt::format(
            "GPU '{}': its programs reach {} at once, not {}; use fewer voxels or pixels, or "
            "device=cpu",
            gpu.info.name, formatBytes(gpu.limits.maxStorageBufferRange), formatBytes(static_cast<double>(bytes))));
    translatingErrors(*mGpu, [&] {
        const Gpu::Vulkan& vulkan = *mGpu;
        mBuffer = makeBuffer(vulkan, bytes,
                             vk::BufferUsageFlagBits::eStorageBuffer | vk::BufferUsageFlagBits::eTransferSrc |
                                 vk::BufferUsageFlagBits::eTransferDst);
        // A driver in software has one memory for all.
        if (vulkan.info.software) {
            mMemory = allocate(vulkan, mBuffer, {kOnDevice | kOnHost});
            mData = static_cast<uint32_t*>(mMemory.mapMemory(0, VK_WHOLE_SIZE));
        } else {
            mMemory = allocate(vulkan, mBuffer, {kOnDevice, kOnHost});
        }
    });
}

void GpuBuffer::upload(size_t units, size_t wordsEach, const Fill& fill) {
    if (mData) {
        inParallel(units, wordsEach, [&](size_t begin, size_t end) { fill(begin, end, mData + begin * wordsEach); });
        return;
    }
    translatingErrors(*mGpu, [&] {
        const std::lock_guard lock(mGpu->busy);
        const size_t most = Staging::kWords / wordsEach;
        size_t turn = 0;
        for (size_t done = 0; done < units; done += most) {
            Staging& staging = mGpu->staging[turn++ % 2];
            mGpu->wait(staging);
            const size_t count = std::min(most, units - done);
            inParallel(count, wordsEach, [&](size_t begin, size_t end) {
                fill(done + begin, done + end, staging.data + begin * wordsEach);
            });
            mGpu->submit(staging, [&](const vk::raii::CommandBuffer& command) {
                command.copyBuffer(*staging.buffer, *mBuffer,
                                   vk::BufferCopy(0, 4 * done * wordsEach, 4 * count * wordsEach));
            });
        }
        for (Staging& staging : mGpu->staging) mGpu->wait(staging);
    });
}

void GpuBuffer::download(size_t units, size_t wordsEach, const Take& take) const {
    if (mData) {
        inParallel(units, wordsEach, [&](size_t begin, size_t end) { take(begin, end, mData + begin * wordsEach); });
        return;
    }
    translatingErrors(*mGpu, [&] {
        const std::lock_guard lock(mGpu->busy);
        const size_t most = Staging::kWords / wordsEach;
        const auto copy = [&](size_t done) {
            Staging& staging = mGpu->staging[done / most % 2];
            mGpu->submit(staging, [&](const vk::raii::CommandBuffer& command) {
                command.copyBuffer(
                    *mBuffer, *staging.buffer,
                    vk::BufferCopy(4 * done * wordsEach, 0, 4 * std::min(most, units - done) * wordsEach));
                const vk::MemoryBarrier toHost(vk::AccessFlagBits::eTransferWrite, vk::AccessFlagBits::eHostRead);
                command.pipelineBarrier(vk::PipelineStageFlagBits::eTransfer, vk::PipelineStageFlagBits::eHost, {},
                                        toHost, {}, {});
            });
        };
        if (units > 0) copy(0);
        for (size_t done = 0; done < units; done += most) {
            if (done + most < units) copy(done + most);
            Staging& staging = mGpu->staging[done / most % 2];
            mGpu->wait(staging);
            inParallel(std::min(most, units - done), wordsEach, [&](size_t begin, size_t end) {
                take(done + begin, done + end, staging.data + begin * wordsEach);
            });
        }
    });
}

GpuProgram::GpuProgram(Gpu::Vulkan& gpu, const std::string& glsl, size_t buffers, size_t constants)
    : mGpu(gpu),
      mConstants(constants),
      mSetLayout(nullptr),
      mLayout(nullptr),
      mPipeline(nullptr),
      mPool(nullptr),
      mSet(nullptr) {
    std::vector<uint32_t> code;
    try {
        code = spirvOf(fmt::format(
            "#version 450\n#extension GL_EXT_control_flow_attributes : require\nlayout(local_size_x = {}) in;\n{}",
            Gpu::Vulkan::kGroup, glsl));
    } catch (const std::runtime_error& e) {
        throw GpuError(fmt::format("a program for the GPU does not compile: {}", e.what()));
    }
    translatingErrors(mGpu, [&] {
        const vk::raii::Device& device = mGpu.device;
        constexpr auto kStage = vk::ShaderStageFlagBits::eCompute;
        constexpr auto kType = vk::DescriptorType::eStorageBuffer;
        std::vector<vk::DescriptorSetLayoutBinding> bindings;
        for (uint32_t k = 0; k < buffers; ++k) bindings.emplace_back(k, kType, 1, kStage);
        mSetLayout = device.createDescriptorSetLayout(vk::DescriptorSetLayoutCreateInfo({}, bindings));
        std::vector<vk::PushConstantRange> ranges;
        if (constants > 0) ranges.emplace_back(kStage, 0, static_cast<uint32_t>(constants));
        mLayout = device.createPipelineLayout(vk::PipelineLayoutCreateInfo({}, *mSetLayout, ranges));
        const vk::raii::ShaderModule module(device, vk::ShaderModuleCreateInfo({}, code));
        const vk::PipelineShaderStageCreateInfo stage({}, kStage, *module, "main");
        mPipeline = device.createComputePipeline(nullptr, vk::ComputePipelineCreateInfo({}, stage, *mLayout));
        const vk::DescriptorPoolSize size(kType, static_cast<uint32_t>(buffers));
        mPool = device.createDescriptorPool(
            vk::DescriptorPoolCreateInfo(vk::DescriptorPoolCreateFlagBits::eFreeDescriptorSet, 1, size));
        mSet = std::move(vk::raii::DescriptorSets(device, vk::DescriptorSetAllocateInfo(*mPool, *mSetLayout)).front());
    });
}

void GpuProgram::run(const std::vector<const GpuBuffer*>& buffers, const void* constants, size_t count) const {
    translatingErrors(mGpu, [&] {
        Gpu::Vulkan& vulkan = mGpu;
        const std::lock_guard lock(vulkan.busy);
        std::vector<vk::DescriptorBufferInfo> infos;
        infos.reserve(buffers.size());
        for (const GpuBuffer* buffer : buffers) infos.push_back(buffer->info());
        vulkan.device.updateDescriptorSets(
            vk::WriteDescriptorSet(*mSet, 0, 0, vk::DescriptorType::eStorageBuffer, {}, infos), {});
        vulkan.submit(vulkan.staging[0], [&](const vk::raii::CommandBuffer& command) {
            command.bindPipeline(vk::PipelineBindPoint::eCompute, *mPipeline);
            command.bindDescriptorSets(vk::PipelineBindPoint::eCompute, *mLayout, 0, *mSet, {});
            if (mConstants > 0)
                command.pushConstants<char>(
                    *mLayout, vk::ShaderStageFlagBits::eCompute, 0,
                    vk::ArrayProxy<const char>(static_cast<uint32_t>(mConstants), static_cast<const char*>(constants)));
            if (vulkan.tick > 0) {
                command.resetQueryPool(*vulkan.clock, 0, 2);
                command.writeTimestamp(vk::PipelineStageFlagBits::eTopOfPipe, *vulkan.clock, 0);
            }
            command.dispatch(static_cast<uint32_t>((count + Gpu::Vulkan::kGroup - 1) / Gpu::Vulkan::kGroup), 1, 1);
            if (vulkan.tick > 0) command.writeTimestamp(vk::PipelineStageFlagBits::eBottomOfPipe, *vulkan.clock, 1);
            const vk::MemoryBarrier written(vk::AccessFlagBits::eShaderWrite,
                                            vk::AccessFlagBits::eTransferRead | vk::AccessFlagBits::eHostRead |
                                                vk::AccessFlagBits::eShaderRead | vk::AccessFlagBits::eShaderWrite);
            command.pipelineBarrier(vk::PipelineStageFlagBits::eComputeShader,
                                    vk::PipelineStageFlagBits::eTransfer | vk::PipelineStageFlagBits::eHost |
                                        vk::PipelineStageFlagBits::eComputeShader,
                                    {}, written, {}, {});
        });
        vulkan.wait(vulkan.staging[0]);
        if (vulkan.tick == 0) return;
        const auto times = vulkan.clock
                               .getResults<uint64_t>(0, 2, 2 * sizeof(uint64_t), sizeof(uint64_t),
                                                     vk::QueryResultFlagBits::e64 | vk::QueryResultFlagBits::eWait)
                               .second;
        vulkan.busySeconds += vulkan.tick * static_cast<double>(times[1] - times[0]);
    });
}

} // namespace curlew
