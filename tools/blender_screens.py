#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Takes the screenshots of the Blender add-on for the documentation, in Blender's interface. Called by blender_pictures.sh:
blender --factory-startup --python tools/blender_screens.py -- FOLDER
"""

import subprocess
import sys
import traceback
from pathlib import Path

import bpy

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])


def area(kind):
    """Returns the largest area of this type."""
    return max((a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == kind), key=lambda a: a.width * a.height)


def over(where):
    """Returns a context in which operators act on an area."""
    region = next(r for r in where.regions if r.type == "WINDOW")
    return bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=where, region=region)


def take(name):
    """Takes a picture of the window."""
    subprocess.run(["import", "-window", "root", str(FOLDER / f"{name}.png")], check=True)


def prepare():
    """Shows a monkey with a result and the panel in the 3D view."""
    bpy.ops.preferences.addon_enable(module="curlew_blender")
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    scene = bpy.context.scene
    scene.frame_end = 24
    view = area("VIEW_3D")
    with over(view):
        bpy.ops.mesh.primitive_monkey_add(rotation=(0, 0, 0.5))
        bpy.ops.object.shade_smooth()
        bpy.context.active_object.modifiers.new("smooth", "SUBSURF").levels = 2
        scene.curlew_preset = "SURFACE"
        bpy.ops.curlew.quick(preset="SURFACE")
        bpy.ops.view3d.view_axis(type="FRONT")
        bpy.ops.view3d.view_selected()
    space = view.spaces.active
    space.shading.color_type = "MATERIAL"
    space.overlay.show_overlays = False
    space.show_gizmo = False
    space.show_region_ui = True
    scene.frame_set(12)


def tab(event, value):
    """Returns a step that sends an event at the tab of the panel, as Blender has no other way to choose it."""

    def send():
        region = next(r for r in area("VIEW_3D").regions if r.type == "UI")
        bpy.context.window_manager.windows[0].event_simulate(
            type=event, value=value, x=region.x + region.width - 12, y=region.y + region.height - 165)

    return send


def take_panel():
    """Takes a picture of the 3D view and its panel."""
    take("panel")


def show_nodes():
    """Shows the parts of a shot in a node editor as large as the window."""
    obj = bpy.data.objects["Suzanne"]
    with over(area("VIEW_3D")):
        bpy.context.view_layer.objects.active = obj
        bpy.ops.curlew.quick(preset="SHOT", bake=False)
    view = area("VIEW_3D")
    view.ui_type = "CurlewTree"
    view.spaces.active.node_tree = bpy.data.node_groups[bpy.context.scene.curlew_tree]
    view.spaces.active.show_region_ui = False
    with over(view):
        bpy.ops.screen.screen_full_area()


def look():
    """Shows the whole tree."""
    with over(area("NODE_EDITOR")):
        bpy.ops.node.select_all(action="DESELECT")
        bpy.ops.node.view_all()


def take_nodes():
    """Takes a picture of the nodes."""
    take("nodes")


clicks = [("MOUSEMOVE", "NOTHING"), ("LEFTMOUSE", "PRESS"), ("LEFTMOUSE", "RELEASE")]
steps = [prepare, *(tab(*click) for click in clicks), take_panel, show_nodes, look, take_nodes]


def run():
    """Runs the steps one after the other, with time for the window to draw."""
    try:
        steps.pop(0)()
        if steps:
            return 2.0
    except BaseException:
        traceback.print_exc()
    bpy.ops.wm.quit_blender()
    return None


bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(run, first_interval=2.0)
