# SPDX-License-Identifier: Apache-2.0
"""The button: each preset moves, a second press bakes the same tree again, and errors are messages."""

import sys
import unittest
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import support  # noqa: E402


def made():
    """Returns the objects that bakes have created."""
    return [obj for obj in bpy.data.objects if "curlew_kind" in obj]


def empty():
    """Opens an empty file of four frames, with smaller presets."""
    support.empty()
    support.reduce_presets()
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 4


def positions(obj):
    """Returns the positions of an object's points."""
    places = np.empty(3 * len(obj.data.vertices), np.float32)
    obj.data.vertices.foreach_get("co", places)
    return places.reshape(-1, 3)


def seen(obj, frame):
    """Returns the number of an object's points in a frame, and the mean of their positions."""
    bpy.context.scene.frame_set(frame)
    points = positions(obj)
    return len(points), tuple(points.mean(axis=0)) if len(points) else ()


class Presets(unittest.TestCase):
    def setUp(self):
        empty()
        self.presets = support.addon("presets")
        self.scene = bpy.context.scene

    def test_each_preset_moves(self):
        for name, preset in list(self.presets.PRESETS.items()):
            empty()
            if preset.needs_mesh:
                with self.assertRaises(RuntimeError):
                    bpy.ops.curlew.quick(preset=name)
                self.assertFalse(bpy.data.node_groups)
                support.monkey(closed=False)
            self.assertEqual(bpy.ops.curlew.quick(preset=name), {"FINISHED"})
            (obj,) = made()
            if not preset.moves():
                self.assertGreater(len(obj.data.splines), 50)
                continue
            shown = {frame: seen(obj, frame) for frame in (1, 2, 3, 4)}
            self.assertGreater(min(count for count, _ in shown.values()), 200, name)  # the first frame too
            self.assertEqual(len(set(shown.values())), 4, name)
            if preset.loops():  # one frame after the last is the first
                self.assertEqual(seen(obj, 5), shown[1], name)
                self.assertEqual(seen(obj, 8), shown[4], name)
            shape = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
            self.assertIsNotNone(shape)
            if preset.inside:
                self.assertEqual(bpy.data.objects["Suzanne"].display_type, "WIRE")

    def test_a_loop_closes_without_a_jump(self):
        """In the frame after the last, which is baked here too, every particle is back where it began."""
        support.monkey(closed=False)
        for name in [name for name, preset in self.presets.PRESETS.items() if preset.loops()]:
            tree = self.presets.make(name, bpy.context.active_object, self.scene)
            frames = next(node for node in tree.nodes if node.bl_idname == "CurlewNode_frames")
            self.assertEqual(frames.words, "1-4")
            frames.words = "1-5"
            result = next(node for node in tree.nodes if getattr(node, "kind", "") == "points")
            support.addon("bake").bake(tree, self.scene)
            bpy.context.scene.frame_set(1)
            first = positions(result.target)
            bpy.context.scene.frame_set(2)
            step = np.abs(positions(result.target) - first).max()
            bpy.context.scene.frame_set(5)
            self.assertLess(np.abs(positions(result.target) - first).max(), 1e-4 * step, name)

    def test_the_frames_of_a_loop_divide_those_of_the_scene(self):
        for count, loop in ((250, 125), (240, 120), (48, 48), (120, 120), (241, 241), (12, 12), (600, 150)):
            self.scene.frame_start, self.scene.frame_end = 5, 4 + count
            self.assertEqual(self.presets.loop_frames(self.scene), loop)

    def test_pressed_again_it_bakes_the_same_tree(self):
        support.monkey(closed=False)
        bpy.ops.curlew.quick(preset="SWIRL")
        objects, trees = len(bpy.data.objects), len(bpy.data.node_groups)
        (obj,) = made()
        first = obj["curlew_cache"]
        bpy.context.view_layer.objects.active = bpy.data.objects["Suzanne"]
        bpy.ops.curlew.quick(preset="SWIRL")
        self.assertEqual((len(bpy.data.objects), len(bpy.data.node_groups)), (objects, trees))
        self.assertNotEqual(obj["curlew_cache"], first)
        support.monkey(location=(3, 0, 0), closed=False)
        bpy.ops.curlew.quick(preset="SWIRL")
        self.assertEqual(len(made()), 2)

    def test_each_object_has_its_own_tree_whatever_its_name(self):
        for preset in ("WIND", "SHOT"):
            support.empty()
            hero = support.monkey(closed=False)
            bpy.ops.curlew.quick(preset=preset, bake=False)
            first = self.presets.made_before(preset, hero)
            hero.name = "Hero"
            other = support.monkey(closed=False)
            self.assertEqual(other.name, "Suzanne")
            bpy.ops.curlew.quick(preset=preset, bake=False)
            self.assertEqual(self.presets.made_before(preset, hero), first)
            second = self.presets.made_before(preset, other)
            self.assertIsNotNone(second)
            self.assertNotEqual(second, first)
            # Pressed for the renamed object, it finds the tree again.
            trees = len(bpy.data.node_groups)
            bpy.context.view_layer.objects.active = hero
            bpy.ops.curlew.quick(preset=preset, bake=False)
            self.assertEqual(len(bpy.data.node_groups), trees)
            # A tree whose object was deleted belongs to no object.
            bpy.data.objects.remove(hero)
            self.assertIsNone(self.presets.made_before(preset, None))

    def test_a_plane_and_a_curve(self):
        """A plane becomes a thin sheet. A curve without faces is refused, and leaves nothing behind."""
        bpy.ops.mesh.primitive_plane_add()
        for name in ("WIND", "DUST", "SURFACE", "SWIRL"):
            self.assertEqual(bpy.ops.curlew.quick(preset=name), {"FINISHED"}, name)
            self.assertGreater(len(positions(made()[-1])), 200, name)
        trees = len(bpy.data.node_groups)
        bpy.ops.curve.primitive_bezier_curve_add()
        with self.assertRaisesRegex(RuntimeError, "'BézierCurve' has no faces|'BezierCurve' has no faces"):
            bpy.ops.curlew.quick(preset="SWIRL")
        self.assertEqual(len(bpy.data.node_groups), trees)

    def test_what_is_shown_has_a_colour_in_solid_view(self):
        support.monkey(closed=False)
        for name in ("SWIRL", "WAKE"):
            bpy.context.view_layer.objects.active = bpy.data.objects["Suzanne"]
            bpy.ops.curlew.quick(preset=name)
        for obj in made():
            for material in obj.data.materials:
                self.assertGreater(max(material.diffuse_color[:3]) - min(material.diffuse_color[:3]), 0.1)

    def test_the_looks_of_particles(self):
        support.monkey(closed=False)
        bpy.ops.curlew.quick(preset="WIND")
        (obj,) = made()
        tree = bpy.data.node_groups[self.scene.curlew_tree]
        result = next(node for node in tree.nodes if getattr(node, "kind", "") == "points")
        bake, kinds = support.addon("bake"), {}
        for look in ("STREAKS", "SMOKE", "POINTS"):
            result.look = look
            bake.bake(tree)
            self.assertEqual([m.node_group.name for m in obj.modifiers], [
                {"STREAKS": "Curlew Streaks", "SMOKE": "Curlew Smoke", "POINTS": "Curlew Particles"}[look]])
            depsgraph = bpy.context.evaluated_depsgraph_get()
            depsgraph.update()
            kinds[look] = {type(i.object.data).__name__ for i in depsgraph.object_instances if i.object.name == obj.name}
        self.assertIn("Mesh", kinds["STREAKS"])
        self.assertIn("Volume", kinds["SMOKE"])
        self.assertIn("PointCloud", kinds["POINTS"])

    def test_previews(self):
        preview = support.addon("preview")
        for name in list(self.presets.PRESETS):
            empty()
            support.monkey(closed=False)
            bpy.ops.curlew.quick(preset=name, bake=False)
            tree = bpy.data.node_groups[bpy.context.scene.curlew_tree]
            for kind in ("POINTS", "SLICE"):
                tree.preview = kind
                obj = preview.show(tree, bpy.context.scene)
                if kind == "POINTS":
                    self.assertEqual(len(obj.data.vertices), preview.PARTICLES)
                else:
                    pixels = np.empty(len(obj.data.pixels), np.float32)
                    obj.data.pixels.foreach_get(pixels)
                    self.assertGreater(pixels.reshape(-1, 4)[:, 0].std(), 0.02)
            preview.remove()

    def test_the_preview_follows_options_in_groups(self):
        preview = support.addon("preview")
        empty()
        support.monkey(closed=False)
        bpy.ops.curlew.quick(preset="SHOT", bake=False)
        tree = bpy.data.node_groups[bpy.context.scene.curlew_tree]
        tree.preview = "POINTS"
        preview._later()

        def positions():
            vertices = bpy.data.objects[preview.NAME].data.vertices
            values = np.empty(3 * len(vertices), np.float32)
            vertices.foreach_get("co", values)
            return values

        before = positions()
        groups = [node.node_tree for node in tree.nodes if getattr(node, "node_tree", None)]
        noises = [node for group in groups for node in group.nodes
                  if getattr(node, "action", None) and node.action.name == "noise"]
        noises[0].set_option("seed", "77")
        preview._later()  # the timer, which does not run in the background
        self.assertGreater(np.abs(positions() - before).max(), 1e-3)

        # Another tree leaves the preview in place.
        other = bpy.data.node_groups.new("Other", tree.bl_idname)
        other.nodes.new(noises[0].bl_idname).set_option("seed", "5")
        preview._later()
        self.assertIn(preview.NAME, bpy.data.objects)
        bpy.data.node_groups.remove(other)
        # If it is switched off, the preview of another tree is shown.
        bpy.ops.curlew.quick(preset="SWIRL", bake=False)
        second = bpy.data.node_groups[bpy.context.scene.curlew_tree]
        second.preview = "POINTS"
        preview._later()
        of_second = positions()
        tree.preview = "POINTS"
        noises[0].set_option("seed", "78")
        preview._later()
        self.assertGreater(np.abs(positions() - of_second).max(), 1e-3)
        tree.preview = "NONE"
        preview._later()
        self.assertLess(np.abs(positions() - of_second).max(), 1e-6)
        second.preview = "NONE"
        preview._later()
        self.assertNotIn(preview.NAME, bpy.data.objects)


support.main(Presets)
