// SPDX-License-Identifier: Apache-2.0
#include "PageText.h"

namespace curlew {

// Each call of the flow is in a loop: compilers put calls in line. A state is as in PagePrograms.cpp.
constexpr std::string_view kPageWebGpu = R"html(<script type="x-shader" id="steps-wgsl">
struct Flow { a: vec4f, b: vec4f, c: vec4f, d: vec4f }
struct Particle { a: vec4f, b: vec4f, c: vec4f, d: vec4f, wall: vec4f, clock: vec4f }
struct Request { dt: f32, count: u32 }
@group(1) @binding(0) var<storage, read_write> particles: array<Particle>;
@group(1) @binding(1) var<uniform> request: Request;

@compute @workgroup_size(64) fn start(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= request.count) { return; }
    let f = flowAt(particles[id.x].a.xyz);
    particles[id.x] = Particle(f.a, f.b, f.c, f.d, wallAt(f.a.xyz), vec4f(1.0, 1.0, f.a.w, f.b.w));
}

@compute @workgroup_size(64) fn advance(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= request.count) { return; }
    let old = particles[id.x];
    let p = old.a.xyz;
    let dt = request.dt * old.clock.x;
    var x = p + 0.5 * dt * old.b.xyz;
    var f = Flow();
    var off = vec2f();
    for (var k = 0; k < kEvaluations; k++) {
        f = flowAt(x);
        off = old.clock.zw - vec2f(f.a.w, f.b.w);
        if (k == 0) {
            x = p + dt * f.b.xyz;
        } else if (k < kEvaluations - 1) {
            x = corrected(f, off, length(x - p));
        }
    }
    x = f.a.xyz;
    var between = vec3f();
    var wall = vec4f();
    for (var k = 1; k <= 4; k++) {
        wall = wallAt(select(p + 0.25 * f32(k) * (x - p), x, k == 4));
        if (k < 4) { between[k - 1] = wall.x; }
    }
    let accepted = accepts(p, x, off, old.wall, between, wall);
    let clock = vec4f(clockAfter(old.clock.x, old.clock.y, accepted), old.clock.zw);
    if (accepted > 0.0) {
        particles[id.x] = Particle(f.a, f.b, f.c, f.d, wall, clock);
    } else {
        particles[id.x].clock = clock;
    }
}
</script>
<script type="x-shader" id="drawing-wgsl">
struct Frame {
    view: mat4x4f,
    lower: vec3f, rms: f32,
    upper: vec3f, size: f32,
    eye: vec3f, moment: f32,
    potentials: vec2f, count: f32, colours: f32,
    across: f32, along: f32, side: f32, width: f32, height: f32
}
@group(1) @binding(0) var<uniform> frame: Frame;
override layer = 0.0;

fn seen(x: vec3f) -> vec4f {
    let p = frame.view * vec4f(x, 1.0);
    return vec4f(p.xy, 0.5 * (p.z + p.w), p.w);
}
fn colourHere(a: vec4f, b: vec4f) -> vec3f { return colourOf(a, b, frame.rms, frame.potentials, frame.colours); }

struct Dot { @builtin(position) at: vec4f, @location(0) @interpolate(flat) colour: vec3f, @location(1) q: vec2f }
@vertex fn particleVertex(@builtin(vertex_index) corner: u32, @builtin(instance_index) index: u32,
                          @location(0) a: vec4f, @location(1) b: vec4f) -> Dot {
    let q = 2.0 * vec2f(f32(corner & 1u), f32(corner >> 1u)) - 1.0;
    let at = seen(a.xyz);
    let alpha = fadeWithAge(fract(frame.moment - f32(index) / frame.count)) * fadeAt(a.xyz, frame.lower, frame.upper);
    let pixels = frame.size / at.w;
    let shift = q * clamp(pixels, 1.5, 24.0) * at.w / vec2f(frame.width, frame.height);
    return Dot(at + vec4f(shift, 0.0, 0.0), colourHere(a, b) * (alpha * min(pixels / 1.5, 1.0)), q);
}
@fragment fn particleFragment(dot: Dot) -> @location(0) vec4f { return vec4f(dot.colour * dotAt(dot.q), 1.0); }

struct Line { @builtin(position) at: vec4f, @location(0) colour: vec3f }
@vertex fn lineVertex(@builtin(vertex_index) index: u32, @location(0) a: vec4f, @location(1) b: vec4f) -> Line {
    let alpha = fadeAlong(floor(f32(index) / frame.across) / frame.along) * fadeAt(a.xyz, frame.lower, frame.upper);
    return Line(seen(a.xyz), colourHere(a, b) * alpha);
}
@fragment fn lineFragment(line: Line) -> @location(0) vec4f { return vec4f(line.colour, 1.0); }

struct Surface { @builtin(position) at: vec4f, @location(0) x: vec3f, @location(1) normal: vec3f }
@vertex fn wallVertex(@location(0) a: vec4f, @location(1) wall: vec4f) -> Surface {
    let x = onWall(a.xyz, wall);
    return Surface(seen(x), x, wall.yzw);
}
@fragment fn wallFragment(s: Surface) -> @location(0) vec4f { return vec4f(wallColour(s.x, s.normal, frame.eye, layer), 1.0); }

@vertex fn boxVertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    let edge = index >> 1u;
    var s = vec3f(f32(index & 1u), f32(edge & 1u), f32((edge >> 1u) & 1u));
    if (edge >> 2u == 1u) { s = s.yxz; }
    if (edge >> 2u == 2u) { s = s.yzx; }
    return seen(mix(frame.lower, frame.upper, s));
}
@fragment fn boxFragment() -> @location(0) vec4f { return vec4f(0.09, 0.115, 0.155, 1.0); }

struct Plane { @builtin(position) at: vec4f, @location(0) x: vec2f }
@vertex fn planeVertex(@builtin(vertex_index) index: u32) -> Plane {
    let x = mix(frame.lower.xy, frame.upper.xy, vec2f(f32(index & 1u), f32(index >> 1u)));
    return Plane(seen(vec3f(x, 0.0)), x);
}
</script>
<script type="x-shader" id="plane-wgsl">
@fragment fn planeFragment(plane: Plane) -> @location(0) vec4f {
    let d = flowWall(plane.x).x;
    return vec4f(planeColour(d, fwidth(d), frame.side), 1.0);
}
</script>
<script>
"use strict";
/// A promise of a device that uses WebGPU; null if there is none, or only software, unless `software` is true.
async function webGpu(software) {
    const adapter = await navigator.gpu?.requestAdapter({powerPreference: "high-performance"});
    if (!adapter || (!software && (adapter.isFallbackAdapter || adapter.info?.isFallbackAdapter))) return null;
    const gpu = await adapter.requestDevice(), {queue} = gpu, usage = GPUBufferUsage;
    const kState = 4 * kNumbers, kSamples = 4; // bytes; for smooth edges
    let failure = "";
    gpu.addEventListener("uncapturederror", ({error}) => {
        failure ||= error.message;
        showMessage(`The graphics device reports an error: ${error.message}`);
    });
    gpu.lost.then(({message}) => showMessage(`The graphics device was lost; load the page again. ${message}`));

    // --- buffers and commands

    function bufferOf(use, data) {
        const made = gpu.createBuffer({size: Math.max(16, data.byteLength), usage: use, mappedAtCreation: true});
        new Uint8Array(made.getMappedRange()).set(new Uint8Array(data.buffer, data.byteOffset, data.byteLength));
        made.unmap();
        return made;
    }
    let encoder = null;
    const commands = () => encoder ||= gpu.createCommandEncoder();
    function submit() {
        if (encoder) queue.submit([encoder.finish()]);
        encoder = null;
    }

    // --- the flow. Group 0 holds its arrays.

    const functions = textOf("functions-wgsl"), shared = textOf("shared-wgsl"), flat = look.dimension == 2;
    // Places have three components here, and tracks two, also in the plane.
    const adapters = `
const kEvaluations = ${look.tracks ? 3 : 2};
fn flowAt(x: vec3f) -> Flow {
    let h = flowHere(${flat ? "x.xy" : "x"});
    return ${flat ? "Flow(vec4f(x, h.r0), vec4f(h.r3, h.r4, 0.0, 0.0), vec4f(h.r1, h.r2, 0.0, 0.0), vec4f())"
                  : "Flow(vec4f(x, h.r0), vec4f(h.r8, h.r9, h.r10, h.r1), vec4f(h.r2, h.r3, h.r4, 0.0), vec4f(h.r5, h.r6, h.r7, 0.0))"};
}
fn wallAt(x: vec3f) -> vec4f {
    return ${!look.side ? "vec4f()" : flat ? "vec4f(flowWall(x.xy), 0.0)" : "flowWall(x)"};
}
fn corrected(f: Flow, off: vec2f, limit: f32) -> vec3f {
    return ${!look.tracks ? "f.a.xyz" : flat ? "vec3f(flowCorrected(f.a.xy, off.x, f.c.xy, limit), 0.0)"
                                             : "flowCorrected(f.a.xyz, off, f.c.xyz, f.d.xyz, limit)"};
}
fn accepts(p: vec3f, q: vec3f, off: vec2f, before: vec4f, between: vec3f, after: vec4f) -> f32 {
    return ${flat ? "flowAccepts(p.xy, q.xy, off.x, before.xyz, between, after.xyz)"
                  : "flowAccepts(p, q, off, before, between, after)"};
}
`;
    const arrays = (await arraysOf(1)).map(words => ["read-only-storage", bufferOf(usage.STORAGE, words)]);
    if (functions.includes("var<uniform> flowZero")) arrays.push(["uniform", bufferOf(usage.UNIFORM, new Uint32Array(1))]);
    const groupOf = (layout, buffers) =>
        gpu.createBindGroup({layout, entries: buffers.map((buffer, binding) => ({binding, resource: {buffer}}))});
    const layoutOf = (visibility, types) => gpu.createBindGroupLayout(
        {entries: types.map((type, binding) => ({binding, visibility, buffer: {type}}))});
    const {COMPUTE, VERTEX, FRAGMENT} = GPUShaderStage;
    const arrayLayout = layoutOf(COMPUTE | FRAGMENT, arrays.map(([type]) => type));
    const arrayGroup = groupOf(arrayLayout, arrays.map(([, buffer]) => buffer));
    const stepLayout = layoutOf(COMPUTE, ["storage", "uniform"]);
    const layoutWith = layout => gpu.createPipelineLayout({bindGroupLayouts: [arrayLayout, layout]});
    const stepModule = gpu.createShaderModule({code: functions + shared + textOf("steps-wgsl") + adapters});
    const [start, move] = await Promise.all(["start", "advance"].map(entryPoint =>
        gpu.createComputePipelineAsync({layout: layoutWith(stepLayout), compute: {module: stepModule, entryPoint}})));

    function dispatch(pipeline, states, dt) {
        states.groups ||= new Map();
        if (!states.groups.has(dt)) {
            const request = new ArrayBuffer(8);
            new Float32Array(request)[0] = dt;
            new Uint32Array(request)[1] = states.count;
            states.groups.set(dt, groupOf(stepLayout, [states.made, bufferOf(usage.UNIFORM, new Uint8Array(request))]));
        }
        const pass = commands().beginComputePass();
        pass.setPipeline(pipeline);
        pass.setBindGroup(0, arrayGroup);
        pass.setBindGroup(1, states.groups.get(dt));
        pass.dispatchWorkgroups(Math.ceil(states.count / 64));
        pass.end();
    }

    const kStates = usage.STORAGE | usage.VERTEX | usage.COPY_SRC | usage.COPY_DST;
    const statesOf = count => ({count, made: gpu.createBuffer({size: kState * count, usage: kStates})});

    function statesAt(places, count) {
        const numbers = new Float32Array(kNumbers * count);
        for (let k = 0; k < count; ++k) numbers.set(places.subarray(4 * k, 4 * k + 4), kNumbers * k);
        const states = {count, made: bufferOf(kStates, numbers)};
        dispatch(start, states, 0);
        return states;
    }

    async function contentOf(states) {
        const size = kState * states.count, copied = gpu.createBuffer({size, usage: usage.COPY_DST | usage.MAP_READ});
        commands().copyBufferToBuffer(states.made, 0, copied, 0, size);
        submit();
        await copied.mapAsync(GPUMapMode.READ);
        const numbers = new Float32Array(copied.getMappedRange().slice(0));
        copied.destroy();
        return numbers;
    }

    function free(...all) {
        submit();
        for (const {made} of all) made.destroy();
    }

    // --- drawing. Group 1 holds the frame.

    const kFrame = 40; // numbers
    const format = navigator.gpu.getPreferredCanvasFormat(), frameBuffer = bufferOf(usage.UNIFORM | usage.COPY_DST, new Float32Array(kFrame));
    const frameLayout = layoutOf(VERTEX | FRAGMENT, ["uniform"]), frameGroup = groupOf(frameLayout, [frameBuffer]);
    const drawText = shared + textOf("drawing-wgsl");
    const drawModule = gpu.createShaderModule({code: drawText});
    const fields = (stepMode, ...numbers) => ({arrayStride: kState, stepMode, attributes: numbers.map(
        (n, shaderLocation) => ({format: "float32x4", offset: 16 * n, shaderLocation}))});
    function pipelineOf(name, topology, buffers, more = {}) {
        const {module = drawModule, layer, cullMode = "none"} = more;
        const part = {operation: "add", srcFactor: "one", dstFactor: "one"}, solid = layer === 0 || layer === 1;
        return gpu.createRenderPipelineAsync({
            layout: layoutWith(frameLayout),
            vertex: {module, entryPoint: name + "Vertex", buffers},
            fragment: {module, entryPoint: name + "Fragment", constants: layer === undefined ? {} : {layer},
                       targets: [{format, ...(solid ? {} : {blend: {color: part, alpha: part}})}]},
            primitive: {topology, cullMode},
            depthStencil: {format: "depth24plus", depthWriteEnabled: solid, depthCompare: flat ? "always" : "less"},
            multisample: {count: kSamples},
        });
    }
    const drawing = {
        particles: await pipelineOf("particle", "triangle-strip", [fields("instance", 0, 1)]),
        lines: await pipelineOf("line", "line-list", [fields("vertex", 0, 1)]),
        box: await pipelineOf("box", "line-list", []),
    };
    if (look.triangles > 0) {
        const cull = ["none", "front", "back"]; // by layer
        drawing.walls = await Promise.all(cull.map((cullMode, layer) =>
            pipelineOf("wall", "triangle-list", [fields("vertex", 0, 4)], {layer, cullMode})));
    }
    if (look.side && flat) {
        const module = gpu.createShaderModule({code: functions + drawText + textOf("plane-wgsl")});
        drawing.plane = await pipelineOf("plane", "triangle-strip", [], {module});
    }
    const context = canvas.getContext("webgpu");
    if (!context) return null;
    context.configure({device: gpu, format, alphaMode: "opaque"});
    let targets, surface, lines;

    function targetsOf(width, height) {
        if (targets?.width == width && targets.height == height) return targets;
        targets?.colour.destroy();
        targets?.depth.destroy();
        const made = format => gpu.createTexture(
            {size: [width, height], format, sampleCount: kSamples, usage: GPUTextureUsage.RENDER_ATTACHMENT});
        return targets = {width, height, colour: made(format), depth: made("depth24plus")};
    }

    /// A pass that draws; the first one of a frame clears the picture, the last one shows it.
    function passOf(first, clearDepth) {
        const {colour, depth} = targetsOf(canvas.width, canvas.height);
        const pass = commands().beginRenderPass({
            colorAttachments: [{view: colour.createView(), clearValue: [...kBackground, 1], loadOp: first ? "clear" : "load",
                                storeOp: first ? "store" : "discard",
                                ...(first ? {} : {resolveTarget: context.getCurrentTexture().createView()})}],
            depthStencilAttachment: {view: depth.createView(), depthClearValue: 1, depthLoadOp: clearDepth ? "clear" : "load",
                                     depthStoreOp: first ? "store" : "discard"},
        });
        pass.setBindGroup(0, arrayGroup);
        pass.setBindGroup(1, frameGroup);
        return pass;
    }

    function drawIndexed(pass, pipeline, {states, indices, count}) {
        pass.setPipeline(pipeline);
        pass.setVertexBuffer(0, states.made);
        pass.setIndexBuffer(indices, "uint32");
        pass.drawIndexed(count);
    }

    function draw(frame) {
        const {glass, shown, states} = frame, numbers = new Float32Array(kFrame);
        numbers.set(frame.view);
        numbers.set([...frame.lower, frame.rms, ...frame.upper, frame.size, ...frame.eye, frame.moment, ...frame.potentials, frame.count,
                     frame.colours, lines?.across ?? 1, lines?.along ?? 1, frame.side ?? 0, canvas.width, canvas.height], 16);
        submit();
        queue.writeBuffer(frameBuffer, 0, numbers);
        const wall = surface && shown.wall;
        let pass = passOf(true, true);
        if (wall) drawIndexed(pass, drawing.walls[glass ? 1 : 0], surface);
        pass.end();
        pass = passOf(false, glass); // behind glass, nothing is hidden
        if (drawing.plane && shown.wall) {
            pass.setPipeline(drawing.plane);
            pass.draw(4);
        } else if (!look.side && shown.wall) {
            pass.setPipeline(drawing.box);
            pass.draw(24);
        }
        if (lines && shown.lines) drawIndexed(pass, drawing.lines, lines);
        pass.setPipeline(drawing.particles);
        pass.setVertexBuffer(0, states.made);
        pass.draw(4, states.count);
        if (wall && glass) drawIndexed(pass, drawing.walls[2], surface);
        pass.end();
        submit();
    }

    const indicesOf = words => bufferOf(usage.INDEX, words);
    return {
        name: "WebGPU", statesOf, statesAt, contentOf, free, draw,
        step(states, dt) { dispatch(move, states, dt); },
        copy(from, begin, to, at, count) {
            if (count > 0) commands().copyBufferToBuffer(from.made, kState * begin, to.made, kState * at, kState * count);
        },
        async distancesAt(places, count) {
            const states = statesAt(places, count), numbers = await contentOf(states);
            free(states);
            return numbers.filter((_, k) => k % kNumbers == 16);
        },
        showSurface(places, corners) {
            surface = {states: statesAt(places, places.length / 4), indices: indicesOf(corners), count: corners.length};
        },
        showLines(states, across, along, pairs) {
            lines = {states, across, along, indices: indicesOf(pairs), count: pairs.length};
        },
        failure() { return failure; },
    };
}
</script>
)html";

} // namespace curlew
