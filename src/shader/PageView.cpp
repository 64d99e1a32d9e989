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

const kBackground = [0.031, 0.043, 0.067];
const shown = {lines: true, wall: true, colours: 0, playing: true};
let loop;

async function makeSurface() {
    if (!look.triangles) return;
    const corners = await wordsOf("corners", 3 * look.triangles), grid = await wordsOf("points", 3 * look.points);
    const places = new Float32Array(4 * look.points);
    for (let k = 0; k < look.points; ++k)
        for (let axis = 0; axis < 3; ++axis)
            places[4 * k + axis] = look.lower[axis] - look.margin + grid[axis * look.points + k] * look.unit;
    device.showSurface(places, corners);
}

function resize() {
    const dense = Math.min(window.devicePixelRatio || 1, 2);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map(x => Math.max(1, Math.round(x * dense)));
    if (canvas.width != width || canvas.height != height) [canvas.width, canvas.height] = [width, height];
    return height;
}

function draw() {
    const pixels = resize(), view = viewOf(canvas.clientWidth, canvas.clientHeight), {count, states} = loop;
    // The more particles, the smaller, so that they cover the same area.
    const size = pixels * view.height * look.span * Math.min(0.006, 0.0014 * Math.sqrt(40000 / count) + 0.0014);
    device.draw({
        states, shown, glass: look.side != "outside", view: view.matrix, eye: view.eye, size, count,
        moment: (loop.step - 0.5) / kSteps, rms: look.rms, potentials: look.potentials, colours: shown.colours,
        lower: look.lower, upper: look.upper, side: {inside: 1, outside: -1, both: 0}[look.side],
    });
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
    let last = performance.now(), due = 0, drawn = "";
    document.addEventListener("visibilitychange", () => drawn = "");
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
        if (camera.idle && shown.playing && look.dimension == 3) camera.turn += 0.00008 * elapsed;
        // A page that has been paused rests.
        const seen = JSON.stringify([camera, shown, loop.step, loop.moves, canvas.clientWidth, canvas.clientHeight,
                                     devicePixelRatio, element("bar").offsetHeight]);
        if (seen != drawn) {
            drawn = seen;
            showTime();
            draw();
        }
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
    /// A promise of what `of(numbers, k)` returns for the state of each particle, the numbers from k on.
    async each(of) {
        const numbers = await device.contentOf(loop.states), all = [];
        for (let k = 0; k < numbers.length; k += kNumbers) all.push(of(numbers, k));
        return all;
    },
    /// A promise of positions in world units, x y z; z is 0 in the plane.
    async positions() {
        return (await this.each((s, k) => [0, 1, 2].map(axis => axis < look.dimension ? s[k + axis] + look.origin[axis] : 0))).flat();
    },
    /// A promise of how far each particle is off its track, relative to the rms of f and of g: the larger.
    drift() {
        return this.each((s, k) => Math.max(...[0, 1].slice(0, look.dimension - 1).map(
            i => Math.abs(s[k + 3 + 4 * i] - s[k + 22 + i]) / look.potentials[i])));
    },
    /// A promise of distances from the wall, negative inside.
    distances() { return this.each((s, k) => s[k + 16]); },
};

function showMessage(text) {
    element("message").textContent = text;
    element("message").hidden = !text;
}

/// A promise of the device: that of the address, #device=webgpu or webgl; else WebGPU on a GPU, or WebGL 2.
async function openDevice() {
    const given = /[#&]device=(webgpu|webgl)/.exec(location.hash)?.[1];
    const opened = given == "webgl" ? null : await webGpu(given == "webgpu").catch(error => {
        if (given) throw error;
        console.warn(`WebGL 2 instead of WebGPU: ${error.message}`);
    });
    const made = opened || (given == "webgpu" ? null : await webGl());
    if (!made) throw new Error(`this browser has no ${given == "webgpu" ? "WebGPU" : "WebGL 2"}`);
    return made;
}

async function begin() {
    if (!window.DecompressionStream) throw new Error("this browser is too old: it has no DecompressionStream");
    await new Promise(done => requestAnimationFrame(() => setTimeout(done))); // paint the message first
    device = await openDevice();
    await makeSurface();
    const few = await placesOf(kFew), count = await affordable(few);
    loop = new Loop(await placesOf(count), count);
    makeLines(few, count < 20000 ? 300 : 800, 70);
    makeControls();
    element("figures").textContent = `${count.toLocaleString("en")} particles, ${device.name}`;
    showMessage("");
    animate();
}
curlew.ready = begin().catch(error => {
    showMessage(`Cannot show the flow: ${error.message}`);
    console.error(error);
    throw error;
});
curlew.ready.catch(() => {});
</script>
</body>
</html>
)html";

} // namespace curlew
