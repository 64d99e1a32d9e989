// SPDX-License-Identifier: Apache-2.0
#include "PageText.h"

namespace curlew {

// `look` holds the figures of the flow (FlowPage.cpp).
constexpr std::string_view kPageParticles = R"html(<script>
"use strict";
const kSteps = 600;       // of a loop, 60 each second
const kFew = 2048;
const kKeys = 8;          // states of a loop that are kept for jumps
const kFields = ["a", "b", "c", "d", "wall", "clock"]; // of a state, a vec4 each
const kFlow = ["a", "b", "c", "d"];
const canvas = document.getElementById("view");
const gl = canvas.getContext("webgl2", {antialias: true, powerPreference: "high-performance"});
const textOf = id => document.getElementById(id).textContent;

// --- data

async function wordsOf(id, count) {
    const bytes = Uint8Array.from(atob(textOf(id)), c => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    const planes = new Uint8Array(await new Response(stream).arrayBuffer());
    const words = new Uint32Array(count);
    for (let k = 0, last = 0; k < count; ++k) { // differences, the sign in the lowest bit, a plane for each byte
        const z = planes[k] | planes[k + count] << 8 | planes[k + 2 * count] << 16 | planes[k + 3 * count] << 24;
        words[k] = last = last + ((z >>> 1) ^ -(z & 1));
    }
    return words;
}

function texture(unit, words, data) {
    const rows = Math.ceil(words.length / 2048), padded = new Uint32Array(rows * 2048);
    padded.set(words);
    const reals = new Float32Array(padded.buffer);
    if (data.step > 0)
        for (let k = 0; k < words.length; ++k) reals[k] = data.lower + data.step * words[k];
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    if (data.type == "uint")
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32UI, 2048, rows, 0, gl.RED_INTEGER, gl.UNSIGNED_INT, padded);
    else
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, 2048, rows, 0, gl.RED, gl.FLOAT, reals);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
}

// --- programs and buffers

const kHead = `#version 300 es
precision highp float;
precision highp int;
#define DIM ${look.dimension}
#define TRACKS ${look.tracks ? 1 : 0}
`;

/// A program; `outputs` are captured, `fragment` draws. Functions of the flow that it does not call cost nothing.
function programOf(vertex, fragment, outputs) {
    const made = gl.createProgram();
    const add = (type, text) => {
        const shader = gl.createShader(type);
        gl.shaderSource(shader, kHead + text);
        gl.compileShader(shader);
        if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
        gl.attachShader(made, shader);
    };
    add(gl.VERTEX_SHADER, vertex);
    add(gl.FRAGMENT_SHADER, fragment || "out vec4 pixel;\nvoid main() { pixel = vec4(0.0); }");
    if (outputs) gl.transformFeedbackVaryings(made, outputs, gl.INTERLEAVED_ATTRIBS);
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    const attributes = {}, uniforms = {};
    for (let k = 0; k < gl.getProgramParameter(made, gl.ACTIVE_ATTRIBUTES); ++k) {
        const name = gl.getActiveAttrib(made, k).name;
        if (!name.startsWith("gl_")) attributes[name] = gl.getAttribLocation(made, name);
    }
    for (let k = 0; k < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); ++k) {
        const {name, type} = gl.getActiveUniform(made, k);
        uniforms[name] = {at: gl.getUniformLocation(made, name), type};
    }
    gl.useProgram(made);
    look.buffers.forEach((buffer, unit) => { if (uniforms[buffer.name]) gl.uniform1i(uniforms[buffer.name].at, unit); });
    return {made, attributes, uniforms};
}

function set(program, values) {
    for (const [name, value] of Object.entries(values)) {
        const uniform = program.uniforms[name];
        if (!uniform) continue;
        if (uniform.type == gl.FLOAT) gl.uniform1f(uniform.at, value);
        else if (uniform.type == gl.FLOAT_VEC2) gl.uniform2fv(uniform.at, value);
        else if (uniform.type == gl.FLOAT_VEC3) gl.uniform3fv(uniform.at, value);
        else if (uniform.type == gl.FLOAT_MAT4) gl.uniformMatrix4fv(uniform.at, false, value);
        else gl.uniform1i(uniform.at, value);
    }
}

/// A buffer of `count` records of vec4s with these names; `data` is a Float32Array or null.
function bufferOf(names, count, data) {
    const made = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, made);
    gl.bufferData(gl.ARRAY_BUFFER, data || 16 * names.length * count, gl.DYNAMIC_COPY);
    return {made, names, count, bytes: 16 * names.length * count};
}

/// Binds attributes of the current program: {attribute: [buffer, field]}.
function bindInputs(program, inputs) {
    for (const [name, at] of Object.entries(program.attributes)) {
        if (!inputs[name]) {
            gl.disableVertexAttribArray(at);
            gl.vertexAttrib4f(at, 0, 0, 0, 0);
            continue;
        }
        const [buffer, field] = inputs[name];
        gl.bindBuffer(gl.ARRAY_BUFFER, buffer.made);
        gl.enableVertexAttribArray(at);
        gl.vertexAttribPointer(at, 4, gl.FLOAT, false, 16 * buffer.names.length, 16 * buffer.names.indexOf(field));
    }
}
/// A buffer cannot capture results while an attribute, even a disabled one, refers to it. So they refer to another.
let nothing;
function unbindInputs(program) {
    nothing ||= gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, nothing);
    for (const at of Object.values(program.attributes)) {
        gl.disableVertexAttribArray(at);
        gl.vertexAttribPointer(at, 4, gl.FLOAT, false, 0, 0);
    }
}
const fieldsOf = (buffer, names) => Object.fromEntries(names.map(name => [name, [buffer, name]]));

/// Runs a program once for each record and captures its results.
function run(program, inputs, values, to, count) {
    gl.useProgram(program.made);
    set(program, values);
    bindInputs(program, inputs);
    gl.bindBuffer(gl.ARRAY_BUFFER, null); // it may be the one that captures
    gl.enable(gl.RASTERIZER_DISCARD);
    gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, to.made);
    gl.beginTransformFeedback(gl.POINTS);
    gl.drawArrays(gl.POINTS, 0, count);
    gl.endTransformFeedback();
    gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, null);
    gl.disable(gl.RASTERIZER_DISCARD);
    unbindInputs(program);
}

function copy(from, fromByte, to, toByte, bytes) {
    if (bytes == 0) return;
    gl.bindBuffer(gl.COPY_READ_BUFFER, from.made);
    gl.bindBuffer(gl.COPY_WRITE_BUFFER, to.made);
    gl.copyBufferSubData(gl.COPY_READ_BUFFER, gl.COPY_WRITE_BUFFER, fromByte, toByte, bytes);
    gl.bindBuffer(gl.COPY_READ_BUFFER, null);
    gl.bindBuffer(gl.COPY_WRITE_BUFFER, null);
}

/// The records of a buffer. Waits for the GPU.
function contentOf(buffer, count) {
    const numbers = new Float32Array(4 * buffer.names.length * count);
    gl.bindBuffer(gl.COPY_READ_BUFFER, buffer.made);
    gl.getBufferSubData(gl.COPY_READ_BUFFER, 0, numbers);
    gl.bindBuffer(gl.COPY_READ_BUFFER, null);
    return numbers;
}
const free = (...buffers) => buffers.forEach(buffer => gl.deleteBuffer(buffer.made));

// --- the flow

let flowProgram, wallProgram, acceptProgram;

function makePrograms() {
    const functions = textOf("functions") + textOf("common");
    flowProgram = programOf(functions + textOf("flow"), null, ["a1", "b1", "c1", "d1"]);
    acceptProgram = programOf(functions + textOf("accept"), null, ["a1", "b1", "c1", "d1", "wall1", "clock1"]);
    if (look.side) wallProgram = programOf(functions + textOf("distance"), null, ["wall"]);
}

/// The wall at places: distance and gradient.
function wallAt(places, field, count) {
    const walls = bufferOf(["wall"], count, null);
    if (wallProgram) run(wallProgram, {a: [places, field]}, {part: 1}, walls, count);
    return walls;
}

/// A repeatable sequence of numbers from 0 to 1.
function randomOf(seed) {
    return () => {
        seed = seed + 0x6d2b79f5 | 0;
        let t = Math.imul(seed ^ seed >>> 15, 1 | seed);
        t = t + Math.imul(t ^ t >>> 7, 61 | t) ^ t;
        return ((t ^ t >>> 14) >>> 0) / 4294967296;
    };
}
const isAllowed = distance => ({"": -1, inside: distance, outside: -distance, both: -Math.abs(distance)})[look.side] < -1e-4 * look.size;

/// Random places where the flow is allowed, as vec4s.
function placesOf(count) {
    const random = randomOf(1), places = new Float32Array(4 * count), kTries = 8192;
    for (let found = 0, round = 0; found < count; ++round) {
        if (round > 16 * count / kTries + 64) throw new Error("there is no room for particles in the box of the flow");
        const tries = new Float32Array(4 * kTries);
        for (let k = 0; k < kTries; ++k)
            for (let axis = 0; axis < look.dimension; ++axis)
                tries[4 * k + axis] = look.lower[axis] + random() * (look.upper[axis] - look.lower[axis]);
        const buffer = bufferOf(["a"], kTries, tries), walls = wallAt(buffer, "a", kTries);
        const distances = contentOf(walls, kTries);
        for (let k = 0; k < kTries && found < count; ++k)
            if (isAllowed(distances[4 * k])) places.set(tries.subarray(4 * k, 4 * k + 4), 4 * found++);
        free(buffer, walls);
    }
    return places;
}

/// Particles at these places, and the buffers for their steps.
class Particles {
    constructor(places, count) {
        this.count = count;
        const from = bufferOf(["a"], count, places.subarray(0, 4 * count));
        this.flows = [0, 1].map(() => bufferOf(kFlow, count, null));
        this.walls = [0, 1, 2, 3].map(() => bufferOf(["wall"], count, null));
        run(flowProgram, {start: [from, "a"]}, {dt: 0, part: 0, correct: 0}, this.flows[0], count);
        const walls = wallAt(from, "a", count);
        const flow = contentOf(this.flows[0], count), wall = contentOf(walls, count), state = new Float32Array(24 * count);
        for (let k = 0; k < count; ++k) {
            state.set(flow.subarray(16 * k, 16 * k + 16), 24 * k);
            state.set(wall.subarray(4 * k, 4 * k + 4), 24 * k + 16);
            state.set([1, 1, flow[16 * k + 3], flow[16 * k + 7]], 24 * k + 20);
        }
        free(from, walls);
        this.start = bufferOf(kFields, count, state);
        this.states = [state, null].map(data => bufferOf(kFields, count, data));
        this.at = this.time = 0; // steps
    }
    get state() { return this.states[0]; }

    /// One step of the midpoint method and a correction back onto the track, for all particles.
    step(dt) {
        const {state, flows, walls, count} = this, particle = {start: [state, "a"], clock: [state, "clock"]};
        const flow = (from, to, part, correct) =>
            run(flowProgram, {...particle, ...fieldsOf(from, kFlow)}, {dt, part, correct: correct ? 1 : 0}, to, count);
        flow(state, flows[0], 0.5, false);
        flow(flows[0], flows[1], 1, false);
        if (look.tracks) {
            flow(flows[1], flows[0], 0, true);
            flows.reverse();
        }
        const end = flows[1];
        if (wallProgram)
            walls.forEach((wall, k) =>
                run(wallProgram, {start: [state, "a"], a: [end, "a"]}, {part: 0.25 * (k + 1)}, wall, count));
        const old = {start: "a", startB: "b", startC: "c", startD: "d", startWall: "wall", clock: "clock"};
        for (const name in old) old[name] = [state, old[name]];
        const between = {quarter: [walls[0], "wall"], half_: [walls[1], "wall"], threeQuarters: [walls[2], "wall"]};
        run(acceptProgram, {...old, ...between, ...fieldsOf(end, kFlow), wall: [walls[3], "wall"]}, {}, this.states[1], count);
        this.states.reverse();
        ++this.time;
    }

    free() { free(this.start, ...this.states, ...this.flows, ...this.walls); }
}

/// Particles in a loop. Each starts again once in it, in the order of their numbers, so the loop has no seam after the
/// first round.
class Loop {
    constructor(places, count) {
        this.particles = new Particles(places, count);
        this.dt = look.duration / kSteps;
        this.step = 0;
        this.target = null; // of a jump
        this.keys = new Map();
        this.keep();
    }
    keep() {
        const {state} = this.particles;
        const key = this.keys.get(this.step) || bufferOf(kFields, this.particles.count, null);
        copy(state, 0, key, 0, state.bytes);
        this.keys.set(this.step, key);
    }
    advance() {
        const {particles} = this, {count} = particles, record = particles.state.bytes / count;
        particles.step(this.dt);
        const [begin, end] = [0, 1].map(k => Math.ceil((this.step + k) * count / kSteps));
        copy(particles.start, begin * record, particles.state, begin * record, (end - begin) * record);
        this.step = (this.step + 1) % kSteps;
        if (this.step % (kSteps / kKeys) == 0) this.keep();
    }
    /// Goes to a step of the loop, from the last state that is kept before it; continue() takes the steps between.
    jump(step) {
        const key = Math.max(...[...this.keys.keys()].filter(k => k <= step));
        if (step < this.step || key > this.step) {
            copy(this.keys.get(key), 0, this.particles.state, 0, this.particles.state.bytes);
            this.step = key;
        }
        this.target = step == this.step ? null : step;
    }
    continue(most) {
        for (let k = 0; k < most && this.target !== null; ++k) {
            this.advance();
            if (this.step == this.target) this.target = null;
        }
    }
    free() {
        this.particles.free();
        free(...this.keys.values());
    }
}

/// Streamlines from the first places: the states of particles after each step, one after the other.
function streamlinesOf(places, across, along) {
    const particles = new Particles(places, across), {state} = particles;
    const lines = bufferOf(kFields, across * along, null), dt = look.duration / 200;
    for (let k = 0; k < along; ++k) {
        copy(particles.state, 0, lines, k * state.bytes, state.bytes);
        if (k + 1 < along) particles.step(dt);
    }
    particles.free();
    const pairs = new Uint32Array(2 * across * (along - 1));
    for (let k = 0, n = 0; k + 1 < along; ++k)
        for (let line = 0; line < across; ++line, n += 2) {
            pairs[n] = k * across + line;
            pairs[n + 1] = pairs[n] + across;
        }
    return {lines, across, along, pairs};
}

/// The milliseconds that a step of so many particles takes.
function timeOf(places, count) {
    const particles = new Particles(places, count);
    particles.step(look.duration / kSteps);
    contentOf(particles.state, 1);
    const begin = performance.now();
    particles.step(look.duration / kSteps);
    contentOf(particles.state, 1);
    particles.free();
    return performance.now() - begin;
}

/// As many particles as move in 6 milliseconds, 4,000 to 100,000; or those of the address, #particles=N.
function affordable(few) {
    const given = /[#&]particles=(\d+)/.exec(location.hash);
    if (given) return Math.min(Math.max(Number(given[1]), 1), 1000000);
    const places = new Float32Array(4 * 16 * kFew);
    for (let k = 0; k < 16; ++k) places.set(few, 4 * k * kFew);
    let count = kFew, time = timeOf(places, count);
    while (time < 3 && count < 16 * kFew) time = timeOf(places, count *= 4);
    return Math.round(Math.min(Math.max(count * 6 / time, 4000), 100000));
}
</script>
)html";

} // namespace curlew
