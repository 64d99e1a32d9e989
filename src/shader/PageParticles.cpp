// SPDX-License-Identifier: Apache-2.0
#include "PageText.h"

namespace curlew {

// `look` holds the figures of the flow (FlowPage.cpp). `device` computes and draws: webGl() or webGpu(). It has
//   name
//   statesAt(places, count)  the states of particles that start at places, vec4s: {count, ...}
//   statesOf(count)          room for so many
//   step(states, dt)         moves them by a step of the midpoint method and a correction back onto the track
//   copy(from, begin, to, at, count)
//   contentOf(states)        a promise of their numbers: six vec4s each, as in PagePrograms.cpp
//   distancesAt(places, count)  a promise of distances from the wall
//   free(...states)
//   showSurface(places, corners), showLines(states, across, along, pairs), draw(frame): see PageView.cpp
//   failure()                what went wrong, or ""
constexpr std::string_view kPageParticles = R"html(<script>
"use strict";
const kSteps = 600;       // of a loop, 60 each second
const kFew = 2048;
const kKeys = 8;          // states of a loop that are kept for jumps
const kNumbers = 24;      // of a state
const canvas = document.getElementById("view");
const textOf = id => document.getElementById(id).textContent;
let device;

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

/// The words of each array of the flow; those of reals are their bits. Made a multiple of `size` long.
async function arraysOf(size) {
    const arrays = [];
    for (const {name, count, step, lower} of look.buffers) {
        const words = await wordsOf(name, count), padded = new Uint32Array(Math.ceil(count / size) * size);
        padded.set(words);
        const reals = new Float32Array(padded.buffer);
        if (step > 0)
            for (let k = 0; k < count; ++k) reals[k] = lower + step * words[k];
        arrays.push(padded);
    }
    return arrays;
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
async function placesOf(count) {
    const random = randomOf(1), places = new Float32Array(4 * count), kTries = 8192;
    for (let found = 0, round = 0; found < count; ++round) {
        if (round > 16 * count / kTries + 64) throw new Error("there is no room for particles in the box of the flow");
        const tries = new Float32Array(4 * kTries);
        for (let k = 0; k < kTries; ++k)
            for (let axis = 0; axis < look.dimension; ++axis)
                tries[4 * k + axis] = look.lower[axis] + random() * (look.upper[axis] - look.lower[axis]);
        const distances = await device.distancesAt(tries, kTries);
        for (let k = 0; k < kTries && found < count; ++k)
            if (isAllowed(distances[k])) places.set(tries.subarray(4 * k, 4 * k + 4), 4 * found++);
    }
    return places;
}

/// Particles in a loop. Each starts again once in it, in the order of their numbers, so the loop has no seam after the
/// first round.
class Loop {
    constructor(places, count) {
        this.count = count;
        this.states = device.statesAt(places, count);
        this.start = this.copyOf(this.states);
        this.dt = look.duration / kSteps;
        this.step = 0;
        this.moves = 0; // steps taken in all
        this.target = null; // of a jump
        this.keys = new Map();
        this.keep();
    }
    copyOf(states) {
        const made = device.statesOf(this.count);
        device.copy(states, 0, made, 0, this.count);
        return made;
    }
    keep() {
        const key = this.keys.get(this.step);
        if (key) device.copy(this.states, 0, key, 0, this.count);
        else this.keys.set(this.step, this.copyOf(this.states));
    }
    advance() {
        ++this.moves;
        device.step(this.states, this.dt);
        const [begin, end] = [0, 1].map(k => Math.ceil((this.step + k) * this.count / kSteps));
        device.copy(this.start, begin, this.states, begin, end - begin);
        this.step = (this.step + 1) % kSteps;
        if (this.step % (kSteps / kKeys) == 0) this.keep();
    }
    /// Goes to a step of the loop, from the last state that is kept before it; continue() takes the steps between.
    jump(step) {
        const key = Math.max(...[...this.keys.keys()].filter(k => k <= step));
        if (step < this.step || key > this.step) {
            device.copy(this.keys.get(key), 0, this.states, 0, this.count);
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
}

/// Shows streamlines from the first places: the states of particles after each step, one after the other.
function makeLines(places, across, along) {
    const states = device.statesAt(places, across), lines = device.statesOf(across * along), dt = look.duration / 200;
    for (let k = 0; k < along; ++k) {
        device.copy(states, 0, lines, k * across, across);
        if (k + 1 < along) device.step(states, dt);
    }
    device.free(states);
    const pairs = new Uint32Array(2 * across * (along - 1));
    for (let k = 0, n = 0; k + 1 < along; ++k)
        for (let line = 0; line < across; ++line, n += 2) {
            pairs[n] = k * across + line;
            pairs[n + 1] = pairs[n] + across;
        }
    device.showLines(lines, across, along, pairs);
}

/// A promise of the milliseconds that a step of so many particles takes.
async function timeOf(places, count) {
    const states = device.statesAt(places, count), one = device.statesOf(1);
    const wait = () => {
        device.step(states, look.duration / kSteps);
        device.copy(states, 0, one, 0, 1);
        return device.contentOf(one);
    };
    await wait();
    const begin = performance.now();
    await wait();
    device.free(states, one);
    return performance.now() - begin;
}

/// As many particles as move in 6 milliseconds, 4,000 to 100,000; or those of the address, #particles=N.
async function affordable(few) {
    const given = /[#&]particles=(\d+)/.exec(location.hash);
    if (given) return Math.min(Math.max(Number(given[1]), 1), 1000000);
    const places = new Float32Array(4 * 16 * kFew);
    for (let k = 0; k < 16; ++k) places.set(few, 4 * k * kFew);
    let count = kFew, time = await timeOf(places, count);
    while (time < 3 && count < 16 * kFew) time = await timeOf(places, count *= 4);
    return Math.round(Math.min(Math.max(count * 6 / time, 4000), 100000));
}
</script>
)html";

} // namespace curlew
