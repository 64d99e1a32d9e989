# SPDX-License-Identifier: Apache-2.0
"""Times the add-on's preview: 2,000 particles around Suzanne after a change of one option of a noise.

    CURLEW_LIBRARY=build/libcurlew.so blender --background --factory-startup -noaudio --python-exit-code 3 \\
        --python bench/blender_preview.py -- [--addon plugin/blender] [--rounds 15] [--json FILE]

The mesh is Blender's monkey, with its holes closed by a voxel remesh. Each round sets an option to a value that it has
not had before, and measures the time until the preview's object has its new points: reading the tree, evaluating the
graph, filling the object. Prints medians in milliseconds for each option: wall time, and the processor time of all
threads, which is more reliable if other processes use the processor.
"""

import argparse
import json
import statistics
import sys
import time
from pathlib import Path

import bpy

HERE = Path(__file__).resolve().parent


def suzanne():
    """Returns Blender's monkey without holes."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_monkey_add()
    obj = bpy.context.active_object
    remesh = obj.modifiers.new("closed", "REMESH")
    remesh.mode, remesh.voxel_size = "VOXEL", 0.06
    return obj


def tree_around(obj):
    """Creates a flow around the object from two noises, one of which conforms to it. Returns the tree, and its nodes by
    role."""
    tree = bpy.data.node_groups.new("preview", "CurlewTree")
    made = {}

    def add(name, action, *inputs, **options):
        node = made[name] = tree.nodes.new(action if action.startswith("Curlew") else f"CurlewNode_{action}")
        for source, socket in zip(inputs, node.inputs):
            tree.links.new(made[source].outputs[0], socket)
        for option, value in options.items():
            node.set_option(option, value)

    add("mesh", "CurlewMeshObject")
    made["mesh"].object = obj
    add("hull", "mesh2ls", "mesh", dim="96")
    add("f", "noise", frequency="1.5", octaves="2", seed="1")
    add("g", "noise", frequency="1.5", octaves="2", seed="2")
    add("along", "bound", "g", "hull", side="outside", layer="0.2")
    add("flow", "dfvn", "f", "along", speed="1")
    add("points", "scatter", "flow", count="20000")
    add("moved", "advect", "flow", "points")
    add("result", "CurlewParticlesResult", "moved")
    tree.preview = "POINTS"
    return tree, made


# The options that are changed, with their values in round k.
CHANGES = {
    "frequency of the free noise": ("f", "frequency", lambda k: 1.5 + 0.01 * k),
    "seed of the noise at the wall": ("g", "seed", lambda k: 10 + k),
    "speed of the flow": ("flow", "speed", lambda k: 1 + 0.01 * k),
    "nothing": ("f", "octaves", lambda k: 2),
}


def main():
    """Runs the benchmark and prints the medians."""
    parser = argparse.ArgumentParser(prog="blender_preview.py")
    parser.add_argument("--addon", type=Path, default=HERE.parent / "plugin/blender", help="the folder of curlew_blender")
    parser.add_argument("--rounds", type=int, default=15, help="number of changes of each option")
    parser.add_argument("--json", type=Path, help="JSON file for all numbers")
    options = parser.parse_args(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else [])
    sys.path.insert(0, str(options.addon.resolve()))
    import curlew_blender
    from curlew_blender import library, preview

    obj = suzanne()
    curlew_blender.register()
    tree, made = tree_around(obj)
    scene, medians = bpy.context.scene, {}
    for what, (node, option, value) in CHANGES.items():
        taken = []
        for k in range(options.rounds + 1):
            began, used = time.perf_counter(), time.process_time()
            made[node].set_option(option, f"{value(k):.9g}")
            shown = preview.show(tree, scene)
            taken.append((1000 * (time.perf_counter() - began), 1000 * (time.process_time() - used)))
            assert len(shown.data.vertices) == preview.PARTICLES
        medians[what] = taken[1:]  # the first may follow a change of another option
    print(f"{library.curlew().version()}; {options.addon}")
    for what, taken in medians.items():
        wall, used = (statistics.median(column) for column in zip(*taken))
        print(f"preview, {what + ':':32} {wall:7.1f} ms, {used:7.1f} ms of processor time")
    if options.json:
        options.json.write_text(json.dumps(medians, indent=1))
    curlew_blender.unregister()


main()
