// SPDX-License-Identifier: Apache-2.0
#include "PageText.h"

namespace curlew {

// A step takes several passes, because programs with one call of the flow and no loop compile everywhere.
constexpr std::string_view kPageWebGl = R"html(<script>
"use strict";
/// A promise of a device that uses WebGL 2; null if there is none.
async function webGl() {
    const gl = canvas.getContext("webgl2", {antialias: true, powerPreference: "high-performance"});
    if (!gl) return null;
    const kFields = ["a", "b", "c", "d", "wall", "clock"]; // of a state, a vec4 each
    const kFlow = ["a", "b", "c", "d"];
    const kHead = `#version 300 es
precision highp float;
precision highp int;
#define DIM ${look.dimension}
#define TRACKS ${look.tracks ? 1 : 0}
`;
    canvas.addEventListener("webglcontextlost", () => showMessage("The graphics device was lost; load the page again."));

    const kTextureWidth = 2048;
    function texture(unit, {type}, words) {
        gl.activeTexture(gl.TEXTURE0 + unit);
        gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
        const image = (format, size, channels, kind, numbers) => gl.texImage2D(
            gl.TEXTURE_2D, 0, format, kTextureWidth, words.length / (kTextureWidth * size), 0, channels, kind, numbers);
        if (type == "uint")
            image(gl.R32UI, 1, gl.RED_INTEGER, gl.UNSIGNED_INT, words);
        else if (type == "float")
            image(gl.R32F, 1, gl.RED, gl.FLOAT, new Float32Array(words.buffer));
        else
            image(gl.RGBA32F, 4, gl.RGBA, gl.FLOAT, new Float32Array(words.buffer));
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    }

    // --- programs and buffers

    /// A program; `outputs` are captured, `fragment` draws. Functions of the flow that it does not call cost nothing.
    function programOf(vertex, fragment, outputs) {
        const made = gl.createProgram();
        const add = (type, text) => {
            const shader = gl.createShader(type);
            gl.shaderSource(shader, kHead + textOf("shared") + text);
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
        return {made, names, count};
    }
    function indicesOf(data) {
        const made = gl.createBuffer();
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, made);
        gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, data, gl.STATIC_DRAW);
        return {made, count: data.length};
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
    const nothing = gl.createBuffer();
    function unbindInputs(program) {
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

    function copy(from, begin, to, at, count) {
        if (count == 0) return;
        const record = 16 * from.names.length;
        gl.bindBuffer(gl.COPY_READ_BUFFER, from.made);
        gl.bindBuffer(gl.COPY_WRITE_BUFFER, to.made);
        gl.copyBufferSubData(gl.COPY_READ_BUFFER, gl.COPY_WRITE_BUFFER, begin * record, at * record, count * record);
        gl.bindBuffer(gl.COPY_READ_BUFFER, null);
        gl.bindBuffer(gl.COPY_WRITE_BUFFER, null);
    }

    /// The records of a buffer. Waits for the GPU.
    function numbersOf(buffer) {
        const numbers = new Float32Array(4 * buffer.names.length * buffer.count);
        gl.bindBuffer(gl.COPY_READ_BUFFER, buffer.made);
        gl.getBufferSubData(gl.COPY_READ_BUFFER, 0, numbers);
        gl.bindBuffer(gl.COPY_READ_BUFFER, null);
        return numbers;
    }
    const deleteAll = buffers => buffers.forEach(buffer => gl.deleteBuffer(buffer.made));

    // --- the flow

    (await arraysOf(4 * kTextureWidth)).forEach((words, unit) => texture(unit, look.buffers[unit], words));
    const functions = textOf("functions") + textOf("common");
    const flowProgram = programOf(functions + textOf("flow"), null, ["a1", "b1", "c1", "d1"]);
    const acceptProgram = programOf(functions + textOf("accept"), null, ["a1", "b1", "c1", "d1", "wall1", "clock1"]);
    const wallProgram = look.side && programOf(functions + textOf("distance"), null, ["wall"]);

    /// The wall at places: distance and gradient.
    function wallAt(places, count) {
        const walls = bufferOf(["wall"], count, null);
        if (wallProgram) run(wallProgram, {a: [places, "a"]}, {part: 1}, walls, count);
        return walls;
    }

    const statesOf = count => bufferOf(kFields, count, null);

    function statesAt(places, count) {
        const from = bufferOf(["a"], count, places.subarray(0, 4 * count)), flows = bufferOf(kFlow, count, null);
        run(flowProgram, {start: [from, "a"]}, {dt: 0, part: 0, correct: 0}, flows, count);
        const walls = wallAt(from, count), flow = numbersOf(flows), wall = numbersOf(walls);
        const numbers = new Float32Array(kNumbers * count);
        for (let k = 0; k < count; ++k) {
            numbers.set(flow.subarray(16 * k, 16 * k + 16), 24 * k);
            numbers.set(wall.subarray(4 * k, 4 * k + 4), 24 * k + 16);
            numbers.set([1, 1, flow[16 * k + 3], flow[16 * k + 7]], 24 * k + 20);
        }
        deleteAll([from, flows, walls]);
        return bufferOf(kFields, count, numbers);
    }

    function step(states, dt) {
        const {count} = states;
        states.work ||= {flows: [0, 1].map(() => bufferOf(kFlow, count, null)),
                         walls: [0, 1, 2, 3].map(() => bufferOf(["wall"], count, null)), next: statesOf(count)};
        const {flows, walls, next} = states.work, particle = {start: [states, "a"], clock: [states, "clock"]};
        const flow = (from, to, part, correct) =>
            run(flowProgram, {...particle, ...fieldsOf(from, kFlow)}, {dt, part, correct: correct ? 1 : 0}, to, count);
        flow(states, flows[0], 0.5, false);
        flow(flows[0], flows[1], 1, false);
        if (look.tracks) {
            flow(flows[1], flows[0], 0, true);
            flows.reverse();
        }
        const end = flows[1];
        if (wallProgram)
            walls.forEach((wall, k) =>
                run(wallProgram, {start: [states, "a"], a: [end, "a"]}, {part: 0.25 * (k + 1)}, wall, count));
        const old = {start: "a", startB: "b", startC: "c", startD: "d", startWall: "wall", clock: "clock"};
        for (const name in old) old[name] = [states, old[name]];
        const between = {quarter: [walls[0], "wall"], half_: [walls[1], "wall"], threeQuarters: [walls[2], "wall"]};
        run(acceptProgram, {...old, ...between, ...fieldsOf(end, kFlow), wall: [walls[3], "wall"]}, {}, next, count);
        [states.made, next.made] = [next.made, states.made];
    }

    // --- drawing

    const palette = textOf("palette"), drawing = {};
    const both = (name, before) => programOf(before + textOf(name + "-vertex"), textOf(name + "-fragment"));
    drawing.particles = both("particles", palette);
    drawing.lines = both("lines", palette);
    drawing.box = both("box", "");
    if (look.triangles > 0) drawing.wall = both("wall", "");
    if (look.side && look.dimension == 2)
        drawing.plane = programOf(textOf("plane-vertex"), textOf("functions") + textOf("plane-fragment"));
    let surface, lines;

    function use(program, inputs, values) {
        gl.useProgram(program.made);
        set(program, values);
        bindInputs(program, inputs);
    }

    function drawWall(frame, layer) {
        use(drawing.wall, {a: [surface.points, "a"], wall: [surface.walls, "wall"]}, {...frame, layer});
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, surface.corners.made);
        if (layer) gl.enable(gl.CULL_FACE);
        gl.cullFace(layer == 1 ? gl.FRONT : gl.BACK);
        gl.drawElements(gl.TRIANGLES, surface.corners.count, gl.UNSIGNED_INT, 0);
        gl.disable(gl.CULL_FACE);
        unbindInputs(drawing.wall);
    }

    function draw(frame) {
        const {glass, shown, states} = frame;
        gl.viewport(0, 0, canvas.width, canvas.height);
        gl.clearColor(...kBackground, 1);
        gl.depthMask(true);
        gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
        gl.disable(gl.BLEND);
        if (look.dimension == 3) gl.enable(gl.DEPTH_TEST);
        if (surface && shown.wall) drawWall(frame, glass ? 1 : 0);
        if (glass) gl.clear(gl.DEPTH_BUFFER_BIT); // its far sides hide nothing
        gl.depthMask(false);
        gl.enable(gl.BLEND);
        gl.blendFunc(gl.ONE, gl.ONE);
        if (drawing.plane && shown.wall) {
            use(drawing.plane, {}, frame);
            gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
        } else if (!look.side && shown.wall) {
            use(drawing.box, {}, frame);
            gl.drawArrays(gl.LINES, 0, 24);
        }
        if (lines && shown.lines) {
            use(drawing.lines, fieldsOf(lines.states, ["a", "b"]), {...frame, across: lines.across, along: lines.along});
            gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, lines.pairs.made);
            gl.drawElements(gl.LINES, lines.pairs.count, gl.UNSIGNED_INT, 0);
            unbindInputs(drawing.lines);
        }
        use(drawing.particles, fieldsOf(states, ["a", "b"]), frame);
        gl.drawArrays(gl.POINTS, 0, states.count);
        unbindInputs(drawing.particles);
        if (surface && shown.wall && glass) drawWall(frame, 2);
    }

    return {
        name: "WebGL 2", statesOf, statesAt, step, copy, draw,
        async contentOf(states) { return numbersOf(states); },
        async distancesAt(places, count) {
            const from = bufferOf(["a"], count, places), walls = wallAt(from, count), numbers = numbersOf(walls);
            deleteAll([from, walls]);
            return numbers.filter((_, k) => k % 4 == 0);
        },
        free(...all) {
            for (const {made, work} of all)
                deleteAll([{made}, ...(work ? [...work.flows, ...work.walls, work.next] : [])]);
        },
        showSurface(places, corners) {
            const points = bufferOf(["a"], places.length / 4, places);
            surface = {points, walls: wallAt(points, points.count), corners: indicesOf(corners)};
        },
        showLines(states, across, along, pairs) { lines = {states, across, along, pairs: indicesOf(pairs)}; },
        failure() {
            const error = gl.getError();
            return error ? `WebGL error ${error}` : "";
        },
    };
}
</script>
)html";

} // namespace curlew
