// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/gpu/Gpu.h"

// The loader is opened when it is first needed, so that Curlew runs without it.
#define VK_NO_PROTOTYPES
#include <vulkan/vulkan_raii.hpp>

#include <functional>
#include <mutex>
#include <vector>

namespace curlew {

class GpuProgram;

/// Memory of the host that a device copies from and to.
struct Staging {
    explicit Staging(const Gpu::Vulkan& gpu);
    vk::raii::Buffer buffer;
    vk::raii::DeviceMemory memory;
    uint32_t* data;
    vk::raii::CommandBuffer command;
    vk::raii::Fence fence;
    bool pending = false; ///< A copy may not be finished.

    static constexpr size_t kWords = size_t{4} << 20;
};

/// The state of an open device. Lock `busy` to use it.
struct Gpu::Vulkan {
    explicit Vulkan(size_t number);

    vk::raii::PhysicalDevice physical;
    GpuInfo info;
    uint32_t family; ///< Of the queue.
    vk::raii::Device device;
    vk::raii::Queue queue;
    vk::raii::CommandPool commands;
    vk::raii::QueryPool clock; ///< Two time stamps.
    double tick = 0;           ///< Seconds of a unit of the clock; 0: it has none.
    vk::PhysicalDeviceLimits limits;
    double busySeconds = 0;
    std::mutex busy;

    /// Returns a program that has been compiled before, or compiles it (see GpuProgram).
    std::shared_ptr<const GpuProgram> program(const std::string& glsl, size_t buffers, size_t constants);

    /// Invocations of a work group.
    static constexpr size_t kGroup = 128;
    /// Returns how many items of so many words one run takes at most.
    size_t mostAtOnce(size_t wordsEach) const;

    /// Two, so that the host fills or empties one while the device copies the other.
    std::vector<Staging> staging;

    /// Records commands and submits them.
    template <class Record>
    void submit(Staging& with, const Record& record) {
        with.command.begin({vk::CommandBufferUsageFlagBits::eOneTimeSubmit});
        record(with.command);
        with.command.end();
        device.resetFences(*with.fence);
        queue.submit(vk::SubmitInfo({}, {}, *with.command, {}), *with.fence);
        with.pending = true;
    }
    /// Waits for the end of what was submitted with it, if anything was.
    void wait(Staging& with) const {
        while (with.pending && device.waitForFences(*with.fence, VK_TRUE, ~uint64_t{0}) == vk::Result::eTimeout) {
        }
        with.pending = false;
    }

  private:
    struct Compiled {
        std::string glsl;
        std::shared_ptr<const GpuProgram> program;
    };
    std::vector<Compiled> mPrograms; ///< The last ones used, the newest last.
    std::mutex mCompiling;
};

/// Calls f() and turns the exceptions of Vulkan into those of Curlew, which begin with the name of the GPU.
template <class F>
auto translatingErrors(const std::string& gpu, const F& f) {
    const auto about = [&](const std::string& what) { return gpu + ": " + what; };
    try {
        return f();
    } catch (const vk::OutOfDeviceMemoryError&) {
        throw ResourceError(about("its memory is full; use fewer points or voxels, or device=cpu"));
    } catch (const vk::OutOfHostMemoryError&) {
        throw ResourceError(about("the memory of this machine is full"));
    } catch (const vk::DeviceLostError&) {
        throw GpuError(
            about("the driver gave it up (device lost), which happens if a program takes too long or "
                  "fails; use device=cpu"));
    } catch (const vk::SystemError& e) {
        throw GpuError(about(std::string("its driver failed: ") + e.what()));
    }
}
template <class F>
auto translatingErrors(const Gpu::Vulkan& gpu, const F& f) {
    return translatingErrors("GPU '" + gpu.info.name + "'", f);
}

/// Words on a device, which must outlive them.
class GpuBuffer {
  public:
    /// Throws ResourceError if the device's memory does not suffice, or its programs cannot reach so many words.
    GpuBuffer(Gpu::Vulkan& gpu, size_t words);

    /// Sets units of some words each, from the first word on: calls fill(begin, end, to) for ranges of units, in
    /// parallel. `to` is where the words of unit `begin` go.
    using Fill = std::function<void(size_t begin, size_t end, uint32_t* to)>;
    void upload(size_t units, size_t wordsEach, const Fill& fill);
    /// Reads units in the same way.
    using Take = std::function<void(size_t begin, size_t end, const uint32_t* from)>;
    void download(size_t units, size_t wordsEach, const Take& take) const;
    vk::DescriptorBufferInfo info() const { return {*mBuffer, 0, VK_WHOLE_SIZE}; }

  private:
    Gpu::Vulkan* mGpu;
    vk::raii::Buffer mBuffer;
    vk::raii::DeviceMemory mMemory;
    uint32_t* mData = nullptr; ///< If the host can reach the memory.
};

/// A compute shader on a device, which must outlive it.
class GpuProgram {
  public:
    /// Compiles GLSL 4.50, without its first line and the size of a group, that uses storage buffers at the bindings
    /// 0 … buffers-1 of set 0 and `constants` bytes of push constants. Throws GpuError with the compiler's messages.
    GpuProgram(Gpu::Vulkan& gpu, const std::string& glsl, size_t buffers, size_t constants);

    /// Runs at least `count` invocations, whole groups along x.
    void run(const std::vector<const GpuBuffer*>& buffers, const void* constants, size_t count) const;

  private:
    Gpu::Vulkan& mGpu;
    size_t mConstants;
    vk::raii::DescriptorSetLayout mSetLayout;
    vk::raii::PipelineLayout mLayout;
    vk::raii::Pipeline mPipeline;
    vk::raii::DescriptorPool mPool;
    vk::raii::DescriptorSet mSet;
};

} // namespace curlew
