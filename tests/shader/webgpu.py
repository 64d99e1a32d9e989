# SPDX-License-Identifier: Apache-2.0
"""Runs shaders that -write has written as .wgsl in headless Chromium (WebGPU): webgpu.py CURLEW MESH.

Compares velocities and potentials at 10,000 positions with -probe; all are inside. Particles stay on their tracks and inside. Exits with 77 (skipped) if Chromium, Selenium or NumPy is not installed.
"""

import sys
import tempfile
from pathlib import Path

import browser as shaders
from browser import np

OPTIONS = ["--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader"]
SCRIPT = """
const [functions, body, positions, arrays, count, done] = arguments;
(async () => {
    const adapter = await navigator.gpu.requestAdapter();
    if (!adapter) return "there is no WebGPU adapter";
    const device = await adapter.requestDevice();
    const words = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));
    const module = device.createShaderModule({code: functions + `
@group(1) @binding(0) var<storage, read> positions: array<f32>;
@group(1) @binding(1) var<storage, read_write> results: array<f32>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if (i >= ${count}u) { return; }
    let p = vec3f(positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]);
    ${body}
}`});
    const messages = (await module.getCompilationInfo()).messages;
    if (messages.length) return messages.slice(0, 3).map(m => `line ${m.lineNum}: ${m.message}`).join("; ");
    if (!body) return [];
    const usage = GPUBufferUsage;
    const filled = (kind, bytes) => {
        const buffer = device.createBuffer({size: bytes.length, usage: kind, mappedAtCreation: true});
        new Uint8Array(buffer.getMappedRange()).set(bytes);
        buffer.unmap();
        return buffer;
    };
    const size = 24 * count;
    const output = device.createBuffer({size, usage: usage.STORAGE | usage.COPY_SRC});
    const groups = [arrays.map(text => ["read-only-storage", filled(usage.STORAGE, words(text))]),
                    [["read-only-storage", filled(usage.STORAGE, words(positions))], ["storage", output]]];
    if (functions.includes("var<uniform> flowZero")) groups[0].push(["uniform", filled(usage.UNIFORM, new Uint8Array(4))]);
    const layouts = groups.map(group => device.createBindGroupLayout({entries: group.map(([type], binding) =>
        ({binding, visibility: GPUShaderStage.COMPUTE, buffer: {type}}))}));
    device.pushErrorScope("validation");
    const pipeline = await device.createComputePipelineAsync(
        {layout: device.createPipelineLayout({bindGroupLayouts: layouts}), compute: {module, entryPoint: "main"}});
    const copy = device.createBuffer({size, usage: usage.COPY_DST | usage.MAP_READ});
    const commands = device.createCommandEncoder(), pass = commands.beginComputePass();
    pass.setPipeline(pipeline);
    groups.forEach((group, k) => pass.setBindGroup(k, device.createBindGroup(
        {layout: layouts[k], entries: group.map(([, buffer], binding) => ({binding, resource: {buffer}}))})));
    pass.dispatchWorkgroups(Math.ceil(count / 64));
    pass.end();
    commands.copyBufferToBuffer(output, 0, copy, 0, size);
    device.queue.submit([commands.finish()]);
    const error = await device.popErrorScope();
    if (error) return error.message;
    await copy.mapAsync(GPUMapMode.READ);
    return Array.from(new Float32Array(copy.getMappedRange()));
})().then(done, error => done(error.message));
"""
# The columns of the results, the function that they are of, and what it returns.
HERE = (slice(0, 5), "flowHere", ("v.r8", "v.r9", "v.r10", "v.r0", "v.r1"))
VELOCITY = (slice(0, 3), "flowVelocity", ("v.x", "v.y", "v.z"))
POTENTIALS = (slice(3, 5), "flowPotentials", ("v.x", "v.y"))
DISTANCE = (slice(5, 6), "flowDistance", ("v",))
GIVE = "results[6 * i + {}] = {};"


def body(*values):
    return " ".join(GIVE.format(k, value) for k, value in enumerate(values))


def run(browser, text, code, start, arrays):
    """Returns the six results at each position, or what is wrong."""
    result = browser.execute_async_script(SCRIPT, text, code, shaders.encoded(start),
                                          [shaders.encoded(words) for _, _, words in arrays], len(start))
    return result if isinstance(result, str) else np.array(result).reshape(-1, 6)


def check(curlew, name, flow, browser, folder, functions, of_value):
    """Returns the errors of one flow. Each function is a program of its own: drivers for the processor put all calls in line, and take
    minutes to compile two of them."""
    text, arrays, start, expected = shaders.written(curlew, flow, f"tables=data {name}.wgsl", folder)
    found = np.full((len(start), 6), -1.0)
    for columns, function, values in functions:
        result = run(browser, text, f"let v = {function}(p); " + body(*values), start, arrays)
        if isinstance(result, str):
            return [f"{name}: {function}: {result}"]
        found[:, columns] = result[:, :len(values)]
    return shaders.errors(name, found, expected, of_value)


def check_steps(curlew, wall, flow, browser, folder):
    """Returns the errors of 1,000 particles that flowAdvance() moves by 20 steps: they stay on their tracks and within the wall."""
    text, arrays, start, expected = shaders.written(curlew, wall + flow, "tables=data steps.wgsl", folder)
    start, expected = start[:1000], expected[:1000]
    code = f"""var q = p;
    let track = flowPotentials(p);
    for (var k: i32 = 0; k < 20; k++) {{ q = flowAdvance(q, track, 0.02); }}
    {body("q.x", "q.y", "q.z")}"""
    result = run(browser, text, code, start, arrays)
    if isinstance(result, str):
        return [f"steps: {result}"]
    places = shaders.origin_of(text) + result[:, :3]
    potentials = shaders.probed(curlew, wall + flow, places, folder)[:, 3:5]
    drift = abs(potentials - expected[:, 3:5]).max(axis=0) / np.sqrt((expected[:, 3:5] ** 2).mean(axis=0))
    outside = (shaders.probed(curlew, wall, places, folder)[:, 0] >= 0).sum()
    moved = np.linalg.norm(result[:, :3] - start, axis=1).mean()
    print(f"steps: drift {drift.max():.3g}, {outside} outside, moved {moved:.3g}")
    wrong = [] if drift.max() < 1e-5 else [f"particles leave their tracks by {drift.max():.3g}"]
    wrong += [f"{outside} particles are in the wall"] if outside else []
    return wrong if moved > 0.1 else wrong + [f"particles have moved by {moved:.3g} only"]


def check_text(curlew, flow, browser, folder):
    """Returns what the compiler says of a text with the tables of the noises in it, which takes minutes to run."""
    text, *_ = shaders.written(curlew, flow, "tables=text text.wgsl", folder)
    result = run(browser, text, "", np.zeros((1, 3), np.float32), [])
    return [f"tables=text: {result}"] if isinstance(result, str) else []


def main(curlew, mesh):
    browser = shaders.opened(*OPTIONS)
    if not browser:
        return 77
    wrong = []
    try:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            (folder / "empty.html").write_text("<!doctype html><title>WebGPU</title>")
            browser.get((folder / "empty.html").as_uri())  # WebGPU needs a page that is not about:blank
            wall, flow = f"-read {mesh} -mesh2ls dim=60", f" {shaders.NOISES} -bound width=0.12 -dfvn speed=1"
            bound = wall + flow
            wrong += check(curlew, "mesh", bound, browser, folder, (VELOCITY, POTENTIALS, DISTANCE), 4e-6)
            wrong += check_steps(curlew, wall, flow, browser, folder)
            wrong += check_text(curlew, bound, browser, folder)
            for kind, of_value in (("psrd", 2e-6), ("simplex", 2e-6), ("perlin", 1e-5), ("value", 1e-5), ("sine", 2e-6)):
                flow = f"-noise type={kind} frequency=2 -ramp gradient=1,2,3 -dfvn speed=1"
                wrong += check(curlew, kind, flow, browser, folder, (HERE,), of_value)
    finally:
        browser.quit()
    return "\n".join(wrong) if wrong else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
