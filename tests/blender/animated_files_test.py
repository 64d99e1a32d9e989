# SPDX-License-Identifier: Apache-2.0
"""Animated .fbx and .glb files that Blender writes: -read samples their skins and shape keys as Blender does."""

import math
import subprocess
import sys
import unittest
from pathlib import Path

import addon_utils
import bpy
import numpy as np
from mathutils.kdtree import KDTree

sys.path.insert(0, str(Path(__file__).parent))
import support  # noqa: E402

FRAMES = range(1, 26)
LOOKED_AT = (1, 7, 13, 20, 25)


def bending_bar():
    """Adds a bar with two bones, the upper of which swings once in FRAMES."""
    bpy.ops.mesh.primitive_cylinder_add(vertices=12, radius=0.2, depth=2, location=(0, 0, 1))
    bar = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.subdivide(number_cuts=6)
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.ops.object.transform_apply(location=True)
    bones = bpy.data.armatures.new("bones")
    rig = bpy.data.objects.new("rig", bones)
    bpy.context.scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    lower, upper = bones.edit_bones.new("lower"), bones.edit_bones.new("upper")
    lower.head, lower.tail = (0, 0, 0), (0, 0, 1)
    upper.head, upper.tail = (0, 0, 1), (0, 0, 2)
    upper.parent = lower
    bpy.ops.object.mode_set(mode="OBJECT")
    groups = {name: bar.vertex_groups.new(name=name) for name in ("lower", "upper")}
    for vertex in bar.data.vertices:
        share = min(max((vertex.co.z - 0.6) / 0.8, 0), 1)
        groups["upper"].add([vertex.index], share, "REPLACE")
        groups["lower"].add([vertex.index], 1 - share, "REPLACE")
    bar.modifiers.new("bones", "ARMATURE").object = rig
    bar.parent = rig
    swings = rig.pose.bones["upper"]
    swings.rotation_mode = "XYZ"
    for frame in FRAMES:
        swings.rotation_euler = (1.2 * math.sin((frame - 1) / 24 * 2 * math.pi), 0, 0)
        swings.keyframe_insert("rotation_euler", frame=frame)
    return bar


def growing_ball():
    """Adds a ball with a shape key that makes it taller."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=8, radius=0.5, location=(2, 0, 0.5))
    ball = bpy.context.object
    ball.shape_key_add(name="Basis")
    tall = ball.shape_key_add(name="tall")
    for point in tall.data:
        point.co.z *= 2
    for frame, value in ((1, 0), (13, 1), (25, 0.25)):
        tall.value = value
        tall.keyframe_insert("value", frame=frame)
    return ball


def points_in_blender(objects, start=FRAMES[0]):
    """Returns the world positions of the vertices in each of LOOKED_AT, with Y up, of an animation from frame `start`."""
    points = {}
    for frame in LOOKED_AT:
        bpy.context.scene.frame_set(frame - FRAMES[0] + start)
        graph = bpy.context.evaluated_depsgraph_get()
        points[frame] = np.array([(p.x, p.z, -p.y) for obj in objects
                                  for p in (obj.matrix_world @ v.co for v in obj.evaluated_get(graph).data.vertices)])
    return points


def vertices_of(path):
    """Returns the vertices of a binary .ply mesh with float positions."""
    header, _, data = path.read_bytes().partition(b"end_header\n")
    count = int(header.split(b"element vertex ")[1].split()[0])
    return np.frombuffer(data, "<f4", 3 * count).reshape(count, 3)


def points_in_curlew(file):
    """Returns the same as the command reads them."""
    subprocess.run([support.COMMAND, "-quiet", "-frames", "1-25", "fps=24", "-read", file, "-write", "read.$F.ply"],
                   check=True, cwd=support.WORK, timeout=120)
    return {frame: vertices_of(support.WORK / f"read.{frame}.ply") for frame in LOOKED_AT}


def farthest(points, others):
    """Returns the largest distance of a point to the closest of other points."""
    tree = KDTree(len(others))
    for k, other in enumerate(others):
        tree.insert(other, k)
    tree.balance()
    return max(tree.find(point)[2] for point in points)


def apart(a, b):
    """Returns the largest distance of a point of either set to the other set. (Exporters split and reorder vertices.)"""
    return max(farthest(a, b), farthest(b, a))


class AnimatedFiles(unittest.TestCase):
    def setUp(self):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        scene.render.fps, scene.frame_start, scene.frame_end = 24, FRAMES[0], FRAMES[-1]

    def same(self, objects, file, start=FRAMES[0]):
        theirs, ours = points_in_blender(objects, start), points_in_curlew(file)
        self.assertGreater(apart(theirs[1], theirs[7]), 0.2, "nothing moves")
        for frame in LOOKED_AT:
            self.assertLess(apart(theirs[frame], ours[frame]), 1e-5, f"{file}, frame {frame}")

    def test_fbx_with_a_skin_and_a_shape_key(self):
        addon_utils.enable("io_scene_fbx")
        objects = [bending_bar(), growing_ball()]
        bpy.ops.export_scene.fbx(filepath=str(support.WORK / "rig.fbx"), use_mesh_modifiers=False)
        self.same(objects, "rig.fbx")

    def test_glb_with_a_skin(self):
        addon_utils.enable("io_scene_gltf2")
        objects = [bending_bar()]
        bpy.ops.export_scene.gltf(filepath=str(support.WORK / "rig.glb"))
        self.same(objects, "rig.glb")

    def test_glb_with_weights_in_bytes(self):
        addon_utils.enable("io_scene_gltf2")
        np.bool = bool  # the importer of Blender 3.4 uses a name that NumPy has removed
        walker = str(support.SOURCE / "scenes/walker.glb")
        bpy.ops.import_scene.gltf(filepath=walker)
        bpy.data.objects["root"].animation_data.action = next(a for a in bpy.data.actions if a.name.startswith("walk"))
        self.same([bpy.data.objects["body"]], walker, start=0)


support.main(AnimatedFiles)
