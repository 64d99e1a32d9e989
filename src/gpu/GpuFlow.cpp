// SPDX-License-Identifier: Apache-2.0
#include "curlew/gpu/GpuFlow.h"

#include "FlowText.h"
#include "MoveText.h"
#include "curlew/base/Random.h"
#include "curlew/shader/FlowShader.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstring>

namespace curlew {

namespace {

constexpr std::string_view kVelocityText = R"glsl(
layout(std430, set = 0, binding = 0) readonly buffer Positions { float positions[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Velocities { float velocities[]; };
layout(push_constant) uniform Request { uint count; };
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    PLACE p;
    for (uint a = 0u; a < uint(DIM); ++a) p[a] = positions[uint(DIM) * i + a];
    HERE_ALONE here = flowHere(p);
    PLACE v = VELOCITY(here);
    for (uint a = 0u; a < uint(DIM); ++a) velocities[uint(DIM) * i + a] = v[a];
}
)glsl";

/// What differs with the number of dimensions.
template <int N>
constexpr std::string_view kDimensions;
template <>
constexpr std::string_view kDimensions<2> = R"glsl(
#define DIM 2
#define PLACE vec2
#define TRACK float
#define WALL vec3
#define HERE_ALONE FlowReals5
#define HERE_AND_WALL FlowReals8
#define WALL_OF(h) vec3(h.r5, h.r6, h.r7)
#define VELOCITY(h) vec2(h.r3, h.r4)
#define POTENTIALS(h) h.r0
#define CORRECTED(x, off, h, limit) flowCorrected(x, off, vec2(h.r1, h.r2), limit)
)glsl";
template <>
constexpr std::string_view kDimensions<3> = R"glsl(
#define DIM 3
#define PLACE vec3
#define TRACK vec2
#define WALL vec4
#define HERE_ALONE FlowReals11
#define HERE_AND_WALL FlowReals15
#define WALL_OF(h) vec4(h.r11, h.r12, h.r13, h.r14)
#define VELOCITY(h) vec3(h.r8, h.r9, h.r10)
#define POTENTIALS(h) vec2(h.r0, h.r1)
#define CORRECTED(x, off, h, limit) flowCorrected(x, off, vec3(h.r2, h.r3, h.r4), vec3(h.r5, h.r6, h.r7), limit)
)glsl";

/// Residuals, relative to root mean squares, with which a step may leave its track: the accuracy in float of noises on
/// the integer lattice (docs/shaders.md). The processor corrects the rest at the end.
constexpr double kGpuTolerance = 1e-5;

template <int N>
Vec<double, N> originOf(const FlowN<N>& flow) {
    Vec<double, N> origin;
    const Vec<double, N> centre = flow.domain().box.center();
    for (int i = 0; i < N; ++i)
        origin[i] = std::isfinite(centre[i]) ? static_cast<double>(static_cast<float>(centre[i])) : 0;
    return origin;
}

template <int N>
FlowShaderOptions gpuShaderOptions(const Vec<double, N>& origin, ShaderCoordinates coordinates) {
    Vec3d place;
    for (int i = 0; i < N; ++i) place[i] = origin[i];
    return {.tables = ShaderTables::data,
            .coordinates = coordinates,
            .bindings = {.first = FlowText<N>::kFirstData},
            .tolerance = kGpuTolerance,
            .origin = place,
            .parts = true};
}

} // namespace

template <int N>
FlowText<N>::FlowText(Gpu::Vulkan& gpu, const FlowN<N>& flow, ShaderCoordinates coordinates, const Monitor& monitor)
    : origin(originOf(flow)), hasTracks(flow.hasTracks()), hasWall(flow.domain().wall.has_value()) {
    if (hasTracks) rms = rmsOf(flow, monitor.quiet());
    ShaderText shader = flowShader(flow, gpuShaderOptions<N>(origin, coordinates), monitor.quiet());
    text = std::move(shader.text);
    for (const SymbolBuffer& buffer : shader.buffers) {
        data.emplace_back(gpu, buffer.data->size());
        data.back().upload(buffer.data->size(), 1, [&](size_t begin, size_t end, uint32_t* to) {
            std::copy(buffer.data->begin() + static_cast<std::ptrdiff_t>(begin),
                      buffer.data->begin() + static_cast<std::ptrdiff_t>(end), to);
        });
    }
}

template <int N>
std::string FlowText<N>::program(const std::string& definitions, const std::string& rest) const {
    // There is one group along z, which the driver does not know.
    constexpr std::string_view kZero = "#define flowZero (gl_NumWorkGroups.z >> 1u)\n";
    return fmt::format("{}{}{}{}{}", kZero, kDimensions<N>, definitions, text, rest);
}

template <int N>
std::vector<const GpuBuffer*> FlowText<N>::buffers(const GpuBuffer& first, const GpuBuffer& second) const {
    std::vector<const GpuBuffer*> all{&first, &second};
    for (const GpuBuffer& buffer : data) all.push_back(&buffer);
    return all;
}

template <int N>
struct GpuFlowN<N>::OnGpu : FlowText<N> {
    using FlowText<N>::FlowText;

    /// What velocities() keeps, so that it does not allocate memory for each call.
    std::mutex busy;
    std::unique_ptr<GpuBuffer> positions, velocities;
    size_t room = 0; ///< Points in each.
};

template <int N>
GpuFlowN<N>::GpuFlowN(std::shared_ptr<Gpu> gpu, const FlowN<N>& flow, const Monitor& monitor)
    : GpuFlowN(gpu, flow, gpu->info().doubles ? ShaderCoordinates::doubles : ShaderCoordinates::pairs, monitor) {}
template <int N>
GpuFlowN<N>::GpuFlowN(std::shared_ptr<Gpu> gpu, const FlowN<N>& flow, ShaderCoordinates coordinates,
                      const Monitor& monitor)
    : mGpu(std::move(gpu)), mFlow(std::make_unique<OnGpu>(mGpu->vulkan(), flow, coordinates, monitor)) {
    if (coordinates == ShaderCoordinates::doubles && !mGpu->info().doubles)
        throw GpuError("GPU '" + mGpu->info().name + "' does not compute with doubles (shaderFloat64)");
    requireAgreement(flow);
}

template <int N>
void GpuFlowN<N>::requireAgreement(const FlowN<N>& flow) const {
    constexpr uint64_t kSamples = 256;
    constexpr double kTolerated = 1e-3; // of the speed, for nine of ten
    const BoxN<N> box = flow.domain().box.finite() ? flow.domain().box : BoxN<N>{}.padded(1);
    std::vector<Vec<double, N>> positions(kSamples);
    for (uint64_t k = 0; k < kSamples; ++k)
        for (int axis = 0; axis < N; ++axis)
            positions[k][axis] =
                std::lerp(box.lower[axis], box.upper[axis], randomUniform(1, k, static_cast<uint64_t>(axis)));
    std::vector<Vec<float, N>> found;
    velocities(positions, found);
    double speeds = 0;
    std::vector<double> errors;
    for (size_t k = 0; k < kSamples; ++k) {
        const Vec<double, N> expected = flow.at(positions[k]).velocity;
        Vec<double, N> off;
        for (int axis = 0; axis < N; ++axis) off[axis] = static_cast<double>(found[k][axis]) - expected[axis];
        speeds += length(expected) / kSamples;
        errors.push_back(length(off));
    }
    std::sort(errors.begin(), errors.end());
    if (const double error = errors[errors.size() * 9 / 10]; !(error <= kTolerated * speeds))
        throw GpuError(
            fmt::format("GPU '{}' computes velocities that are off by {:.1e} where the speed is {:.1e} on average: "
                        "float positions do not resolve this flow, or the driver is at fault; use device=cpu",
                        mGpu->info().name, error, speeds));
}

template <int N>
GpuFlowN<N>::~GpuFlowN() = default;

template <int N>
void GpuFlowN<N>::velocities(const std::vector<Vec<double, N>>& positions, std::vector<Vec<float, N>>& velocities,
                             const Monitor& monitor) const {
    Gpu::Vulkan& gpu = mGpu->vulkan();
    velocities.resize(positions.size());
    const size_t most = std::min(gpu.mostAtOnce(N), std::max<size_t>(positions.size(), 1));
    const std::lock_guard lock(mFlow->busy);
    if (mFlow->room < most) {
        mFlow->room = 0;
        mFlow->positions = std::make_unique<GpuBuffer>(gpu, N * most);
        mFlow->velocities = std::make_unique<GpuBuffer>(gpu, N * most);
        mFlow->room = most;
    }
    GpuBuffer &places = *mFlow->positions, &results = *mFlow->velocities;
    const auto buffers = mFlow->buffers(places, results);
    const auto program = gpu.program(mFlow->program("", std::string(kVelocityText)), buffers.size(), sizeof(uint32_t));
    for (size_t begin = 0; begin < positions.size(); begin += most) {
        monitor.check();
        const size_t count = std::min(most, positions.size() - begin);
        places.upload(count, N, [&](size_t from, size_t to, uint32_t* words) {
            for (size_t k = from; k < to; ++k)
                for (int i = 0; i < N; ++i)
                    *words++ = std::bit_cast<uint32_t>(static_cast<float>(positions[begin + k][i] - mFlow->origin[i]));
        });
        const auto points = static_cast<uint32_t>(count);
        program->run(buffers, &points, count);
        results.download(count, N, [&](size_t from, size_t to, const uint32_t* words) {
            std::memcpy(velocities[begin + from].c.data(), words, (to - from) * sizeof(Vec<float, N>));
        });
        if (monitor.report) monitor.report(static_cast<double>(begin + count) / static_cast<double>(positions.size()));
    }
}

namespace {

/// The words of a point's state.
template <int N>
struct MoveState {
    static constexpr size_t kFixed = size_t{2 * N - 1};
    static constexpr size_t kWords = kFixed + kMoveWords;
    std::array<uint32_t, kWords> words;

    uint32_t& word(MoveWord which) { return words[kFixed + static_cast<size_t>(which)]; }
    static uint32_t bits(double value) { return std::bit_cast<uint32_t>(static_cast<float>(value)); }
};

template <int N>
MoveState<N> stateOf(const GpuPointsN<N>& points, size_t k, const Vec<double, N>& origin, const GpuMoveOptions& o) {
    MoveState<N> state{};
    for (size_t i = 0; i < size_t{N}; ++i) state.words[i] = state.bits(points.position[k].c[i] - origin.c[i]);
    for (size_t q = 0; q + 1 < size_t{N} && !points.track.empty(); ++q)
        state.words[N + q] = state.bits(points.track[k][q]);
    if (points.track.empty()) state.word(MoveWord::flags) = kMoveStarts;
    const double pace = static_cast<double>(points.pace[k]), time = std::abs(o.time) * pace;
    const bool adaptive = o.steps == 0;
    state.word(MoveWord::left) = state.bits(adaptive ? time : pace > 0 ? o.steps : 0);
    state.word(MoveWord::next) = state.bits(adaptive ? std::min(o.firstStep, time) : 1);
    state.word(MoveWord::rest) = state.bits(1);
    state.word(MoveWord::unit) = state.bits(adaptive ? std::copysign(1, o.time) : o.time / o.steps * pace);
    return state;
}

template <int N>
void store(MoveState<N>& state, GpuPointsN<N>& points, size_t k, const Vec<double, N>& origin) {
    for (size_t i = 0; i < size_t{N}; ++i)
        points.position[k].c[i] = origin.c[i] + static_cast<double>(std::bit_cast<float>(state.words[i]));
    points.error[k] = std::bit_cast<float>(state.word(MoveWord::error));
    if (state.word(MoveWord::flags) & kMoveMissed) points.converged[k] = 0;
}

/// Chooses how many evaluations of the flow a run makes, so that it takes about kSeconds.
class RunLength {
  public:
    using Clock = std::chrono::steady_clock;

    uint32_t evaluations() const { return mEvaluations; }
    void ranSince(Clock::time_point begin) {
        constexpr double kSeconds = 0.1, kMost = 1 << 16;
        const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
        const double factor = std::clamp(kSeconds / std::max(seconds, 1e-6), 0.25, 8.0);
        mEvaluations = static_cast<uint32_t>(std::clamp(mEvaluations * factor, 8.0, kMost));
    }

  private:
    uint32_t mEvaluations = 64;
};

} // namespace

template <int N>
GpuMoved GpuFlowN<N>::move(GpuPointsN<N>& points, const GpuMoveOptions& o, const Monitor& monitor) const {
    if (o.steps == 0 && !tableauOf(o.scheme).embedded())
        throw ValueError("a scheme without an error estimate needs a number of steps");
    Gpu::Vulkan& gpu = mGpu->vulkan();
    const size_t all = points.position.size();
    points.pace.resize(all, 1);
    points.converged.resize(all, 1);
    points.error.resize(all, 0);
    const double usual = std::min(o.firstStep, std::abs(o.time));
    const size_t most = std::min(gpu.mostAtOnce(MoveState<N>::kWords), std::max<size_t>(all, 1));
    GpuBuffer words(gpu, MoveState<N>::kWords * most), counts(gpu, kMoveCounts);
    const auto buffers = mFlow->buffers(words, counts);
    const auto program =
        gpu.program(mFlow->program(moveDefinitions<N>(o, mFlow->hasTracks, mFlow->hasWall, mFlow->rms), moveText(o)),
                    buffers.size(), sizeof(MoveRequest));
    constexpr size_t kCountable = ~uint32_t{0}; // steps of all points in a run
    GpuMoved moved;
    RunLength length;
    for (size_t begin = 0; begin < all; begin += most) {
        const size_t count = std::min(most, all - begin);
        words.upload(count, MoveState<N>::kWords, [&](size_t from, size_t to, uint32_t* at) {
            for (size_t k = from; k < to; ++k) {
                const MoveState<N> state = stateOf(points, begin + k, mFlow->origin, o);
                at = std::copy(state.words.begin(), state.words.end(), at);
            }
        });
        for (bool moving = true; moving;) {
            monitor.check();
            const MoveRequest request{
                .count = static_cast<uint32_t>(count),
                .budget = std::min(length.evaluations(), static_cast<uint32_t>(kCountable / count)),
                .accuracy = static_cast<float>(o.accuracy),
                .rmsSpeed = static_cast<float>(o.rmsSpeed),
                .maxStep = static_cast<float>(o.maxStep),
                .shortest = static_cast<float>(usual * 0x1p-20),
                .guardedShortest = static_cast<float>(o.steps > 0 ? std::ldexp(1.0, -o.maxSubdivisions)
                                                                  : std::ldexp(usual, -o.maxSubdivisions - 4)),
                .usual = static_cast<float>(usual)};
            std::array<uint32_t, kMoveCounts> sums{};
            counts.upload(1, kMoveCounts,
                          [&](size_t, size_t, uint32_t* to) { std::copy(sums.begin(), sums.end(), to); });
            const auto began = RunLength::Clock::now();
            program->run(buffers, &request, count);
            length.ranSince(began);
            counts.download(1, kMoveCounts, [&](size_t, size_t, const uint32_t* from) {
                std::copy_n(from, kMoveCounts, sums.begin());
            });
            moved.substeps += sums[0];
            moved.retries += sums[1];
            moved.stalled += sums[2];
            moved.coarse += sums[3];
            moved.corrections += sums[4];
            moving = sums[5] > 0;
            if (monitor.report)
                monitor.report((static_cast<double>(begin) + static_cast<double>(count - sums[5])) /
                               static_cast<double>(all));
        }
        words.download(count, MoveState<N>::kWords, [&](size_t from, size_t to, const uint32_t* at) {
            MoveState<N> state;
            for (size_t k = from; k < to; ++k, at += MoveState<N>::kWords) {
                std::copy_n(at, MoveState<N>::kWords, state.words.begin());
                store(state, points, begin + k, mFlow->origin);
            }
        });
    }
    return moved;
}

template class GpuFlowN<2>;
template class GpuFlowN<3>;

} // namespace curlew
