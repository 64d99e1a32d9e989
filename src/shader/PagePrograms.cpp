// SPDX-License-Identifier: Apache-2.0
#include "PageText.h"

namespace curlew {

// The programs of WebGL. A particle's state is six vec4: the flow at its place as in `flow`, the wall there, and its
// clock: the size of its next step and the time to catch up, in steps, and its track. The programs that call the flow
// are straight lines with one call, because a compiler for the processor takes minutes for loops or several calls.
constexpr std::string_view kPagePrograms = R"html(<script type="x-shader" id="common">
#if DIM == 3
#define Place vec3
#define Track vec2
#define Wall vec4
vec4 joined(vec3 v, float w) { return vec4(v, w); }
vec4 wallPacked(vec4 w) { return w; }
vec2 potentialsOf(vec4 a, vec4 b) { return vec2(a.w, b.w); }
vec2 trackOf(vec4 clock) { return clock.zw; }
#else
#define Place vec2
#define Track float
#define Wall vec3
vec4 joined(vec2 v, float w) { return vec4(v, 0.0, w); }
vec4 wallPacked(vec3 w) { return vec4(w, 0.0); }
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
    vec2 clocks = clockAfter(clock.x, clock.y, accepted ? 1.0 : 0.0);
    clock1 = vec4(clocks, clock.zw);
}
</script>
<script type="x-shader" id="palette">
uniform float rms;       // of the speed
uniform vec2 potentials; // rms of them
uniform float colours;   // 0: by speed, 1: by label
uniform vec3 lower, upper; // the box of the flow
</script>
<script type="x-shader" id="particles-vertex">
in vec4 a, b;
uniform mat4 view;
uniform float size, count, moment;
out vec4 colour;
void main() {
    gl_Position = view * vec4(a.xyz, 1.0);
    float alpha = fadeWithAge(fract(moment - float(gl_VertexID) / count)) * fadeAt(a.xyz, lower, upper);
    float pixels = size / gl_Position.w;
    gl_PointSize = clamp(pixels, 1.5, 24.0);
    colour = vec4(colourOf(a, b, rms, potentials, colours), alpha * min(pixels / 1.5, 1.0));
}
</script>
<script type="x-shader" id="particles-fragment">
in vec4 colour;
out vec4 pixel;
void main() {
    pixel = vec4(colour.rgb * (colour.a * dotAt(2.0 * gl_PointCoord - 1.0)), 1.0);
}
</script>
<script type="x-shader" id="lines-vertex">
in vec4 a, b;
uniform mat4 view;
uniform float across, along;
out vec4 colour;
void main() {
    gl_Position = view * vec4(a.xyz, 1.0);
    float alpha = fadeAlong(floor(float(gl_VertexID) / across) / along) * fadeAt(a.xyz, lower, upper);
    colour = vec4(colourOf(a, b, rms, potentials, colours), alpha);
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
    at = onWall(a.xyz, wall);
    normal = wall.yzw;
    gl_Position = view * vec4(at, 1.0);
}
</script>
<script type="x-shader" id="wall-fragment">
in vec3 at, normal;
uniform vec3 eye;
uniform float layer;
out vec4 pixel;
void main() { pixel = vec4(wallColour(at, normal, eye, layer), 1.0); }
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
uniform float side;
out vec4 pixel;
void main() {
    float d = flowWall(at).x;
    pixel = vec4(planeColour(d, fwidth(d), side), 1.0);
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
