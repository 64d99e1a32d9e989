#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Renders the presets of the Blender add-on for the documentation, with the add-on installed:

    blender --background --factory-startup --python tools/blender_pictures.py -- FOLDER [--films] [PRESET]...

Writes FOLDER/PRESET.png, or with --films every other frame, for tools/film.py.
"""

import math
import sys
from pathlib import Path

import bpy

SIZE, FILM = (480, 360), (240, 180)
FRAMES = 48
VIEWS = {  # preset: camera, what it looks at, its lens
    "SWIRL": ((0, -5.2, 0.6), (0, 0, 0), 50),
    "WIND": ((0.3, -5.6, 1.2), (0.2, 0, 0), 42),
    "WAKE": ((0.3, -5.6, 1.2), (0.2, 0, 0), 42),
    "DUST": ((0.9, -6.2, 0.8), (0.9, 0, 0.2), 42),
    "SURFACE": ((0, -4.8, 0.4), (0, 0, 0), 50),
    "GLOBE": ((0, -5.0, 1.2), (0, 0, 0), 50),
    "SMOKE": ((0, -9.0, 1.6), (0, 0, 1.0), 42),
    "SHOT": ((0.9, -6.2, 0.8), (0.9, 0, 0.2), 42),
}


def towards(obj, target):
    """Turns a camera or a lamp to a point."""
    from mathutils import Vector

    obj.rotation_euler = (Vector(target) - obj.location).to_track_quat("-Z", "Y").to_euler()


def lamp(name, location, energy, color):
    """Adds an area lamp."""
    obj = bpy.data.objects.new(name, bpy.data.lights.new(name, "AREA"))
    obj.location, obj.data.energy, obj.data.color, obj.data.size = location, energy, color, 3
    towards(obj, (0, 0, 0))
    bpy.context.scene.collection.objects.link(obj)


def stage(preset):
    """Adds the monkey, a camera and lamps. Returns the scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="curlew_blender")
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, FRAMES
    bpy.ops.mesh.primitive_monkey_add(rotation=(0, 0, 0.5))
    monkey = bpy.context.active_object
    bpy.ops.object.shade_smooth()
    smooth = monkey.modifiers.new("smooth", "SUBSURF")
    smooth.levels = smooth.render_levels = 2
    clay = bpy.data.materials.new("clay")
    clay.use_nodes = True
    shader = clay.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (0.12, 0.12, 0.14, 1)
    shader.inputs["Roughness"].default_value = 0.6
    monkey.data.materials.append(clay)
    scene.world = bpy.data.worlds.new("dark")
    scene.world.color = (0.02, 0.025, 0.035)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    location, target, lens = VIEWS[preset]
    camera.location, camera.data.lens = location, lens
    towards(camera, target)
    scene.collection.objects.link(camera)
    scene.camera = camera
    lamp("key", (3, -4, 5), 500, (1, 0.95, 0.9))
    lamp("rim", (-4, 3, 3), 400, (0.6, 0.75, 1))
    scene.render.engine = "CYCLES"
    scene.cycles.use_denoising = False
    scene.render.resolution_percentage = 100
    scene.view_settings.view_transform = "Standard"
    bpy.context.view_layer.objects.active = monkey
    return scene


def render(scene, path, size, samples):
    """Renders the current frame."""
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.cycles.samples = samples
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


def main(folder, presets, films):
    """Renders the presets, or the frames of their films."""
    for preset in presets or VIEWS:
        scene = stage(preset)
        bpy.ops.curlew.quick(preset=preset)
        monkey = bpy.data.objects["Suzanne"]
        inside = monkey.display_type == "WIRE"
        monkey.hide_render = inside or preset == "GLOBE"
        for frame in range(1, FRAMES + 1, 2) if films else [FRAMES // 2]:
            scene.frame_set(frame)
            name = f"{preset.lower()}.{frame:04d}.png" if films else f"{preset.lower()}.png"
            render(scene, folder / name, FILM if films else SIZE, 12 if films else 48)


arguments = sys.argv[sys.argv.index("--") + 1:]
main(Path(arguments[0]).resolve(), [name for name in arguments[1:] if name != "--films"], "--films" in arguments)
