# SPDX-License-Identifier: Apache-2.0
"""Compares ways to follow a real solver's velocities: smoke around a ball by Mantaflow, in Blender.

    solver.py CURLEW [RESOLUTION ...]

Blender simulates 40 frames of smoke in a closed box of 64 and 96 voxels (by default). Points that are uniform in the air then follow
the velocities of the last frame, which are held constant, for 100 frames. They move by a voxel in each frame on average, in one RK4
step. Columns: points in the ball, points that have left the box, the mean distance to the nearest point relative to the start (points in
the ball and outside the box left out), and the time of the whole command. Writes a table in Markdown, and exits with 1 if the flow with
potentials lost a point or changed the mean distance by more than 5 %.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

RADIUS, CENTRE = 0.6, (0.1, 0.05, 2.2)  # of the ball, in a box of edge 4
POINTS, FRAMES = 20_000, 100
BAKE = f"""
import bpy, os, sys
resolution, folder = int(sys.argv[-2]), sys.argv[-1]
bpy.ops.wm.read_factory_settings(use_empty=True)
add = bpy.ops.mesh
add.primitive_uv_sphere_add(radius=0.6, location=(0, 0, 0.8))
source = bpy.context.object
add.primitive_uv_sphere_add(segments=64, ring_count=32, radius={RADIUS}, location={CENTRE})
ball = bpy.context.object
add.primitive_cube_add(size=4, location=(0, 0, 2))
box = bpy.context.object
def fluid(item, kind):
    modifier = item.modifiers.new("Fluid", "FLUID")
    modifier.fluid_type = kind
    return modifier
flow = fluid(source, "FLOW").flow_settings
flow.flow_type, flow.flow_behavior, flow.temperature = "SMOKE", "INFLOW", 2
flow.use_initial_velocity, flow.velocity_coord = True, (0, 0, 2)
fluid(ball, "EFFECTOR").effector_settings.effector_type = "COLLISION"
domain = fluid(box, "DOMAIN").domain_settings
domain.cache_directory = folder
domain.domain_type, domain.resolution_max, domain.use_adaptive_domain = "GAS", resolution, False
for side in "front", "back", "left", "right", "top", "bottom":
    setattr(domain, f"use_collision_border_{{side}}", True)
domain.openvdb_data_depth = "32"
domain.cache_data_format, domain.cache_frame_end, domain.cache_type, domain.clipping = "OPENVDB", 40, "ALL", 0
with bpy.context.temp_override(object=box, active_object=box):
    bpy.ops.fluid.bake_all()
"""
WAYS = {  # of -flow, and of -advect
    "trilinear": ("", ""),
    "tricubic": ("interpolation=cubic", ""),
    "potentials, as a whole": ("exact=1 wall=ball", ""),
    "potentials, term by term": ("exact=1 wall=ball", "splitting=strang"),
}


def bake(resolution, folder):
    """Returns the file of the last frame."""
    cache = folder / f"cache{resolution}"
    cache.mkdir()
    subprocess.run(["blender", "-b", "--factory-startup", "--python-exit-code", "1", "--python-expr", BAKE, "--", str(resolution),
                    str(cache)], check=True, capture_output=True, timeout=3000)
    return cache / "data/fluid_data_0040.vdb"


def nearest(points):
    """Returns the mean distance to the nearest point, by a grid of cells."""
    cell = 1.5 * (np.ptp(points, axis=0).prod() / len(points)) ** (1 / 3)
    keys = np.floor(points / cell).astype(int)
    cells = {}
    for index, key in enumerate(map(tuple, keys)):
        cells.setdefault(key, []).append(index)
    total = 0.0
    for index, key in enumerate(map(tuple, keys)):
        reach = 1
        while True:
            near = [k for i in range(-reach, reach + 1) for j in range(-reach, reach + 1) for l in range(-reach, reach + 1)
                    for k in cells.get((key[0] + i, key[1] + j, key[2] + l), ()) if k != index]
            distance = np.sqrt(((points[near] - points[index]) ** 2).sum(axis=1).min()) if near else np.inf
            if distance <= reach * cell:
                break
            reach += 1
        total += distance
    return total / len(points)


def main():
    curlew = Path(sys.argv[1]).resolve()
    resolutions = [int(text) for text in sys.argv[2:]] or [64, 96]
    good = True
    print("| voxels | followed | in the ball | outside the box | distance to the nearest point | seconds |\n|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)

        def run(program):
            subprocess.run([curlew, "-quiet", *program.split()], cwd=folder, check=True)

        for resolution in resolutions:
            grid = bake(resolution, folder)
            # The voxels begin at the lower corner of Blender's box, which is at -2, -2, 0.
            ball = f"-sphere radius={RADIUS} translate={CENTRE[0] + 2},{CENTRE[1] + 2},{CENTRE[2]} as=ball"
            read = f"-read {grid} grids=velocity -flow"
            run(f"{ball} {read} exact=1 wall=ball -check report=check.json -scatter count={POINTS} "
                "-write start.npz start.bgeo")
            speed = json.loads((folder / "check.json").read_text())["rms_speed"]
            voxel = 4 / resolution
            duration = FRAMES * voxel / speed
            first = np.load(folder / "start.npz")["P"]
            lower, upper = first.min(axis=0) - voxel, first.max(axis=0) + voxel
            before = None
            for way, (flow, advect) in WAYS.items():
                began = time.perf_counter()
                run(f"{ball} {read} {flow} -read start.bgeo -advect duration={duration} steps={FRAMES} {advect} -write end.npz")
                took = time.perf_counter() - began
                end = np.load(folder / "end.npz")["P"]
                in_ball = np.linalg.norm(end - [CENTRE[0] + 2, CENTRE[1] + 2, CENTRE[2]], axis=1) < RADIUS
                left = ((end < lower) | (end > upper)).any(axis=1)
                before = before or nearest(first)
                ratio = nearest(end[~in_ball & ~left]) / before
                print(f"| {resolution}³ | {way} | {in_ball.sum()} | {left.sum()} | {ratio:.3f} | {took:.2f} |", flush=True)
                good &= not way.startswith("potentials") or (not in_ball.any() and not left.any() and abs(ratio - 1) < 0.05)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
