# SPDX-License-Identifier: Apache-2.0
"""Times the add-on's preview: 2,000 particles of each preset around Suzanne after a change of one option.

    CURLEW_LIBRARY=build/libcurlew.so blender --background --factory-startup -noaudio --python-exit-code 3 \\
        --python bench/blender_preview.py -- [--addon plugin/blender] [--rounds 15] [--json FILE]

Without --background, but with xvfb-run where there is no display, the times are those that a user waits: Blender first
redraws its window, and then calls the add-on's timer.

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
import traceback
from pathlib import Path

import bpy

HERE = Path(__file__).resolve().parent
LONGEST = 60  # seconds for a preview to appear
ACTIONS = {"noise", "bound", "dfvn", "wind"}  # whose options are changed

# The options, with their values in round k for an object of size 2, and for a node with this number.
CHANGES = {
    "frequency": lambda k, _: 1.5 + 0.01 * k,
    "seed": lambda k, number: 1000 * number + 10 + k,  # not the same for two noises
    "layer": lambda k, _: 0.2 + 0.01 * k,
    "speed": lambda k, _: 1 + 0.01 * k,
}


def suzanne():
    """Returns Blender's monkey without holes."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_monkey_add()
    obj = bpy.data.objects["Suzanne"]
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


def timed(preview, tree, change, rounds, medians, name):
    """Measures previews after changes; yields where Blender must go on before the preview appears."""
    taken = []
    shown_at = []
    shows = preview.show

    def watched(*arguments):
        shown = shows(*arguments)
        assert len(shown.data.vertices) == preview.PARTICLES
        shown_at.append(time.perf_counter())
        return shown

    preview.show = watched
    for k in range(rounds + 1):
        shown_at.clear()
        began, used = time.perf_counter(), time.process_time()
        change(k)
        if bpy.app.background:
            preview.show(tree, bpy.context.scene)
        while not shown_at:
            if time.perf_counter() - began > LONGEST:
                raise TimeoutError(f"{name}: no preview within {LONGEST} s")
            yield
        taken.append((1000 * (shown_at[0] - began), 1000 * (time.process_time() - used)))
    preview.show = shows
    median = tuple(statistics.median(column) for column in zip(*taken[1:]))  # the first may follow another change
    medians[name] = max(medians.get(name, (0, 0)), median)


class Rounds(bpy.types.Operator):
    """Goes on with the measurements whenever Blender handles an event of its timer."""

    bl_idname, bl_label = "curlew.bench_rounds", "Measure previews"
    rounds = None

    def modal(self, context, event):
        """Goes on with the measurements."""
        if event.type == "TIMER":
            try:
                next(Rounds.rounds)
                return {"RUNNING_MODAL"}
            except StopIteration:
                pass
            except Exception:  # Blender would stay open
                traceback.print_exc()
            bpy.ops.wm.quit_blender()
            return {"FINISHED"}
        return {"RUNNING_MODAL"}

    def invoke(self, context, _event):
        """Starts the timer."""
        context.window_manager.event_timer_add(0.1, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}


def start():
    """Starts the measurements in the window."""
    window = bpy.context.window_manager.windows[0]
    bpy.utils.register_class(Rounds)
    with bpy.context.temp_override(window=window):
        bpy.ops.curlew.bench_rounds("INVOKE_DEFAULT")


def measurements(obj, options):
    """Measures all presets and prints the medians; yields like timed()."""
    import curlew_blender
    from curlew_blender import library, presets, preview

    curlew_blender.register()
    print(f"{library.curlew().version()}; {options.addon}")
    medians = {}
    for name in presets.PRESETS:
        tree = presets.make(name, obj)
        tree.preview = "POINTS"
        for what, value in CHANGES.items():
            case = f"{name} {what}"
            for number, node in enumerate(nodes_of(tree)):
                if any(option.name == what for option in node.action.options):
                    yield from timed(
                        preview, tree, lambda k: node.set_option(what, f"{value(k, number):.9g}"), options.rounds, medians,
                        case)
            if case in medians:
                wall, used = medians[case]
                print(f"preview of {name:8} {what + ':':10} {wall:7.1f} ms, {used:7.1f} ms of processor time", flush=True)
    if options.json:
        options.json.write_text(json.dumps(medians, indent=1))
    curlew_blender.unregister()


def main():
    """Runs the benchmark."""
    parser = argparse.ArgumentParser(prog="blender_preview.py")
    parser.add_argument("--addon", type=Path, default=HERE.parent / "plugin/blender", help="the folder of curlew_blender")
    parser.add_argument("--rounds", type=int, default=15, help="number of changes of each option")
    parser.add_argument("--json", type=Path, help="JSON file for all numbers")
    options = parser.parse_args(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else [])
    sys.path.insert(0, str(options.addon.resolve()))
    rounds = measurements(suzanne(), options)
    if bpy.app.background:
        for _ in rounds:
            pass
    else:
        Rounds.rounds = rounds
        bpy.app.timers.register(start, first_interval=1)  # when there is a window


main()
