# SPDX-License-Identifier: Apache-2.0
"""Cycles renders the results of bakes, and the pictures are not empty. Also times a million particles."""

import sys
import time
import unittest
from pathlib import Path

import bpy
import numpy as np
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).parent))
import support  # noqa: E402
from support import Tree  # noqa: E402

WIDTH, HEIGHT, SAMPLES = 160, 120, 8


def stage():
    """Adds a camera, a lamp and a dark world. Returns the scene."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples = SAMPLES
    scene.cycles.use_denoising = False
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = WIDTH, HEIGHT, 100
    scene.world = bpy.data.worlds.new("dark")
    scene.world.color = (0, 0, 0)
    lamp = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "SUN"))
    lamp.data.energy = 5
    lamp.rotation_euler = (0.6, 0.3, 0)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = (0, -5, 0)
    camera.rotation_euler = (np.pi / 2, 0, 0)
    for obj in (lamp, camera):
        scene.collection.objects.link(obj)
    scene.camera = camera
    return scene


def render(name):
    """Renders the scene and returns the brightness of the pixels, with rows from the bottom."""
    path = support.WORK / f"{name}.png"
    bpy.context.scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return support.image(path)[:, :, :3].mean(axis=2)


def within(obj):
    """Returns the pixels that the object's bounding box covers (for points, that of their vertices)."""
    scene = bpy.context.scene
    corners = [v.co for v in obj.data.vertices] if obj.type == "MESH" else [Vector(c) for c in obj.bound_box]
    corners = [world_to_camera_view(scene, scene.camera, obj.matrix_world @ c) for c in corners]
    x = sorted(min(max(c.x, 0), 1) * WIDTH for c in corners)
    y = sorted(min(max(c.y, 0), 1) * HEIGHT for c in corners)
    return slice(int(y[0]), int(y[-1]) + 1), slice(int(x[0]), int(x[-1]) + 1)


class Renders(unittest.TestCase):
    def setUp(self):
        support.empty()
        build = self.build = Tree()
        sphere = build.add("sphere", radius=1)
        bound = build.add("bound", build.add("noise", frequency=1.5, seed=1), sphere, layer=0.3)
        self.flow = build.add("dfvn", build.add("noise", frequency=1.5, seed=2), bound, speed=2)

    def bake(self):
        support.addon("bake").bake(self.build.tree)
        self.scene = stage()

    def seen(self, name, obj):
        picture = render(name)
        shown = picture[within(obj)]
        print(f"{name}: standard deviation {shown.std():.4f} where it is, {picture.mean():.4f} on average")
        self.assertGreater(shown.std(), 0.02)
        self.assertGreater((shown > 0.02).mean(), 0.05)
        return picture

    def test_particles(self):
        points = self.build.add("advect", self.flow, self.build.add("scatter", self.flow, count=5000), steps=5)
        node = self.build.add("CurlewParticlesResult", points, thickness=0.02)
        self.bake()
        self.seen("particles", node.target)

    def test_curves(self):
        curves = self.build.add("trace", self.flow, self.build.add("scatter", self.flow, count=100))
        node = self.build.add("CurlewCurvesResult", curves, thickness=0.02)
        self.bake()
        self.seen("curves", node.target)

    def test_a_volume_and_its_motion_blur(self):
        """A moving puff of smoke is blurred along its velocity, by the distance that it moves while the shutter is open.
        Cycles looks up where the smoke came from, so the velocity grid must extend beyond the smoke."""
        build = self.build
        wind = build.add("uniform", velocity="6,0,0", box="-1.2,-0.8,-0.8,1.2,0.8,0.8")
        puff = build.add("velocity", wind, dim=24, density=1, box="-0.5,-0.5,-0.5,0.5,0.5,0.5")
        grid = build.add("velocity", wind, dim=24, name="velocity")
        node = build.add("CurlewVolumeResult", (grid, "Velocity"), (puff, "Density"))
        self.bake()
        node.target.data.materials[0].node_tree.nodes["Principled Volume"].inputs["Density"].default_value = 8
        sharp = self.seen("volume", node.target)
        self.scene.render.use_motion_blur = True
        self.scene.render.motion_blur_shutter = 1.0
        node.target.cycles.use_motion_blur = True
        blurred = render("volume_blurred")
        # The shutter is open for 1/24 s. At 6 units per second, the puff moves by a quarter of a unit.
        row = HEIGHT // 2
        columns = [np.flatnonzero(picture[row - 4:row + 4].mean(axis=0) > 0.01) for picture in (sharp, blurred)]
        widths = [c[-1] - c[0] for c in columns]
        print("width in pixels, sharp and blurred:", widths)
        self.assertAlmostEqual(widths[1] - widths[0], 0.25 * WIDTH / 3.6, delta=3)  # 3.6 units are visible at that distance
        self.assertGreater(np.abs(blurred - sharp).max(), 0.05)
        rows = [np.flatnonzero(p[:, WIDTH // 2 - 4:WIDTH // 2 + 4].mean(axis=1) > 0.01) for p in (sharp, blurred)]
        self.assertLessEqual(abs((rows[1][-1] - rows[1][0]) - (rows[0][-1] - rows[0][0])), 2)  # no blur across the velocity


class Many(unittest.TestCase):
    def test_a_million_particles(self):
        """Sets new positions and velocities for each frame, as the frame handler does."""
        support.empty()
        results, cache = support.addon("results"), support.addon("cache")
        count = 1000000
        random = np.random.default_rng(1)
        mesh = bpy.data.meshes.new("many")
        obj = bpy.data.objects.new("many", mesh)
        bpy.context.scene.collection.objects.link(obj)
        file = support.WORK / "many.npz"
        loads, sets = [], []
        for _ in range(4):
            arrays = {"position": random.random((count, 3), np.float32), "velocity": random.random((count, 3), np.float32),
                      "id": np.arange(count, dtype=np.int32), "age": random.random(count, np.float32)}
            cache.save(file, arrays)
            began = time.perf_counter()
            loaded = cache.load(file)
            between = time.perf_counter()
            results.show_points(mesh, loaded)
            sets.append(time.perf_counter() - between)
            loads.append(between - began)
            bpy.context.view_layer.update()
        print(f"a million particles: {1000 * min(sets):.0f} ms to set, {1000 * min(loads):.0f} ms to load")
        self.assertEqual(len(mesh.vertices), count)
        self.assertTrue(np.array_equal(np.array(mesh.vertices[count - 1].co), arrays["position"][-1]))


support.main(Renders, Many)
