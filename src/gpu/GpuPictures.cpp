// SPDX-License-Identifier: Apache-2.0
#include "curlew/gpu/GpuPictures.h"

#include "Vulkan.h"
#include "curlew/gpu/GpuFlow.h"
#include "curlew/track/AdvectParts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

namespace curlew {

namespace {

/// Below this residual of f, relative to its root mean square, corrections only shift rounding errors. The gradient
/// noise has errors of 4e-7 in float (root mean square; 1 % of them are above 1.6e-6).
constexpr double kRounding = 1e-6;

/// The steps of GpuFlowN::move() that do what warp() does with these options.
GpuMoveOptions warpMove(const FlowN<2>& flow, const WarpOptions& o) {
    GpuMoveOptions move{.time = o.time, .corrections = o.corrections, .enough = kRounding, .guarded = false};
    if (!o.adaptive()) {
        move.scheme = o.scheme.value_or(Scheme::rk4);
        move.steps = o.steps;
        move.limited = false;
        return move;
    }
    const AdvectOptions chosen = chosenSteps(
        flow,
        {.time = o.time, .scheme = o.scheme, .reprojection = {.method = Reprojection::none}, .accuracy = o.accuracy});
    move.scheme = *chosen.scheme;
    move.accuracy = chosen.accuracy;
    move.firstStep = std::min(firstStep(flow, *chosen.scheme, chosen.accuracy), std::abs(o.time));
    move.rmsSpeed = flow.hasTracks() ? rmsOf(flow).speed : 0;
    move.maxSubdivisions = 0;
    return move;
}

// The algorithm of Streak in picture/Lic.cpp, one pixel per invocation. y points down, as in the picture.
constexpr std::string_view kLicText = R"glsl(
layout(std430, set = 0, binding = 0) readonly buffer Vectors { vec2 vectors[]; };
layout(std430, set = 0, binding = 1) readonly buffer Noise { float noise[]; };
layout(std430, set = 0, binding = 2) writeonly buffer Result { float result[]; };
layout(push_constant) uniform Request {
    int width, height, noiseWidth, noiseHeight, steps, first, last, fades;
    float grain, size;
};

vec2 vectorAt(vec2 p) {
    vec2 q = clamp(p - 0.5, vec2(0.0), vec2(width - 1, height - 1));
    ivec2 a = ivec2(q);
    vec2 t = q - vec2(a);
    // A neighbour without weight does not count, even if it is NaN.
    ivec2 b = min(a + ivec2(greaterThan(t, vec2(0.0))), ivec2(width - 1, height - 1));
    vec2 upper = vectors[a.y * width + a.x] * (1.0 - t.x) + vectors[a.y * width + b.x] * t.x;
    vec2 lower = vectors[b.y * width + a.x] * (1.0 - t.x) + vectors[b.y * width + b.x] * t.x;
    vec2 v = upper * (1.0 - t.y) + lower * t.y;
    return vec2(v.x, -v.y);
}

float grainAt(vec2 p) {
    vec2 q = clamp(p / grain, vec2(0.0), vec2(noiseWidth - 1, noiseHeight - 1));
    ivec2 a = ivec2(q), b = min(a + 1, ivec2(noiseWidth - 1, noiseHeight - 1));
    vec2 t = q - vec2(a);
    float upper = noise[a.y * noiseWidth + a.x] * (1.0 - t.x) + noise[a.y * noiseWidth + b.x] * t.x;
    float lower = noise[b.y * noiseWidth + a.x] * (1.0 - t.x) + noise[b.y * noiseWidth + b.x] * t.x;
    return upper * (1.0 - t.y) + lower * t.y;
}

bool contains(vec2 p) {
    return p.x >= 0.0 && p.y >= 0.0 && p.x <= float(width) && p.y <= float(height);
}

// Whether there is a direction at a position.
bool directionAt(vec2 p, out vec2 direction) {
    direction = vec2(0.0);
    if (!contains(p)) return false;
    vec2 v = vectorAt(p);
    float speed = length(v);
    if (!(speed > 0.0) || !(speed < 1e38)) return false; // also NaN
    direction = v / speed;
    return true;
}

void main() {
    int pixel = first + int(gl_GlobalInvocationID.x);
    if (pixel >= last) return;
    vec2 centre = vec2(pixel % width, pixel / width) + 0.5, here = vectors[pixel];
    if (isnan(here.x + here.y)) {
        result[pixel] = here.x + here.y;
        return;
    }
    float sum = grainAt(centre), weight = 1.0;
    for (int side = 0; side < 2; ++side) {
        float h = side == 0 ? size : -size;
        vec2 p = centre, d;
        for (int k = 1; k <= steps; ++k) {
            if (!directionAt(p, d) || !directionAt(p + 0.5 * h * d, d)) break;
            p += h * d;
            if (!contains(p)) break;
            float w = fades == 0 ? 1.0 : 0.5 + 0.5 * cos(3.14159265 * float(k) / float(steps + 1));
            sum += w * grainAt(p);
            weight += w;
        }
    }
    result[pixel] = sum / weight;
}
)glsl";

/// The push constants of kLicText.
struct LicRequest {
    int32_t width, height, noiseWidth, noiseHeight, steps, first, last, fades;
    float grain, size;
};

GpuBuffer uploaded(Gpu::Vulkan& gpu, const Image& image) {
    GpuBuffer buffer(gpu, image.pixels.size());
    buffer.upload(image.pixels.size(), 1, [&](size_t begin, size_t end, uint32_t* to) {
        std::memcpy(to, &image.pixels[begin], (end - begin) * sizeof(float));
    });
    return buffer;
}

Image convolvedOn(Gpu::Vulkan& gpu, const Image& vectors, const Image& noise, const LicOptions& o,
                  const Monitor& monitor) {
    constexpr size_t kAtOnce = size_t{1} << 19; // pixels of a run, so that none takes long
    Image image = filledImage(vectors.width, vectors.height, {"lic"});
    const size_t all = image.pixels.size();
    const GpuBuffer vectorsThere = uploaded(gpu, vectors), noiseThere = uploaded(gpu, noise);
    const GpuBuffer result(gpu, all);
    const auto program = gpu.program(std::string(kLicText), 3, sizeof(LicRequest));
    LicRequest request{.width = vectors.width,
                       .height = vectors.height,
                       .noiseWidth = noise.width,
                       .noiseHeight = noise.height,
                       .steps = o.steps(),
                       .first = 0,
                       .last = 0,
                       .fades = o.kernel == LicKernel::hann ? 1 : 0,
                       .grain = static_cast<float>(o.grain),
                       .size = static_cast<float>(LicOptions::kStep)};
    for (size_t begin = 0; begin < all; begin += kAtOnce) {
        monitor.check();
        const size_t count = std::min(kAtOnce, all - begin);
        request.first = static_cast<int32_t>(begin);
        request.last = static_cast<int32_t>(begin + count);
        program->run({&vectorsThere, &noiseThere, &result}, &request, count);
        if (monitor.report) monitor.report(static_cast<double>(begin + count) / static_cast<double>(all));
    }
    result.download(all, 1, [&](size_t begin, size_t end, const uint32_t* from) {
        std::memcpy(&image.pixels[begin], from, (end - begin) * sizeof(float));
    });
    return image;
}

} // namespace

Warper warperOn(std::shared_ptr<Gpu> gpu) {
    return [gpu = std::move(gpu)](const FlowN<2>& flow, std::vector<Vec<double, 2>>& positions,
                                  const WarpOptions& options, const Monitor& monitor) {
        options.validate(flow);
        const FlowN<2> free = flow.within({.box = flow.domain().box, .wall = {}});
        const GpuFlowN<2> onGpu(gpu, free, monitor);
        GpuPointsN<2> points;
        points.position = positions;
        onGpu.move(points, warpMove(free, options), monitor);
        positions = std::move(points.position);
    };
}

LicConvolution convolutionOn(std::shared_ptr<Gpu> gpu) {
    return
        [gpu = std::move(gpu)](const Image& vectors, const Image& noise, const LicOptions& o, const Monitor& monitor) {
            return convolvedOn(gpu->vulkan(), vectors, noise, o, monitor);
        };
}

} // namespace curlew
