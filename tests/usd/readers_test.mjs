// SPDX-License-Identifier: Apache-2.0
// Reads .usda files of the command with tinyusdz and with three's USDLoader, and compares them with .csv files of the
// same objects: readers_test.mjs COMMAND MODULES_DIR.
import assert from "node:assert/strict";
import {execFileSync} from "node:child_process";
import {existsSync, mkdtempSync, readFileSync, rmSync} from "node:fs";
import {tmpdir} from "node:os";
import {join, resolve} from "node:path";
import {after, test} from "node:test";
import {pathToFileURL} from "node:url";

const [command, modules] = process.argv.slice(2).map((path) => resolve(path));
const module = (name) => import(pathToFileURL(join(modules, name)));
const {USDAParser} = await module("three/examples/jsm/loaders/usd/USDAParser.js");
const {USDLoader} = await module("three/examples/jsm/loaders/USDLoader.js");
// tinyusdz is built for browsers and refuses to run in Node.
process.type = "renderer";
globalThis.window = globalThis;
const {default: makeTinyusdz} = await module("tinyusdz/tinyusdz.js");
const tinyusdz = await makeTinyusdz({wasmBinary: readFileSync(join(modules, "tinyusdz/tinyusdz.wasm"))});

const folder = mkdtempSync(join(tmpdir(), "curlew-usd-"));
after(() => rmSync(folder, {recursive: true}));
const FLOW = "-quiet -sphere -noise frequency=2 -noise frequency=2 seed=1 -bound -dfvn speed=1";

/** Runs the command in the folder. */
function curlew(actions) {
    execFileSync(command, actions.split(" "), {cwd: folder});
}

/** Returns the prims and attributes of a layer, by path, and checks that a scene can be made from it. */
function readWithThree(text, prim) {
    // OpenUSD declares an attribute with metadata beside its time samples. three 0.187 cannot read the declaration.
    text = text.replace(/^ *\S+ \S+ \(\n[^)]*\)\n/gm, "");
    assert.ok(new USDLoader().parse(text).getObjectByName(prim));
    return new USDAParser().parseData(text).specsByPath;
}

/** The same of what tinyusdz has read: it writes a layer in its own words. */
function readWithTinyusdz(text, prim) {
    const bytes = new TextEncoder().encode(text);
    const scene = new tinyusdz.TinyUSDZLoaderNative(); // knows the types of the attributes of Points, BasisCurves, …
    assert.ok(scene.loadFromBinary(bytes, "layer.usda"), scene.error());
    const layer = new tinyusdz.TinyUSDZLoaderNative();
    assert.ok(layer.loadAsLayerFromBinary(bytes, "layer.usda"), layer.error());
    return readWithThree(layer.layerToString(), prim);
}

/** Returns the columns of a .csv file. */
function columns(name) {
    const [head, ...rows] = readFileSync(join(folder, name), "utf8").trim().split("\n").map((row) => row.split(","));
    return Object.fromEntries(head.map((column, k) => [column, rows.map((row) => Number(row[k]))]));
}

/** Returns the vectors with these components one after the other. */
const vectors = (x, y, z) => x.flatMap((value, n) => [value, y[n], z[n]]);

/** What tinyusdz 0.9.0-rc10 writes of an int64; it writes other types correctly. */
const firstDigit = (number) => Number(String(number)[0]);

/** Compares numbers in single precision. */
function same(found, wanted) {
    assert.equal(found.length, wanted.length);
    found.forEach((value, n) => assert.ok(Math.abs(value - wanted[n]) <= 1e-6 * Math.max(1, Math.abs(wanted[n])), `${n}: ${value}`));
}

for (const [reader, read] of [["three", readWithThree], ["tinyusdz", readWithTinyusdz]]) {
    const layer = (name) => read(readFileSync(join(folder, `${name}.usda`), "utf8"), name);
    const value = (specs, path) => specs[path].fields.default;

    test(`${reader}: particles that are born and die, with velocities and ids`, () => {
        curlew(`${FLOW} -frames 1-4 fps=24 -emit rate=100 box=-0.3,-0.3,-0.3,0.3,0.3,0.3 life=0.05 -advect -write dust.usda dust.$F4.csv`);
        const specs = layer("dust");
        const {defaultPrim, upAxis, timeCodesPerSecond, framesPerSecond, metersPerUnit} = specs["/"].fields;
        assert.deepEqual([defaultPrim, upAxis, timeCodesPerSecond, framesPerSecond, metersPerUnit], ["dust", "Y", 24, 24, 1]);
        assert.equal(specs["/dust"].fields.typeName, "Points");
        assert.deepEqual(["points", "velocities", "ids", "widths"].map((name) => specs[`/dust.${name}`].fields.typeName),
                         ["point3f[]", "vector3f[]", "int64[]", "float[]"]);
        const samples = (name) => specs[`/dust.${name}`].fields.timeSamples;
        for (const name of ["points", "velocities", "ids", "primvars:age"])
            assert.deepEqual(samples(name).times, [1, 2, 3, 4]);
        const counts = [1, 2, 3, 4].map((frame, n) => {
            const {x, y, z, id, vx = [], vy = [], vz = [], age = []} = columns(`dust.000${frame}.csv`); // [] without points
            same(samples("points").values[n], vectors(x, y, z));
            same(samples("velocities").values[n], vectors(vx, vy, vz));
            same(samples("primvars:age").values[n], age);
            assert.deepEqual(samples("ids").values[n], reader === "three" ? id : id.map(firstDigit));
            return id.length;
        });
        assert.ok(counts[3] > 0 && new Set(counts).size > 1, `the counts are ${counts}`);
    });

    test(`${reader}: open and closed curves with velocities`, () => {
        curlew(`${FLOW} -scatter count=20 -trace maxLength=8 -write lines.usda lines.csv`);
        const specs = layer("lines");
        const table = columns("lines.csv");
        assert.deepEqual(specs["/lines"].fields.primChildren, ["open", "closed"]);
        for (const [prim, closed, wrap] of [["open", 0, "nonperiodic"], ["closed", 1, "periodic"]]) {
            const rows = table.curve.map((_, n) => n).filter((n) => table.closed[n] === closed);
            const of = (...names) => names.map((name) => rows.map((n) => table[name][n]));
            const curves = of("curve")[0];
            assert.equal(specs[`/lines/${prim}`].fields.typeName, "BasisCurves");
            assert.deepEqual([value(specs, `/lines/${prim}.type`), value(specs, `/lines/${prim}.wrap`)], ["linear", wrap]);
            assert.deepEqual(value(specs, `/lines/${prim}.curveVertexCounts`),
                             [...new Set(curves)].map((curve) => curves.filter((other) => other === curve).length));
            same(value(specs, `/lines/${prim}.points`), vectors(...of("x", "y", "z")));
            same(value(specs, `/lines/${prim}.velocities`), vectors(...of("vx", "vy", "vz")));
            same(value(specs, `/lines/${prim}.primvars:f`), of("f")[0]);
        }
    });

    test(`${reader}: a volume that refers to the grids of a sequence`, () => {
        curlew(`${FLOW} -frames 1-3 fps=24 -velocity dim=8 density=1 -write grid=0,1 smoke.$F4.vdb smoke.usda`);
        const specs = layer("smoke");
        assert.equal(specs["/smoke"].fields.typeName, "Volume");
        for (const [name, type, kind] of [["vel", "float3", "unknown"], ["density", "float", "fogVolume"]]) {
            assert.deepEqual(specs[`/smoke.field:${name}`].fields.targetPaths, [`/smoke/${name}`]);
            assert.equal(specs[`/smoke/${name}`].fields.typeName, "OpenVDBAsset");
            assert.deepEqual(["fieldName", "fieldDataType", "fieldClass"].map((field) => value(specs, `/smoke/${name}.${field}`)),
                             [name, type, kind]);
            const {times, values} = specs[`/smoke/${name}.filePath`].fields.timeSamples;
            const files = values.map((path) => path.replace(/,$/, "")); // three keeps the comma after a path
            assert.deepEqual([times, files], [[1, 2, 3], [1, 2, 3].map((frame) => `./smoke.000${frame}.vdb`)]);
            files.forEach((file) => assert.ok(existsSync(join(folder, file)), file));
        }
    });
}
