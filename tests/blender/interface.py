# SPDX-License-Identifier: Apache-2.0
"""Runs in Blender's interface: presses the panel's button, waits for the bake, and takes a picture of the window.

interface_test.sh starts it; what has gone wrong is written to interface.txt, which else says "fine".
"""

import os
import subprocess
import sys
import traceback
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import support  # noqa: E402

WORK = Path(os.environ["CURLEW_WORK"])
waited = 0
seen = set()


def area(kind):
    """The area of that type in the window."""
    return next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == kind)


def over(where):
    """A context in which operators act there."""
    region = next(r for r in where.regions if r.type == "WINDOW")
    return bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=where, region=region)


def results():
    """The objects of a bake."""
    return [o for o in bpy.data.objects if "curlew_kind" in o]


def press():
    """An object, and the button."""
    support.install()
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    view = area("VIEW_3D")
    with over(view):
        bpy.ops.screen.area_split(direction="HORIZONTAL", factor=0.62)
    with over(area("VIEW_3D")):
        bpy.ops.mesh.primitive_monkey_add()
        bpy.ops.curlew.quick("INVOKE_DEFAULT", preset="SWIRL")
    assert support.addon("bake").running, "the bake does not run in its thread"
    assert not results(), "the bake was not in its thread"


def wait():
    """True while it bakes."""
    global waited
    waited += 1
    assert waited < 600, "the bake does not end"
    return bool(support.addon("bake").running)


def tree():
    """The one at hand."""
    return bpy.data.node_groups[bpy.context.scene.curlew_tree]


def scrub():
    """Through frames that all differ, faster than they are baked."""
    scene = bpy.context.scene
    for node in tree().nodes:
        if node.bl_idname == "CurlewNode_noise":
            node.set_option("seed", f"{{F+{node.o_seed}}}")
    tree().bake_on_frame = True
    assert scene.render.use_lock_interface
    for frame in range(2, 7):
        scene.frame_set(frame)
    assert not support.addon("live").idle()


def settle():
    """True until the last one is there."""
    global waited
    waited += 1
    assert waited < 600, "the frame is not baked"
    if not support.addon("live").idle():
        return True
    assert tree().message.startswith("frame 6 baked"), tree().message
    return False


def film():
    """Three frames, rendered beside the interface."""
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 1, False
    scene.render.resolution_x, scene.render.resolution_y = 32, 24
    scene.frame_start, scene.frame_end = 3, 5
    scene.render.filepath = str(WORK / "film_")
    if scene.camera is None:
        scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        scene.collection.objects.link(scene.camera)
    with over(area("VIEW_3D")):
        bpy.ops.render.render("INVOKE_DEFAULT", animation=True)


def filming():
    """True until they are there."""
    global waited
    waited += 1
    assert waited < 600, "the render does not end"
    for each in bpy.context.window_manager.windows[0].screen.areas:
        each.tag_redraw()
    if bpy.app.is_job_running("RENDER") or not support.addon("live").idle():
        return True
    assert len(list(WORK.glob("film_*.png"))) == 3
    assert seen == {3, 4, 5}, seen
    tree().bake_on_frame = False
    return False


def remember(scene, *_):
    """What is rendered is the bake of its frame."""
    if tree().message.startswith(f"frame {scene.frame_current} baked"):
        seen.add(scene.frame_current)


def start_long():
    """One that would take hours."""
    assert len(results()) == 3, results()
    advect = next(n for n in tree().nodes if n.bl_idname == "CurlewNode_advect")
    advect.set_option("steps", "100000000")
    with over(area("VIEW_3D")):
        bpy.ops.curlew.bake("INVOKE_DEFAULT")


def press_escape():
    """In the window, while it runs."""
    assert support.addon("bake").running, tree().message
    window = bpy.context.window_manager.windows[0]
    for value in ("PRESS", "RELEASE"):
        window.event_simulate(type="ESC", value=value, x=window.width // 2, y=window.height // 2)


def arrange():
    """The tree below the view."""
    assert tree().message == "cancelled", tree().message
    tree().message = ""
    assert len(results()) == 3
    views = sorted((a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D"), key=lambda a: a.y)
    views[0].ui_type = "CurlewTree"
    views[0].spaces.active.node_tree = tree()
    views[0].spaces.active.show_region_ui = False


def enlarge():
    """The tree alone."""
    with over(area("NODE_EDITOR")):
        bpy.ops.screen.screen_full_area()


def look():
    """All of it."""
    with over(area("NODE_EDITOR")):
        bpy.ops.node.select_all(action="DESELECT")
        bpy.ops.node.view_all()


def picture():
    """Of the window."""
    subprocess.run(["import", "-window", "root", str(WORK / "interface.png")], check=True)


def leave():
    """In the midst of a bake."""
    tree().bake_on_frame = True
    bpy.context.scene.frame_set(20)


def run():
    """One step after the other, with time for the window to draw."""
    try:
        if steps_left and steps_left[0] in (wait, settle, filming):
            if steps_left[0]():
                return 0.1
            steps_left.pop(0)
        elif steps_left:
            steps_left.pop(0)()
        if steps_left:
            return 1.5
        if not support.addon("live")._jobs:
            return 0.01  # the bake begins
        (WORK / "interface.txt").write_text("fine\n")
    except BaseException:
        (WORK / "interface.txt").write_text(traceback.format_exc())
    bpy.ops.wm.quit_blender()
    return None


steps_left = [press, wait, scrub, settle, film, filming, start_long, press_escape, wait, arrange, enlarge, look, picture, leave]
bpy.context.preferences.view.show_splash = False
bpy.context.preferences.view.render_display_type = "NONE"  # no window over the picture
bpy.app.handlers.render_post.append(remember)
bpy.app.timers.register(run, first_interval=1.5)
