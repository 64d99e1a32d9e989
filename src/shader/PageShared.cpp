// SPDX-License-Identifier: Apache-2.0
#include "PageText.h"

namespace curlew {

// In the GLSL that Translation.h translates.
constexpr std::string_view kPageShared = R"html(
// The size of a particle's next step and the time to catch up, in steps. A rejected step is halved. Later steps are
// longer, up to twice, until the particle has caught up.
vec2 clockAfter(float size, float late, float accepted) {
    float rest = late + 1.0;
    float next = max(0.5 * size, 0.004);
    if (accepted > 0.0) {
        rest = rest - size;
        next = min(2.0 * size, 2.0);
    }
    rest = min(rest, 8.0);
    return vec2(min(next, rest), rest);
}

// 1 in the box, 0 well beyond it.
float fadeAt(vec3 x, vec3 lower, vec3 upper) {
    vec3 beyond = max(max(lower - x, x - upper), vec3(0.0, 0.0, 0.0));
    return max(0.0, 1.0 - length(beyond) / (0.06 * length(upper - lower)));
}
float fadeWithAge(float age) {
    return smoothstep(0.0, 0.05, age) * (1.0 - smoothstep(0.92, 1.0, age));
}
float fadeAlong(float s) {
    return 0.5 * smoothstep(0.0, 0.15, s) * (1.0 - smoothstep(0.6, 1.0, s));
}
vec3 speedColour(float speed) {
    float s = 3.0 * clamp(speed, 0.0, 1.0);
    vec3 colour = mix(vec3(0.55, 0.90, 0.62), vec3(1.0, 0.80, 0.35), s - 2.0);
    if (s < 2.0) {
        colour = mix(vec3(0.12, 0.62, 0.85), vec3(0.55, 0.90, 0.62), s - 1.0);
    }
    if (s < 1.0) {
        colour = mix(vec3(0.10, 0.22, 0.62), vec3(0.12, 0.62, 0.85), s);
    }
    return colour;
}
vec3 labelColour(float label) {
    return vec3(0.55, 0.55, 0.55) + 0.45 * cos(6.2831853 * vec3(label, label + 0.33, label + 0.67));
}
// The colour of a particle from its place and f, its velocity and g, and the rms of the speed and the potentials.
vec3 colourOf(vec4 a, vec4 b, float rms, vec2 potentials, float colours) {
    if (colours > 0.5) {
        return labelColour(a.w / (4.0 * potentials.x) + b.w / (7.0 * max(potentials.y, 1e-30)));
    }
    return speedColour(length(b.xyz) / (2.2 * rms));
}
// The brightness of a round particle, -1 to 1 across.
float dotAt(vec2 q) {
    return max(0.0, 1.0 - dot(q, q));
}
// A position moved onto the wall, by its distance and gradient.
vec3 onWall(vec3 x, vec4 wall) {
    float squared = dot(wall.yzw, wall.yzw);
    float part = 0.0;
    if (squared > 0.0) {
        part = clamp(wall.x, -0.02, 0.02) / squared;
    }
    return x - part * wall.yzw;
}
// layer: 0: solid, 1: the far side of a glass, 2: its near side.
vec3 wallColour(vec3 x, vec3 normal, vec3 eye, float layer) {
    vec3 v = normalize(eye - x);
    vec3 n = normalize(normal);
    if (dot(n, v) < 0.0) {
        n = -n;
    }
    float rim = pow(max(1.0 - dot(n, v), 0.0), 3.0);
    float light = 0.5 + 0.5 * dot(n, normalize(vec3(0.4, 0.8, 0.45)));
    if (layer < 0.5) {
        return mix(vec3(0.07, 0.085, 0.12), vec3(0.34, 0.38, 0.46), light * light) + 0.25 * rim * vec3(0.5, 0.7, 1.0);
    }
    if (layer < 1.5) {
        return mix(vec3(0.018, 0.024, 0.036), vec3(0.06, 0.075, 0.105), light);
    }
    return vec3(0.30, 0.42, 0.60) * (0.05 + 0.75 * rim);
}
// side: where the flow is not allowed: 1 outside, -1 inside, 0 nowhere.
vec3 planeColour(float d, float width, float side) {
    float solid = smoothstep(-width, width, side * d) * abs(side);
    float edge = 1.0 - smoothstep(0.5 * width, 1.5 * width, abs(d));
    return solid * vec3(0.075, 0.09, 0.125) + edge * vec3(0.30, 0.38, 0.50);
}
)html";

} // namespace curlew
