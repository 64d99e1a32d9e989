# SPDX-License-Identifier: Apache-2.0
"""Runs shaders that -write dialect=es has written in headless Chromium (WebGL 2): browser.py CURLEW MESH.

Compares velocities and potentials at 10,000 positions with -probe; all are inside. Exits with 77 (skipped) if Chromium,
Selenium or NumPy is not installed.
"""

import base64
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

try:
    import numpy as np
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
OPTIONS = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader",
           "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
SIZE = 100  # of the square of positions
WIDTHS = {"uint": 1, "float": 1, "vec4": 4}  # words of the elements of arrays
NOISES = "-noise frequency=2.5 seed=1 -noise frequency=2.5 seed=2"
BODY = "a = vec4(flowVelocity(p), flowDistance(p)); b = vec4(flowPotentials(p), 0.0, 0.0);"
SCRIPT = """
const [functions, body, positions, arrays, size] = arguments;
const gl = document.createElement("canvas").getContext("webgl2");
if (!gl || !gl.getExtension("EXT_color_buffer_float")) return "no WebGL 2 with float targets";
const words = text => Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer;
const texture = (unit, inner, format, type, width, height, data) => {
    gl.activeTexture(gl.TEXTURE0 + unit);
    const made = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, made);
    gl.texImage2D(gl.TEXTURE_2D, 0, inner, width, height, 0, format, type, data);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    return made;
};
const program = gl.createProgram();
const add = (type, text) => {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
};
add(gl.VERTEX_SHADER, `#version 300 es
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }`);
add(gl.FRAGMENT_SHADER, `#version 300 es
precision highp float;
precision highp int;
${functions}
uniform highp sampler2D positions;
layout(location = 0) out vec4 a;
layout(location = 1) out vec4 b;
void main() { vec3 p = texelFetch(positions, ivec2(gl_FragCoord.xy), 0).xyz; ${body} }`);
gl.linkProgram(program);
if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
gl.useProgram(program);
texture(0, gl.RGBA32F, gl.RGBA, gl.FLOAT, size, size, new Float32Array(words(positions)));
gl.uniform1i(gl.getUniformLocation(program, "positions"), 0);
arrays.forEach(([name, type, rows, data], k) => {
    if (type == "uint")
        texture(k + 1, gl.R32UI, gl.RED_INTEGER, gl.UNSIGNED_INT, 2048, rows, new Uint32Array(words(data)));
    else if (type == "float")
        texture(k + 1, gl.R32F, gl.RED, gl.FLOAT, 2048, rows, new Float32Array(words(data)));
    else
        texture(k + 1, gl.RGBA32F, gl.RGBA, gl.FLOAT, 2048, rows, new Float32Array(words(data)));
    gl.uniform1i(gl.getUniformLocation(program, name), k + 1);
});
gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
const targets = [0, 1].map(k => texture(10 + k, gl.RGBA32F, gl.RGBA, gl.FLOAT, size, size, null));
targets.forEach((target, k) =>
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + k, gl.TEXTURE_2D, target, 0));
gl.drawBuffers([gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1]);
gl.viewport(0, 0, size, size);
gl.drawArrays(gl.TRIANGLES, 0, 3);
const results = [0, 1].map(k => {
    const values = new Float32Array(4 * size * size);
    gl.readBuffer(gl.COLOR_ATTACHMENT0 + k);
    gl.readPixels(0, 0, size, size, gl.RGBA, gl.FLOAT, values);
    return Array.from(values);
});
if (gl.getError() != gl.NO_ERROR) return "an error of WebGL";
return results;
"""


def encoded(array):
    return base64.b64encode(array.tobytes()).decode()


def arrays_of(text, data):
    """Returns the name, type and words of each array in the data file."""
    return [(name, kind, np.frombuffer(data, np.uint32, int(count) * WIDTHS[kind], int(begin)))
            for name, count, kind, begin in re.findall(r"//   (flowData\d+): (\d+) (\w+), from byte (\d+)", text)]


def in_rows(words, kind):
    """Returns the number of rows of 2048 elements, and the words padded to whole rows."""
    size = 2048 * WIDTHS[kind]
    rows = -(-len(words) // size)
    return rows, np.pad(words, (0, rows * size - len(words)))


def run(curlew, folder, *actions):
    subprocess.run([curlew, "-quiet", *" ".join(actions).split()], cwd=folder, check=True)


def origin_of(text):
    """Returns the position from which a shader measures."""
    return np.array([float(x) for x in re.search(r"relative to \(([^)]*)\)", text)[1].split(",")], np.float32).astype(float)


def probed(curlew, what, positions, folder):
    """Returns what -probe finds out about a flow or a distance at positions: one row for each."""
    np.savetxt(folder / "p.csv", positions, delimiter=",", fmt="%.17g", header="x,y,z", comments="")
    run(curlew, folder, what, "-probe p.csv v.csv")
    return np.loadtxt(folder / "v.csv", delimiter=",", skiprows=1)[:, 3:]


def written(curlew, flow, name, folder):
    """Writes a flow as a shader; `name` may have options before it. Returns its text, its arrays, positions relative to its origin, and
    the velocities, f and g there."""
    run(curlew, folder, flow, f"-write {name} -scatter count={SIZE * SIZE} seed=3 -write start.csv")
    text, data = (folder / name.split()[-1]).read_text(), folder / (name.split()[-1] + ".bin")
    start = np.loadtxt(folder / "start.csv", delimiter=",", skiprows=1, usecols=(0, 1, 2))
    start = (start - origin_of(text)).astype(np.float32)
    expected = probed(curlew, flow, origin_of(text) + start.astype(float), folder)[:, :5]
    return text, arrays_of(text, data.read_bytes() if data.exists() else b""), start, expected


def errors(name, found, expected, of_value=4e-6):
    """Compares rows of velocity, f, g and distance from the wall with those of -probe. Returns what is wrong."""

    def error(columns):
        off = abs(found[:, columns] - expected[:, columns]).max()
        return off / np.sqrt((expected[:, columns] ** 2).mean())

    figures = {
        "velocity": (error(slice(0, 3)), 1e-4),  # relative to the rms of a component
        "f": (error(3), of_value),
        "g": (error(4), of_value),
        "positions outside": ((found[:, 5] >= 0).sum(), 0),
    }
    print(name, {key: f"{value:.3g}" for key, (value, _) in figures.items()}, flush=True)
    return [f"{name}: {key} is {value:.3g}, more than {most}" for key, (value, most) in figures.items() if not value <= most]


def opened(*options):
    """Returns a headless Chromium with these options; None, and a line, if it is not installed."""
    if not CHROMIUM or not DRIVER:
        print("skipped: Chromium is not installed")
        return None
    chosen = webdriver.ChromeOptions()
    chosen.binary_location = CHROMIUM
    chosen.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    for option in (*OPTIONS, *options):
        chosen.add_argument(option)
    browser = webdriver.Chrome(options=chosen, service=Service(DRIVER))
    browser.set_script_timeout(600)
    return browser


def check(curlew, name, wall, browser, folder):
    """Returns the errors of one scene."""
    flow = f"{wall} {NOISES} -bound width=0.12 -dfvn speed=1"
    text, arrays, start, expected = written(curlew, flow, "dialect=es tables=data flow.glsl", folder)
    rows = [[array, kind, *in_rows(words, kind)] for array, kind, words in arrays]
    result = browser.execute_script(SCRIPT, text, BODY, encoded(np.pad(start, ((0, 0), (0, 1)))),
                                    [[array, kind, count, encoded(words)] for array, kind, count, words in rows], SIZE)
    if isinstance(result, str):
        return [f"{name}: {result}"]
    a, b = [np.array(values).reshape(-1, 4) for values in result]
    return errors(name, np.column_stack([a[:, :3], b[:, :2], a[:, 3]]), expected)


def main(curlew, mesh):
    browser = opened()
    if not browser:
        return 77
    try:
        with tempfile.TemporaryDirectory() as folder:
            wrong = check(curlew, "mesh", f"-read {mesh} -mesh2ls dim=60", browser, Path(folder))
    finally:
        browser.quit()
    return "\n".join(wrong) if wrong else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
