// SPDX-License-Identifier: Apache-2.0
#include "GpuOption.h"

#include "curlew/app/registry/Options.h"
#include "curlew/app/registry/Text.h"
#include "curlew/base/Memory.h"
#include "curlew/field/ForEachBatch.h"

#ifdef CURLEW_GPU
#include "curlew/gpu/GpuAdvect.h"
#include "curlew/gpu/GpuPictures.h"
#endif

#include <fmt/format.h>

namespace curlew::app {

using namespace options;

namespace {

enum class Device { processor, gpu, either };

Device deviceOf(const Arguments& a) { return a.choice<Device>("device"); }

[[maybe_unused]] constexpr const char* kWithoutGpus = "this program was built without GPUs (Vulkan and glslang)";

void sayProcessor(const Context& c, const Arguments& a, const std::string& why) {
    c.info(fmt::format("{}: on the processor: {}", a.action().name, why));
}

#ifdef CURLEW_GPU

std::string descriptionOf(const GpuInfo& gpu) {
    return fmt::format("{}{}, {}{}", gpu.name, gpu.software ? " (computes on the processor)" : "",
                       formatBytes(static_cast<double>(gpu.memory)), gpu.doubles ? "" : ", without doubles");
}

/// Opens the GPU that -device has chosen, or the preferred one.
std::shared_ptr<Gpu> openGpu(const Context& c) {
    const auto chosen = c.session().gpu;
    return Gpu::open(chosen ? *chosen : preferredGpu(gpus()));
}

/// Returns the GPU on which the action is to run, or nothing for the processor. `whyNot`: why it cannot; empty if it
/// can.
std::shared_ptr<Gpu> gpuFor(const Context& c, const Arguments& a, const std::string& whyNot) {
    const Device device = deviceOf(a);
    if (device == Device::processor) return nullptr;
    if (!whyNot.empty()) {
        if (device == Device::gpu) throw ValueError(whyNot + "; use device=cpu, or device=auto");
        sayProcessor(c, a, whyNot);
        return nullptr;
    }
    std::shared_ptr<Gpu> gpu;
    try {
        gpu = openGpu(c);
    } catch (const Interrupted&) {
        throw;
    } catch (const Error& e) { // no driver, or full memory
        if (device == Device::gpu) throw;
        sayProcessor(c, a, e.what());
        return nullptr;
    }
    if (gpu->info().software && device == Device::either && !c.session().gpu) {
        sayProcessor(c, a, fmt::format("'{}' is no GPU", gpu->info().name));
        return nullptr;
    }
    c.info(fmt::format("{}: on GPU '{}'", a.action().name, gpu->info().name));
    return gpu;
}

/// Calls onGpu(). If it fails and the processor may do it, warns and returns onProcessor().
template <class OnGpu, class OnProcessor>
auto orOnProcessor(const Context& c, bool may, const OnGpu& onGpu, const OnProcessor& onProcessor) {
    if (!may) return onGpu();
    std::string why;
    try {
        return onGpu();
    } catch (const Interrupted&) {
        throw;
    } catch (const Error& e) {
        why = e.what();
    }
    c.warn(fmt::format("the processor does it instead: {}", why));
    return onProcessor();
}

#else

void requireProcessor(const Context& c, const Arguments& a) {
    if (deviceOf(a) == Device::gpu) throw ValueError(kWithoutGpus);
    if (deviceOf(a) == Device::either) sayProcessor(c, a, kWithoutGpus);
}

#endif

} // namespace

bool asksForGpu(const Arguments& a) { return deviceOf(a) == Device::gpu; }

Option deviceOption() {
    return choice(
        "device", {"cpu", "gpu", "auto"},
        "where to compute; gpu: on a GPU (Vulkan), in float: velocities differ from the processor's by up to 5e-5 "
        "of their rms, and from those of other GPUs; cpu: on the processor, with the same bytes everywhere; auto: on a "
        "GPU if there is one and it can");
}

#ifdef CURLEW_GPU

std::optional<AdvectResult> advectedOnGpu(const Context& c, const Arguments& a, const FlowInTime& flow, double begin,
                                          Points& particles, const AdvectOptions& options, const std::string& otherwise,
                                          const Monitor& monitor) {
    if (deviceOf(a) == Device::processor) return std::nullopt;
    const Flow now = flow.at(begin);
    const std::string why = !otherwise.empty() ? otherwise
                            : !flow.steady()   ? "points follow a flow that changes with time on the processor only"
                                               : whyNotOnGpu(now, options);
    const auto gpu = gpuFor(c, a, why);
    if (!gpu) return std::nullopt;
    return orOnProcessor(
        c, deviceOf(a) == Device::either,
        [&]() -> std::optional<AdvectResult> { return advectOnGpu(gpu, now, particles, options, monitor); },
        []() -> std::optional<AdvectResult> { return std::nullopt; });
}

Warper warperOf(const Context& c, const Arguments& a) {
    const auto gpu = gpuFor(c, a, "");
    if (!gpu) return warp;
    return [&c, may = deviceOf(a) == Device::either, onGpu = warperOn(gpu)](const auto& flow, auto& positions,
                                                                            const auto& options, const auto& monitor) {
        orOnProcessor(
            c, may, [&] { onGpu(flow, positions, options, monitor); },
            [&] { warp(flow, positions, options, monitor); });
    };
}

LicConvolution licConvolutionOf(const Context& c, const Arguments& a) {
    const auto gpu = gpuFor(c, a, "");
    if (!gpu) return convolved;
    return [&c, may = deviceOf(a) == Device::either, onGpu = convolutionOn(gpu)](
               const Image& vectors, const Image& noise, const LicOptions& options, const Monitor& monitor) {
        return orOnProcessor(
            c, may, [&] { return onGpu(vectors, noise, options, monitor); },
            [&] { return convolved(vectors, noise, options, monitor); });
    };
}

std::function<VelocitySource(const Flow&)> velocitySourceOf(const Context& c, const Arguments& a, bool staggered) {
    const auto gpu = gpuFor(
        c, a,
        staggered ? "a staggered grid needs potentials in double, so the processor makes it (staggered=0 can use a GPU)"
                  : "");
    if (!gpu) return {};
    return [&c, gpu, may = deviceOf(a) == Device::either](const Flow& flow) -> VelocitySource {
        VelocitySource onProcessor = [flow](const std::vector<Vec3d>& positions, std::vector<Vec3f>& velocities) {
            velocities.resize(positions.size());
            forEachBatch(positions, [&](const PointBatch& points, size_t begin) {
                VecBatch<float> v;
                flow.velocity(points, v);
                for (int i = 0; i < points.size; ++i) velocities[begin + static_cast<size_t>(i)] = v[i];
            });
        };
        return orOnProcessor(
            c, may,
            [&]() -> VelocitySource {
                const auto onGpu = std::make_shared<const GpuFlowN<3>>(gpu, flow, c.follow("velocity").quiet());
                return
                    [&c, may, onGpu, onProcessor](const std::vector<Vec3d>& positions, std::vector<Vec3f>& velocities) {
                        orOnProcessor(
                            c, may, [&] { onGpu->velocities(positions, velocities); },
                            [&] { onProcessor(positions, velocities); });
                    };
            },
            [&] { return onProcessor; });
    };
}

#else

std::optional<AdvectResult> advectedOnGpu(const Context& c, const Arguments& a, const FlowInTime&, double, Points&,
                                          const AdvectOptions&, const std::string&, const Monitor&) {
    requireProcessor(c, a);
    return std::nullopt;
}
Warper warperOf(const Context& c, const Arguments& a) {
    requireProcessor(c, a);
    return warp;
}
LicConvolution licConvolutionOf(const Context& c, const Arguments& a) {
    requireProcessor(c, a);
    return convolved;
}
std::function<VelocitySource(const Flow&)> velocitySourceOf(const Context& c, const Arguments& a, bool) {
    requireProcessor(c, a);
    return {};
}

#endif

Action deviceAction() {
    const auto run = [](Context& c, const Arguments& a) {
        const std::string& word = a.words()[0];
        double number = 0;
        if (word != "list" && (!parseReal(word, number) || number != std::floor(number) || number < 0 || number > 999))
            throw ValueError(fmt::format("'{}' must be 'list' or the number of a GPU (-device list shows them)", word));
#ifdef CURLEW_GPU
        if (word == "list") {
            const auto all = gpus();
            for (size_t k = 0; k < all.size(); ++k)
                c.console().print(fmt::format("{}  {}\n", k, descriptionOf(all[k])));
        } else {
            c.session().gpu = static_cast<size_t>(number);
            openGpu(c);
        }
#else
        throw ValueError(kWithoutGpus);
#endif
    };
    return {.name = "device",
            .group = "program",
            .summary =
                "choose the GPU for device=gpu and device=auto from here on, or list them (default: the first that "
                "is not software)",
            .positional = {"NUMBER|list", 1, 1},
            .examples = {"curlew -device list"},
            .evaluation = Evaluation::effect,
            .setting = true,
            .run = run};
}

} // namespace curlew::app
