# SPDX-License-Identifier: Apache-2.0
"""Judges -mesh2ls on meshes that other people made: models from npm packages, and Blender's monkey if Blender is installed.

    models.py CURLEW [COUNT]

A position is wrong if the exact winding number (the sum of the solid angles of all triangles, in double) and the level set disagree
about its side, and the boundary of the solid is farther than half a voxel. COUNT positions per model: half in its box, half near its surface.
Writes a table in Markdown, and exits with 1 if any position is wrong.
"""

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

DIM = 128
CONTROLLERS = ("generic-trigger-squeeze-thumbstick", "meta-quest-touch-plus", "htc-vive", "valve-index")
MONKEY = """
import bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.mesh.primitive_monkey_add()
bpy.ops.export_scene.obj(filepath="monkey.obj")
"""


def package(name, folder):
    """Downloads an npm package and returns the folder of its files."""
    path = folder / name.replace("/", "_")
    path.mkdir()
    subprocess.run(["npm", "pack", "--silent", name], cwd=path, check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["tar", "xzf", next(path.glob("*.tgz")).name], cwd=path, check=True)
    return path / "package"


def from_script(folder, out):
    """Converts the arrays of positions and cells in a package's script to .obj."""
    path = folder / json.loads((folder / "package.json").read_text()).get("main", "index.js")
    arrays = {name: json.loads(re.search(rf"exports\.{name}\s*=\s*(\[\[.*?\]\])", path.read_text(), re.S)[1])
              for name in ("positions", "cells")}
    lines = ["v " + " ".join(map(repr, p)) for p in arrays["positions"]]
    lines += ["f " + " ".join(str(k + 1) for k in cell) for cell in arrays["cells"]]
    out.write_text("\n".join(lines) + "\n")
    return out


def models(folder):
    """Returns the files by name."""
    found = {name: from_script(package(name, folder), folder / f"{name}.obj") for name in ("bunny", "teapot")}
    controllers = package("@webxr-input-profiles/assets", folder) / "dist/profiles"
    found.update({name: sorted((controllers / name).glob("*.glb"))[0] for name in CONTROLLERS})
    monkey = subprocess.run(["blender", "-b", "--factory-startup", "--python-expr", MONKEY], cwd=folder, capture_output=True)
    if monkey.returncode == 0:
        found["Blender's monkey"] = folder / "monkey.obj"
    return found


def triangles_of(path):
    """Returns the corners of the triangles of an .obj file (k x 3 x 3); faces are fans around their first vertex."""
    vertices, corners = [], []
    for line in path.read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append([float(word) for word in words[1:4]])
        elif words[:1] == ["f"]:
            face = [int(word.split("/")[0]) - 1 for word in words[1:]]
            corners += [(face[0], face[k], face[k + 1]) for k in range(1, len(face) - 1)]
    return np.array(vertices)[np.array(corners)]


def winding(triangles, p):
    """Returns the winding number (van Oosterom and Strackee 1983)."""
    a, b, c = (triangles - p).transpose(1, 0, 2)
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    dot = lambda u, v: np.einsum("ij,ij->i", u, v)  # noqa: E731
    triple = dot(a, np.cross(b, c))
    return np.arctan2(triple, la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb).sum() / (2 * np.pi)


def clear(triangles, p, reach):
    """Returns whether the boundary of the solid (winding number 1/2) is farther than `reach`, looking in 26 directions."""
    steps = np.stack(np.meshgrid(*[(-1, 0, 1)] * 3), -1).reshape(-1, 3)
    around = [p + step * (reach / np.linalg.norm(step)) for step in steps if step.any()]
    return len({winding(triangles, q) > 0.5 for q in [p, *around]}) == 1


def judged(curlew, path, count, folder):
    """Converts a model, and returns the row of the table and the number of wrong positions."""
    log = subprocess.run([curlew, "-read", path, "-write", "mesh.obj", "-mesh2ls", f"dim={DIM}", "-write", "mesh.vdb"], cwd=folder,
                         check=True, capture_output=True, text=True).stderr
    triangles = triangles_of(folder / "mesh.obj")
    lower, upper = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    voxel = (upper - lower).max() / DIM
    random = np.random.default_rng(1)
    area = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
    weights = random.dirichlet((1, 1, 1), count // 2)
    on = triangles[random.choice(len(triangles), count // 2, p=area / area.sum())]
    near = np.einsum("ij,ijk->ik", weights, on) + random.normal(0, 1.5 * voxel, (count // 2, 3))
    points = np.concatenate([random.uniform(lower, upper, (count - count // 2, 3)), near])
    np.savetxt(folder / "points.csv", points, delimiter=",", header="x,y,z", comments="", fmt="%.17g")
    subprocess.run([curlew, "-quiet", "-read", "mesh.vdb", "-probe", "points.csv", "values.csv", "order=0"], cwd=folder, check=True)
    values = np.genfromtxt(folder / "values.csv", delimiter=",", names=True)
    inside = values[values.dtype.names[-1]] < 0
    numbers = np.array([winding(triangles, p) for p in points])
    differ = np.flatnonzero(inside != (numbers > 0.5))
    wrong = sum(clear(triangles, points[k], 0.5 * voxel) for k in differ)
    opened = re.search(r"([\d,]+) boundary edges", log)
    return f"| {len(triangles):,} | {opened[1] if opened else 0} | {inside.sum():,} | {len(differ):,} | {wrong} |", wrong


def main(curlew, count="2000"):
    wrong = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        print("| model | triangles | open edges | positions inside | on another side | of these farther than half a voxel |\n|---|---|---|---|---|---|")
        for model, path in models(folder).items():
            row, failed = judged(str(Path(curlew).resolve()), path, int(count), folder)
            wrong += failed
            print(f"| {model} {row}", flush=True)
    return 1 if wrong else 0


sys.exit(main(*sys.argv[1:]))
