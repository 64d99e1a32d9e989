# SPDX-License-Identifier: Apache-2.0
"""Times the add-on's preview: 2,000 particles of each preset around Suzanne after a change of one option.

    CURLEW_LIBRARY=build/libcurlew.so blender --background --factory-startup -noaudio --python-exit-code 3 \\
        --python bench/blender_preview.py -- [--addon plugin/blender] [--rounds 15] [--json FILE]

The mesh is Blender's monkey, with its holes closed by a voxel remesh. Each round sets an option to a value that it has
not had before, and measures the time until the preview's object has its new points: reading the tree, evaluating the
graph, filling the object. Prints, for each preset and option, the medians in milliseconds of the node that takes
longest: wall time, and the processor time of all threads, which is more reliable if other processes use the processor.
"""

import argparse
import json
import statistics
import sys
import time
from pathlib import Path

import bpy

HERE = Path(__file__).resolve().parent
ACTIONS = {"noise", "bound", "dfvn", "wind"}  # whose options are changed

# The options, with their values in round k for an object of size 2.
CHANGES = {
    "frequency": lambda k: 1.5 + 0.01 * k,
    "seed": lambda k: 10 + k,
    "layer": lambda k: 0.2 + 0.01 * k,
    "speed": lambda k: 1 + 0.01 * k,
}


def suzanne():
    """Returns Blender's monkey without holes."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_monkey_add()
    obj = bpy.context.active_object
    remesh = obj.modifiers.new("closed", "REMESH")
    remesh.mode, remesh.voxel_size = "VOXEL", 0.06
    return obj


def nodes_of(tree):
    """Returns the nodes of a tree and of its groups whose options are changed."""
    found = [node for node in tree.nodes if getattr(node, "action", None) and node.action.name in ACTIONS]
    for node in tree.nodes:
        if getattr(node, "node_tree", None):
            found += nodes_of(node.node_tree)
    return found


def timed(preview, tree, change, rounds):
    """Returns the median wall and processor time of a preview after a change, in milliseconds."""
    taken = []
    for k in range(rounds + 1):
        change(k)
        began, used = time.perf_counter(), time.process_time()
        shown = preview.show(tree, bpy.context.scene)
        taken.append((1000 * (time.perf_counter() - began), 1000 * (time.process_time() - used)))
        assert len(shown.data.vertices) == preview.PARTICLES
    return tuple(statistics.median(column) for column in zip(*taken[1:]))  # the first may follow another change


def main():
    """Runs the benchmark and prints the medians."""
    parser = argparse.ArgumentParser(prog="blender_preview.py")
    parser.add_argument("--addon", type=Path, default=HERE.parent / "plugin/blender", help="the folder of curlew_blender")
    parser.add_argument("--rounds", type=int, default=15, help="number of changes of each option")
    parser.add_argument("--json", type=Path, help="JSON file for all numbers")
    options = parser.parse_args(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else [])
    sys.path.insert(0, str(options.addon.resolve()))
    import curlew_blender
    from curlew_blender import library, presets, preview

    obj = suzanne()
    curlew_blender.register()
    print(f"{library.curlew().version()}; {options.addon}")
    medians = {}
    for name in presets.PRESETS:
        tree = presets.make(name, obj)
        tree.preview = "POINTS"
        for what, value in CHANGES.items():
            taken = [
                timed(preview, tree, lambda k, node=node: node.set_option(what, f"{value(k):.9g}"), options.rounds)
                for node in nodes_of(tree)
                if any(option.name == what for option in node.action.options)
            ]
            if not taken:
                continue
            medians[f"{name} {what}"] = wall, used = max(taken)
            print(f"preview of {name:8} {what + ':':10} {wall:7.1f} ms, {used:7.1f} ms of processor time", flush=True)
    if options.json:
        options.json.write_text(json.dumps(medians, indent=1))
    curlew_blender.unregister()


main()
