// SPDX-License-Identifier: Apache-2.0
#include "PageText.h"

namespace curlew {

constexpr std::string_view kPageView = R"html(<script>
"use strict";
// --- the camera: it turns about the middle of the view

const camera = {turn: look.dimension == 3 ? 0.7 : 0, rise: look.dimension == 3 ? 0.3 : 0, zoom: 1, idle: true};
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/// Column-major; lens: the tangent of half the smaller angle. The bar covers a part of the height, the title another.
function viewOf(width, height) {
    const bar = (element("bar").offsetHeight + 14) / height, title = 56 / height, aspect = width / height;
    const [ct, st, cr, sr] = [Math.cos(camera.turn), Math.sin(camera.turn), Math.cos(camera.rise), Math.sin(camera.rise)];
    const right = [ct, 0, -st], up = [-st * sr, cr, -ct * sr], back = [st * cr, sr, ct * cr];
    const lens = 0.36, distance = 0.5 * look.span / (lens * camera.zoom);
    const eye = look.middle.map((x, k) => x + distance * back[k]);
    const sx = aspect > 1 ? (1 - bar - title) / (lens * aspect) : 1.15 / lens, sy = sx * aspect;
    const near = 0.02 * distance, far = distance + 4 * look.span, deep = -(far + near) / (far - near);
    const rows = [right.map(x => x * sx), up.map(x => x * sy), back.map(x => x * deep), back.map(x => -x)];
    const matrix = new Float32Array(16);
    rows.forEach((row, r) => {
        for (let k = 0; k < 3; ++k) matrix[4 * k + r] = row[k];
        matrix[12 + r] = -dot(row, eye);
    });
    for (let k = 0; k < 4; ++k) matrix[4 * k + 1] += (bar - title) * matrix[4 * k + 3];
    matrix[14] -= 2 * far * near / (far - near);
    return {matrix, eye, height: sy / 2};
}

function followPointers() {
    const down = new Map();
    const spread = () => {
        const [a, b] = [...down.values()];
        return Math.hypot(a[0] - b[0], a[1] - b[1]);
    };
    const zoomBy = factor => camera.zoom = Math.min(Math.max(camera.zoom * factor, 0.2), 20);
    canvas.addEventListener("pointerdown", e => {
        canvas.setPointerCapture(e.pointerId);
        down.set(e.pointerId, [e.clientX, e.clientY]);
        camera.idle = false;
    });
    canvas.addEventListener("pointermove", e => {
        const last = down.get(e.pointerId);
        if (!last) return;
        const before = down.size == 2 ? spread() : 0;
        down.set(e.pointerId, [e.clientX, e.clientY]);
        if (down.size == 2) return zoomBy(spread() / Math.max(before, 1));
        camera.turn -= 0.008 * (e.clientX - last[0]);
        camera.rise = Math.min(Math.max(camera.rise + 0.008 * (e.clientY - last[1]), -1.5), 1.5);
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, e => down.delete(e.pointerId));
    canvas.addEventListener("wheel", e => {
        e.preventDefault();
        zoomBy(Math.exp(-0.0015 * e.deltaY));
    }, {passive: false});
    canvas.addEventListener("keydown", e => {
        const turn = {ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1]}[e.key];
        if (!turn) return;
        camera.idle = false;
        camera.turn += turn[0];
        camera.rise = Math.min(Math.max(camera.rise + turn[1], -1.5), 1.5);
    });
    canvas.tabIndex = 0;
}

// --- drawing

const shown = {lines: true, wall: true, colours: 0, playing: true};
let loop, streamlines, surface, drawing;

function makeDrawing() {
    const common = textOf("common") + textOf("palette");
    const both = (name, before) => programOf(before + textOf(name + "-vertex"), textOf(name + "-fragment"));
    drawing = {particles: both("particles", common), lines: both("lines", common), box: both("box", "")};
    if (look.triangles > 0) drawing.wall = both("wall", "");
    if (look.side && look.dimension == 2)
        drawing.plane = programOf(textOf("plane-vertex"), textOf("functions") + textOf("plane-fragment"));
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
}

async function makeSurface() {
    if (!look.triangles) return;
    const corners = await wordsOf("corners", 3 * look.triangles), grid = await wordsOf("points", 3 * look.points);
    const places = new Float32Array(4 * look.points);
    for (let k = 0; k < look.points; ++k)
        for (let axis = 0; axis < 3; ++axis)
            places[4 * k + axis] = look.lower[axis] - look.margin + grid[axis * look.points + k] * look.unit;
    const points = bufferOf(["a"], look.points, places), walls = wallAt(points, "a", look.points);
    const indices = gl.createBuffer();
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, indices);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, corners, gl.STATIC_DRAW);
    surface = {points, walls, indices};
}

function use(program, inputs, values) {
    gl.useProgram(program.made);
    set(program, values);
    bindInputs(program, inputs);
}

function drawWall(view, layer) {
    use(drawing.wall, {a: [surface.points, "a"], wall: [surface.walls, "wall"]}, {view: view.matrix, eye: view.eye, layer});
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, surface.indices);
    if (layer) gl.enable(gl.CULL_FACE);
    gl.cullFace(layer == 1 ? gl.FRONT : gl.BACK);
    gl.drawElements(gl.TRIANGLES, 3 * look.triangles, gl.UNSIGNED_INT, 0);
    gl.disable(gl.CULL_FACE);
    unbindInputs(drawing.wall);
}

function resize() {
    const dense = Math.min(window.devicePixelRatio || 1, 2);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map(x => Math.max(1, Math.round(x * dense)));
    if (canvas.width != width || canvas.height != height) [canvas.width, canvas.height] = [width, height];
    gl.viewport(0, 0, width, height);
    return [width, height];
}

function draw() {
    const [width, height] = resize(), {particles} = loop;
    const view = viewOf(canvas.clientWidth, canvas.clientHeight);
    const glass = look.side != "outside", box = {lower: look.lower, upper: look.upper};
    const colours = {rms: look.rms, potentials: look.potentials, colours: shown.colours, view: view.matrix, ...box};
    gl.clearColor(0.031, 0.043, 0.067, 1);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.disable(gl.BLEND);
    if (look.dimension == 3) gl.enable(gl.DEPTH_TEST);
    if (surface && shown.wall) drawWall(view, glass ? 1 : 0);
    if (glass) gl.clear(gl.DEPTH_BUFFER_BIT); // its far sides hide nothing
    gl.depthMask(false);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE);
    if (drawing.plane && shown.wall) {
        use(drawing.plane, {}, {view: view.matrix, ...box, side: {inside: 1, outside: -1, both: 0}[look.side]});
        gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    } else if (!look.side && shown.wall) {
        use(drawing.box, {}, {view: view.matrix, ...box});
        gl.drawArrays(gl.LINES, 0, 24);
    }
    if (shown.lines) {
        const {lines, across, along, pairs, indices} = streamlines;
        use(drawing.lines, fieldsOf(lines, ["a", "b"]), {...colours, across, along});
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, indices);
        gl.drawElements(gl.LINES, pairs.length, gl.UNSIGNED_INT, 0);
        unbindInputs(drawing.lines);
    }
    // The more particles, the smaller, so that they cover the same area.
    const size = height * view.height * look.span * Math.min(0.006, 0.0014 * Math.sqrt(40000 / particles.count) + 0.0014);
    use(drawing.particles, fieldsOf(particles.state, ["a", "b"]),
        {...colours, size, count: particles.count, moment: (loop.step - 0.5) / kSteps});
    gl.drawArrays(gl.POINTS, 0, particles.count);
    unbindInputs(drawing.particles);
    if (surface && shown.wall && glass) drawWall(view, 2);
}

// --- controls

const element = id => document.getElementById(id);
const kPlay = "<svg viewBox='0 0 14 14'><path d='M2 0l11 7-11 7z'/></svg>";
const kPause = "<svg viewBox='0 0 14 14'><path d='M1 0h4v14H1zM9 0h4v14H9z'/></svg>";

function showPlaying() {
    element("play").innerHTML = shown.playing ? kPause : kPlay;
    element("play").setAttribute("aria-label", shown.playing ? "Pause" : "Play");
}
function showTime() {
    const seconds = step => (step * look.duration / kSteps).toPrecision(3);
    if (loop.target === null) element("loop").value = loop.step;
    element("time").textContent = `${seconds(loop.step)} s of ${seconds(kSteps)} s`;
}

function makeControls() {
    const toggle = (id, change) => element(id).addEventListener("click", e => {
        const on = e.currentTarget.getAttribute("aria-pressed") != "true";
        e.currentTarget.setAttribute("aria-pressed", on);
        change(on);
    });
    toggle("lines", on => shown.lines = on);
    toggle("wall", on => shown.wall = on);
    toggle("more", on => element("about").hidden = !on);
    element("wall").textContent = look.side ? "Wall" : "Box";
    element("play").addEventListener("click", () => {
        shown.playing = !shown.playing;
        showPlaying();
    });
    element("loop").max = kSteps - 1;
    element("loop").addEventListener("input", e => {
        shown.playing = false;
        showPlaying();
        loop.jump(Number(e.target.value));
    });
    element("colours").addEventListener("change", e => shown.colours = Number(e.target.value));
    if (!look.tracks) element("colours").remove();
    if (matchMedia("(prefers-reduced-motion: reduce)").matches) camera.idle = shown.playing = false;
    showPlaying();
    followPointers();
}

function animate() {
    let last = performance.now(), due = 0;
    const frame = now => {
        const elapsed = Math.min(now - last, 100);
        last = now;
        if (loop.target !== null) {
            loop.continue(elapsed > 40 ? 2 : 8);
        } else if (shown.playing) {
            due = Math.min(due + 0.06 * elapsed, 3); // steps; a slow device takes one each frame
            if (elapsed > 40) due = Math.min(due, 1.5);
            for (; due >= 1; --due) loop.advance();
        }
        if (camera.idle && look.dimension == 3) camera.turn += 0.00008 * elapsed;
        showTime();
        draw();
        requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
}

/// For scripts and tests, once `ready` is fulfilled.
const curlew = {
    /// Moves the particles by so many seconds of the flow, in whole steps.
    advance(seconds) { for (let k = Math.round(seconds / loop.dt); k > 0; --k) loop.advance(); },
    jump(step) {
        loop.jump(step);
        loop.continue(Infinity);
    },
    play(on) {
        shown.playing = on;
        showPlaying();
    },
    /// Positions in world units, x y z; z is 0 in the plane.
    positions() {
        const state = contentOf(loop.particles.state, loop.particles.count), all = [];
        for (let k = 0; k < state.length; k += 24)
            for (let axis = 0; axis < 3; ++axis) all.push(axis < look.dimension ? state[k + axis] + look.origin[axis] : 0);
        return all;
    },
    /// How far each particle is off its track, relative to the rms of f and of g: the larger.
    drift() {
        const state = contentOf(loop.particles.state, loop.particles.count), all = [];
        for (let k = 0; k < state.length; k += 24)
            all.push(Math.max(...[0, 1].slice(0, look.dimension - 1).map(
                i => Math.abs(state[k + 3 + 4 * i] - state[k + 22 + i]) / look.potentials[i])));
        return all;
    },
    /// Distances from the wall, negative inside.
    distances() {
        const state = contentOf(loop.particles.state, loop.particles.count), all = [];
        for (let k = 16; k < state.length; k += 24) all.push(state[k]);
        return all;
    },
};

async function begin() {
    if (!gl) throw new Error("this browser has no WebGL 2");
    if (!window.DecompressionStream) throw new Error("this browser is too old: it has no DecompressionStream");
    await new Promise(done => requestAnimationFrame(() => setTimeout(done))); // paint the message first
    for (const [unit, data] of look.buffers.entries()) texture(unit, await wordsOf(data.name, data.count), data);
    makePrograms();
    makeDrawing();
    await makeSurface();
    const few = placesOf(kFew), count = affordable(few);
    loop = new Loop(placesOf(count), count);
    streamlines = streamlinesOf(few, count < 20000 ? 300 : 800, 70);
    streamlines.indices = gl.createBuffer();
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, streamlines.indices);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, streamlines.pairs, gl.STATIC_DRAW);
    makeControls();
    element("figures").textContent = `${count.toLocaleString("en")} particles`;
    element("message").hidden = true;
    animate();
}
canvas.addEventListener("webglcontextlost", () => {
    element("message").textContent = "The graphics device was lost; load the page again.";
    element("message").hidden = false;
});
curlew.ready = begin().catch(error => {
    element("message").textContent = `Cannot show the flow: ${error.message}`;
    console.error(error);
    throw error;
});
curlew.ready.catch(() => {});
</script>
</body>
</html>
)html";

} // namespace curlew
