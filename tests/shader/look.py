# SPDX-License-Identifier: Apache-2.0
"""Opens pages that -write look.html has written in headless Chromium, with WebGL 2 and with WebGPU: look.py CURLEW MESH [PICTURES].

The page draws, its particles move, and after 4 seconds of the flow all of them are on their tracks and out of the wall: by the
distances in the page, and by -probe. Jumps in the loop lead to the same places. In windows of the size of a desktop and of a phone,
nothing is wider than the window. PICTURES is a folder for pictures of both. Exits with 77 (skipped) if Chromium, Selenium or NumPy is
not installed.
"""

import base64
import subprocess
import sys
import tempfile
from pathlib import Path

import browser as shaders
from browser import np  # exits if it is missing

DEVICES = ("webgl", "webgpu")
# For WebGPU without a GPU. With other ways to use SwiftShader, the process for graphics ends when the page draws.
OPTIONS = ["--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader", "--enable-features=Vulkan", "--use-vulkan=swiftshader"]
WINDOWS = {"desktop": (1280, 800), "phone": (390, 844)}
NOISES = "-noise frequency=2.5 seed=1 -noise frequency=2.5 seed=2"
PARTICLES = 100
READY = """
const done = arguments[0];
if (typeof curlew == "undefined") done("the scripts of the page did not run");
else curlew.ready.then(() => { curlew.play(false); done(""); }, error => done(error.message));
"""
# The number of pixels of the canvas that are bright, and of those that a second of the flow changes.
DRAWN = """
const pixels = () => {
    draw();
    const flat = document.createElement("canvas");
    [flat.width, flat.height] = [canvas.width, canvas.height];
    const context = flat.getContext("2d", {willReadFrequently: true});
    context.drawImage(canvas, 0, 0);
    return context.getImageData(0, 0, flat.width, flat.height).data;
};
const before = pixels();
curlew.advance(0.3);
const after = pixels();
let bright = 0, changed = 0;
for (let k = 0; k < before.length; k += 4) {
    bright += before[k] + before[k + 1] + before[k + 2] > 200;
    changed += Math.abs(before[k] - after[k]) + Math.abs(before[k + 2] - after[k + 2]) > 60;
}
return [bright, changed, device.failure()];
"""
# What is wider than the window or beyond its edges.
OVERFLOW = """
const wrong = [], [width, height] = [innerWidth, innerHeight];
if (document.documentElement.scrollWidth > width) wrong.push("the page");
document.getElementById("about").hidden = false;
for (const element of document.querySelectorAll("header, h1, #bar, #bar *, #about, #about pre")) {
    const box = element.getBoundingClientRect();
    if (box.left < 0 || box.right > width + 0.5 || box.top < 0 || box.bottom > height + 0.5) wrong.push(element.id || element.localName);
}
document.getElementById("about").hidden = true;
return wrong;
"""


# Draws that the page makes by itself while it is paused: in a quarter of a second; after an option has changed; after a jump.
RESTING = """
const draw = device.draw.bind(device), frames = () => new Promise(done => setTimeout(done, 250));
let count = 0;
device.draw = what => { ++count; draw(what); };
await frames();
count = 0;
await frames();
const counts = [count];
for (const change of [() => document.getElementById("wall").click(), () => curlew.jump(40)]) {
    await frames();
    count = 0;
    change();
    for (let waited = 0; count == 0 && waited < 40; ++waited) await frames(); // a busy machine draws late
    counts.push(count);
}
device.draw = draw;
return counts;
"""


def run(curlew, folder, *words):
    subprocess.run([curlew, "-quiet", *words], cwd=folder, check=True)


def size(browser, window):
    width, height = WINDOWS[window]
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                            {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": window == "phone"})


def promised(browser, script):
    """Returns what a script with `await` returns."""
    return browser.execute_async_script(f"const done = arguments[0]; (async () => {{ {script} }})().then(done, e => done(`error: ${{e.message}}`));")


def opened(browser, page, device):
    """Loads a page and returns its errors."""
    browser.get("about:blank")
    browser.get(f"{page.as_uri()}#particles={PARTICLES}&device={device}")
    error = browser.execute_async_script(READY)
    return [error] if error else []


def drawn(browser):
    bright, changed, error = browser.execute_script(DRAWN)
    print(f"  {bright} bright pixels, {changed} changed")
    wrong = [] if bright > 500 else [f"only {bright} pixels are bright"]
    wrong += [] if changed > 100 else [f"only {changed} pixels have changed"]
    return wrong + ([error] if error else [])


def check_mesh(browser, curlew, wall, device, folder, pictures):
    size(browser, "phone")
    wrong = opened(browser, folder / "look.html", device)
    if wrong:
        return wrong
    # The last jump goes back to the state that was kept at step 75, and on from there.
    jumps = promised(browser, "const at = async s => { curlew.jump(s); return curlew.positions(); };"
                              "const first = await at(80); await at(20); await at(90); const again = await at(80);"
                              "return first.every((x, k) => x == again[k]);")
    wrong += [] if jumps is True else [f"a jump in the loop leads to other places ({jumps})"]
    # Without a new start in each round of the loop.
    before = np.array(promised(browser, "return curlew.positions();"))
    distances, drift, places = promised(
        browser, "for (let time = 0; time < 4; time += loop.dt) device.step(loop.states, loop.dt);"
                 "return [await curlew.distances(), await curlew.drift(), await curlew.positions()];")
    np.savetxt(folder / "p.csv", np.array(places).reshape(-1, 3), delimiter=",", fmt="%.17g", header="x,y,z", comments="")
    run(curlew, folder, *wall, "-probe", "p.csv", "d.csv")
    exact = np.loadtxt(folder / "d.csv", delimiter=",", skiprows=1)[:, 3]
    moved = np.linalg.norm((np.array(places) - before).reshape(-1, 3), axis=1).mean()
    near = np.array(distances) > -0.015  # half a voxel: beyond, the narrow band of the page, which is wider, differs
    print(f"  nearest to the wall: {max(distances):.3g}, {near.sum()} near it, by -probe {exact.max():.3g}; drift {max(drift):.3g}")
    # The coefficients are rounded to 1/65535 of about 0.3.
    figures = {"missing particles": (abs(len(distances) - PARTICLES), 0), "particles in the wall": ((np.array(distances) >= 0).sum(), 0),
               "particles in the wall by -probe": ((exact >= 5e-6).sum(), 0), "drift": (max(drift), 4e-6),
               "difference of the distances": (abs(exact - distances)[near].max(), 1e-5),
               "1 / the mean of the ways": (1 / moved, 10)}
    wrong += [f"{name}: {value:.3g}, more than {most}" for name, (value, most) in figures.items() if not value <= most]
    resting, *changed = promised(browser, RESTING)
    wrong += [] if resting == 0 and min(changed) >= 1 else [f"while paused it draws {resting} times, after changes {changed}"]
    wrong += drawn(browser)
    for window in WINDOWS:
        size(browser, window)
        browser.execute_script("draw()")
        wrong += [f"on a {window}, {what} does not fit" for what in browser.execute_script(OVERFLOW)]
        if pictures:
            picture = browser.execute_cdp_cmd("Page.captureScreenshot", {"format": "png"})["data"]
            (Path(pictures) / f"{window}_{device}.png").write_bytes(base64.b64decode(picture))
    return wrong


def check_plane(browser, device, folder):
    size(browser, "phone")
    wrong = opened(browser, folder / "plane.html", device)
    if not wrong:
        wrong += drawn(browser)
        inside = promised(browser, "curlew.advance(2 * look.duration / kSteps * 100); return Math.max(...await curlew.distances())")
        wrong += [] if inside < 0 else [f"a particle in the plane is {inside:.3g} in the wall"]
    return wrong


def main(curlew, mesh, pictures=None):
    browser = shaders.opened(*OPTIONS)
    if not browser:
        return 77
    wrong, wall = [], ["-read", mesh, "-mesh2ls", "dim=60"]
    try:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            run(curlew, folder, *wall, *f"{NOISES} -bound -dfvn speed=1 -write look.html".split())
            run(curlew, folder, *"-noise dimensions=2 frequency=2 -sphere dimensions=2 radius=0.8 -bound -dfvn -write plane.html".split())
            for device in DEVICES:
                for page, check in {"mesh": lambda on: check_mesh(browser, curlew, wall, on, folder, pictures),
                                    "plane": lambda on: check_plane(browser, on, folder)}.items():
                    print(page, device)
                    wrong += [f"{page} with {device}: {error}" for error in check(device)]
                    wrong += [f"{page} with {device}: the console shows {line['message']}" for line in browser.get_log("browser")]
    finally:
        browser.quit()
    return "\n".join(wrong) if wrong else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
