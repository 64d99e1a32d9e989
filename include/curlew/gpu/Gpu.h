// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Error.h"

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace curlew {

/// A GPU cannot be used: there is none, it lacks a feature, or it was lost. The message says which.
class GpuError : public ResourceError {
  public:
    using ResourceError::ResourceError;
};

/// A device with a driver for Vulkan 1.1.
struct GpuInfo {
    std::string name;      ///< As its driver calls it.
    bool software = false; ///< The driver computes on the processor.
    bool doubles = false;  ///< It computes with doubles (shaderFloat64).
    size_t memory = 0;     ///< Bytes of the largest heap of its own memory.
};

/// Returns the devices, in the order of their drivers. Throws GpuError if Vulkan or a driver is not installed.
std::vector<GpuInfo> gpus();

/// Returns the number of the first device that is not software, or of the first one if all are.
size_t preferredGpu(const std::vector<GpuInfo>& all);

/// An open device. Programs run on it one at a time, also if several threads use it.
class Gpu {
  public:
    /// Opens a device, or returns it if it is open. Throws GpuError if there is no such device, or as gpus() does.
    static std::shared_ptr<Gpu> open(size_t number);

    ~Gpu();
    Gpu(const Gpu&) = delete;
    Gpu& operator=(const Gpu&) = delete;

    const GpuInfo& info() const;
    /// Returns the time in seconds for which programs have run on the device so far, without transfers.
    double busy() const;

    struct Vulkan; // src/gpu/Vulkan.h
    Vulkan& vulkan() const { return *mVulkan; }

  private:
    explicit Gpu(size_t number);
    std::unique_ptr<Vulkan> mVulkan;
};

} // namespace curlew
