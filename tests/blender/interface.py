# SPDX-License-Identifier: Apache-2.0
"""Runs in Blender's interface: presses the panel's button, waits for the bake, and takes a picture of the window.

interface_test.sh starts this script. It writes "fine" to interface.txt, or the traceback of the error.
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
    """Returns the area of this type in the window."""
    return next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == kind)


def over(where):
    """Returns a context in which operators act on an area."""
    region = next(r for r in where.regions if r.type == "WINDOW")
    return bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=where, region=region)


def results():
    """Returns the objects that the bake has created."""
    return [o for o in bpy.data.objects if "curlew_kind" in o]


def press():
    """Adds an object and presses the button."""
    support.install()
    support.reduce_presets()
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    view = area("VIEW_3D")
    with over(view):
        bpy.ops.screen.area_split(direction="HORIZONTAL", factor=0.62)
    with over(area("VIEW_3D")):
        bpy.ops.mesh.primitive_monkey_add()
        bpy.ops.curlew.quick("INVOKE_DEFAULT", preset="WAKE")  # not a sequence
    assert support.addon("bake").running, "the bake does not run in its thread"
    assert not results(), "the bake was not in its thread"


def wait():
    """Returns True while the bake runs."""
    global waited
    waited += 1
    assert waited < 600, "the bake does not end"
    return bool(support.addon("bake").running)


def tree():
    """Returns the current tree."""
    return bpy.data.node_groups[bpy.context.scene.curlew_tree]


def scrub():
    """Changes frames faster than they can be baked. All frames differ."""
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
    """Returns True until the last frame is baked."""
    global waited
    waited += 1
    assert waited < 600, "the frame is not baked"
    if not support.addon("live").idle():
        return True
    assert tree().message.startswith("frame 6 baked"), tree().message
    return False


def film():
    """Starts rendering three frames while the interface stays open."""
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
    """Returns True until they are rendered."""
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
    """Records each rendered frame that shows its own bake."""
    if tree().message.startswith(f"frame {scene.frame_current} baked"):
        seen.add(scene.frame_current)


def start_long():
    """Starts a bake that would take minutes."""
    assert len(results()) == 1, results()
    for node in tree().nodes:
        if node.bl_idname == "CurlewNode_scatter":
            node.set_option("count", "100000")
        if node.bl_idname == "CurlewNode_noise":
            node.set_option("octaves", "32")
    with over(area("VIEW_3D")):
        bpy.ops.curlew.bake("INVOKE_DEFAULT")


def press_escape():
    """Presses Escape in the window while the bake runs."""
    assert support.addon("bake").running, tree().message
    window = bpy.context.window_manager.windows[0]
    for value in ("PRESS", "RELEASE"):
        window.event_simulate(type="ESC", value=value, x=window.width // 2, y=window.height // 2)


def arrange():
    """Shows the tree below the 3D view."""
    assert tree().message == "cancelled", tree().message
    tree().message = ""
    assert len(results()) == 1
    views = sorted((a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D"), key=lambda a: a.y)
    views[0].ui_type = "CurlewTree"
    views[0].spaces.active.node_tree = tree()
    views[0].spaces.active.show_region_ui = False


def enlarge():
    """Makes the node editor full screen."""
    with over(area("NODE_EDITOR")):
        bpy.ops.screen.screen_full_area()


def look():
    """Shows the whole tree."""
    with over(area("NODE_EDITOR")):
        bpy.ops.node.select_all(action="DESELECT")
        bpy.ops.node.view_all()


def picture():
    """Takes a picture of the window, once it is drawn."""
    bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)
    subprocess.run(["import", "-window", "root", str(WORK / "interface.png")], check=True)


def leave():
    """Starts a bake, so that Blender quits while it runs."""
    tree().bake_on_frame = True
    bpy.context.scene.frame_set(20)


def run():
    """Runs the steps one after the other, with time for events between them."""
    try:
        if steps_left and steps_left[0] in (wait, settle, filming):
            if steps_left[0]():
                return 0.1
            steps_left.pop(0)
        elif steps_left:
            steps_left.pop(0)()
        if steps_left:
            return 0.3  # for events
        if not support.addon("live")._jobs:
            return 0.01  # waits for the bake to begin
        (WORK / "interface.txt").write_text("fine\n")
    except BaseException:
        (WORK / "interface.txt").write_text(traceback.format_exc())
    bpy.ops.wm.quit_blender()
    return None


steps_left = [press, wait, scrub, settle, film, filming, start_long, press_escape, wait, arrange, enlarge, look, picture, leave]
bpy.context.preferences.view.show_splash = False
bpy.context.preferences.view.smooth_view = 0  # views change at once
bpy.context.preferences.view.render_display_type = "NONE"  # no render window in the picture
bpy.app.handlers.render_post.append(remember)
bpy.app.timers.register(run, first_interval=0.5)
