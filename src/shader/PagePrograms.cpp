// SPDX-License-Identifier: Apache-2.0
#include "PageText.h"

namespace curlew {

// A particle's state is six vec4: the flow at its place as in `flow`, the wall there, and its clock: the size of its
// next step and the time to catch up, in steps, and its track. The programs that call the flow are straight lines with
// one call, because a compiler for the processor takes minutes for loops or several calls.
constexpr std::string_view kPagePrograms = R"html(<script type="x-shader" id="common">
#if DIM == 3
#define Place vec3
#define Track vec2
#define Wall vec4
vec4 joined(vec3 v, float w) { return vec4(v, w); }
vec4 wallPacked(vec4 w) { return w; }
vec3 inSpace(vec4 a) { return a.xyz; }
vec2 potentialsOf(vec4 a, vec4 b) { return vec2(a.w, b.w); }
vec2 trackOf(vec4 clock) { return clock.zw; }
#else
#define Place vec2
#define Track float
#define Wall vec3
vec4 joined(vec2 v, float w) { return vec4(v, 0.0, w); }
vec4 wallPacked(vec3 w) { return vec4(w, 0.0); }
vec3 inSpace(vec4 a) { return vec3(a.xy, 0.0); }
float potentialsOf(vec4 a, vec4 b) { return a.w; }
float trackOf(vec4 clock) { return clock.z; }
#endif
</script>
<script type="x-shader" id="flow">
in vec4 start, clock, a, b, c, d; // the particle, and the flow at the last place
uniform float dt, part;
uniform bool correct;
out vec4 a1, b1, c1, d1; // place and f, velocity and g, and their gradients
void main() {
    Place p = Place(start), x = p + (part * dt * clock.x) * Place(b);
#if TRACKS
    if (correct) {
        Track off = trackOf(clock) - potentialsOf(a, b);
        float limit = length(Place(a) - p);
#if DIM == 3
        x = flowCorrected(Place(a), off, Place(c), Place(d), limit);
#else
        x = flowCorrected(Place(a), off, Place(c), limit);
#endif
    }
#endif
#if DIM == 3
    FlowReals11 here = flowHere(x);
    a1 = vec4(x, here.r0);
    b1 = vec4(here.r8, here.r9, here.r10, here.r1);
    c1 = vec4(here.r2, here.r3, here.r4, 0.0);
    d1 = vec4(here.r5, here.r6, here.r7, 0.0);
#else
    FlowReals5 here = flowHere(x);
    a1 = joined(x, here.r0);
    b1 = vec4(here.r3, here.r4, 0.0, 0.0);
    c1 = vec4(here.r1, here.r2, 0.0, 0.0);
    d1 = vec4(0.0);
#endif
}
</script>
<script type="x-shader" id="distance">
in vec4 start, a; // the particle and the end of its step
uniform float part;
out vec4 wall;
void main() {
    wall = wallPacked(flowWall(part == 1.0 ? Place(a) : Place(start) + part * (Place(a) - Place(start))));
}
</script>
<script type="x-shader" id="accept">
in vec4 start, startB, startC, startD, startWall, clock; // the particle
in vec4 a, b, c, d, wall;                                // the end of its step
in vec4 quarter, half_, threeQuarters;                   // the wall between them
out vec4 a1, b1, c1, d1, wall1, clock1;
void main() {
    Track off = trackOf(clock) - potentialsOf(a, b);
    vec3 between = vec3(quarter.x, half_.x, threeQuarters.x);
    bool accepted = flowAccepts(Place(start), Place(a), off, Wall(startWall), between, Wall(wall)) > 0.0;
    a1 = accepted ? a : start;
    b1 = accepted ? b : startB;
    c1 = accepted ? c : startC;
    d1 = accepted ? d : startD;
    wall1 = accepted ? wall : startWall;
    // A rejected step is halved. Later steps are longer, up to twice, until the particle has caught up.
    float late = min(clock.y - (accepted ? clock.x : 0.0) + 1.0, 8.0);
    float size = accepted ? min(2.0 * clock.x, 2.0) : max(0.5 * clock.x, 0.004);
    clock1 = vec4(min(size, late), late, clock.zw);
}
</script>
<script type="x-shader" id="palette">
uniform float rms;       // of the speed
uniform vec2 potentials; // rms of them
uniform int colours;
uniform vec3 lower, upper; // the box of the flow
float fadeAt(vec3 x) { // 1 in the box, 0 well beyond it
    return max(0.0, 1.0 - length(max(max(lower - x, x - upper), 0.0)) / (0.06 * length(upper - lower)));
}
vec3 between(vec3 a, vec3 b, vec3 c, vec3 d, float x) {
    x = clamp(x, 0.0, 1.0) * 3.0;
    return x < 1.0 ? mix(a, b, x) : x < 2.0 ? mix(b, c, x - 1.0) : mix(c, d, x - 2.0);
}
vec3 colourOf(vec4 a, vec4 b) {
    if (colours == 0)
        return between(vec3(0.10, 0.22, 0.62), vec3(0.12, 0.62, 0.85), vec3(0.55, 0.90, 0.62), vec3(1.0, 0.80, 0.35),
                       length(Place(b)) / (2.2 * rms));
    float label = a.w / (4.0 * potentials.x) + b.w / (7.0 * max(potentials.y, 1e-30));
    return 0.55 + 0.45 * cos(6.2831853 * (label + vec3(0.0, 0.33, 0.67)));
}
</script>
<script type="x-shader" id="particles-vertex">
in vec4 a, b;
uniform mat4 view;
uniform float size, count, moment;
out vec4 colour;
void main() {
    vec3 x = inSpace(a);
    gl_Position = view * vec4(x, 1.0);
    float age = fract(moment - float(gl_VertexID) / count);
    float alpha = smoothstep(0.0, 0.05, age) * (1.0 - smoothstep(0.92, 1.0, age)) * fadeAt(x);
    float pixels = size / gl_Position.w;
    gl_PointSize = clamp(pixels, 1.5, 24.0);
    colour = vec4(colourOf(a, b), alpha * min(pixels / 1.5, 1.0));
}
</script>
<script type="x-shader" id="particles-fragment">
in vec4 colour;
out vec4 pixel;
void main() {
    vec2 q = 2.0 * gl_PointCoord - 1.0;
    float falloff = max(0.0, 1.0 - dot(q, q));
    pixel = vec4(colour.rgb * (colour.a * falloff), 1.0);
}
</script>
<script type="x-shader" id="lines-vertex">
in vec4 a, b;
uniform mat4 view;
uniform float across, along;
out vec4 colour;
void main() {
    gl_Position = view * vec4(inSpace(a), 1.0);
    float s = floor(float(gl_VertexID) / across) / along;
    colour = vec4(colourOf(a, b), 0.5 * smoothstep(0.0, 0.15, s) * (1.0 - smoothstep(0.6, 1.0, s)) * fadeAt(inSpace(a)));
}
</script>
<script type="x-shader" id="lines-fragment">
in vec4 colour;
out vec4 pixel;
void main() { pixel = vec4(colour.rgb * colour.a, 1.0); }
</script>
<script type="x-shader" id="wall-vertex">
in vec4 a, wall;
uniform mat4 view;
out vec3 at, normal;
void main() {
    float squared = dot(wall.yzw, wall.yzw);
    at = a.xyz - wall.yzw * (squared > 0.0 ? clamp(wall.x, -0.02, 0.02) / squared : 0.0); // onto the surface
    normal = wall.yzw;
    gl_Position = view * vec4(at, 1.0);
}
</script>
<script type="x-shader" id="wall-fragment">
in vec3 at, normal;
uniform vec3 eye;
uniform int layer; // 0: solid, 1: the far side of a glass, 2: the near side
out vec4 pixel;
void main() {
    vec3 v = normalize(eye - at), n = normalize(normal);
    n = dot(n, v) < 0.0 ? -n : n;
    float facing = dot(n, v), rim = pow(1.0 - facing, 3.0);
    float light = 0.5 + 0.5 * dot(n, normalize(vec3(0.4, 0.8, 0.45)));
    if (layer == 0)
        pixel = vec4(mix(vec3(0.07, 0.085, 0.12), vec3(0.34, 0.38, 0.46), light * light) + 0.25 * rim * vec3(0.5, 0.7, 1.0), 1.0);
    else if (layer == 1)
        pixel = vec4(mix(vec3(0.018, 0.024, 0.036), vec3(0.06, 0.075, 0.105), light), 1.0);
    else
        pixel = vec4(vec3(0.30, 0.42, 0.60) * (0.05 + 0.75 * rim), 1.0);
}
</script>
<script type="x-shader" id="plane-vertex">
uniform mat4 view;
uniform vec3 lower, upper;
out vec2 at;
void main() {
    at = mix(lower.xy, upper.xy, vec2(gl_VertexID & 1, gl_VertexID >> 1));
    gl_Position = view * vec4(at, 0.0, 1.0);
}
</script>
<script type="x-shader" id="plane-fragment">
in vec2 at;
uniform float side; // where the flow is not allowed: 1 outside, -1 inside, 0 nowhere
out vec4 pixel;
void main() {
    float d = flowWall(at).x, width = fwidth(d);
    float solid = smoothstep(-width, width, side * d) * abs(side);
    float edge = 1.0 - smoothstep(0.5 * width, 1.5 * width, abs(d));
    pixel = vec4(solid * vec3(0.075, 0.09, 0.125) + edge * vec3(0.30, 0.38, 0.50), 1.0);
}
</script>
<script type="x-shader" id="box-vertex">
uniform mat4 view;
uniform vec3 lower, upper;
void main() {
    int edge = gl_VertexID >> 1, axis = edge >> 2;
    vec3 s = vec3(gl_VertexID & 1, edge & 1, (edge >> 1) & 1);
    s = axis == 0 ? s : axis == 1 ? s.yxz : s.yzx;
    gl_Position = view * vec4(mix(lower, upper, s), 1.0);
}
</script>
<script type="x-shader" id="box-fragment">
out vec4 pixel;
void main() { pixel = vec4(0.09, 0.115, 0.155, 1.0); }
</script>
)html";

} // namespace curlew
