# SPDX-License-Identifier: Apache-2.0
"""Options that sockets drive, and the parts of a shot as groups."""

import math
import sys
import unittest
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import support  # noqa: E402
from support import Tree  # noqa: E402


def positions(obj):
    """Returns the positions of an object's points."""
    places = np.empty(3 * len(obj.data.vertices), np.float32)
    obj.data.vertices.foreach_get("co", places)
    return places.reshape(-1, 3)


class Case(unittest.TestCase):
    def setUp(self):
        support.empty()
        self.scene = bpy.context.scene
        self.scene.frame_start, self.scene.frame_end = 1, 4
        self.bake = support.addon("bake")
        self.shots = support.addon("shots")

    def options(self, build, node):
        """Returns the options that the library gets for a node."""
        build.add("CurlewParticlesResult", build.add("scatter", build.add("dfvn", node, build.add("noise", seed=1)), count=5))
        return support.addon("tree").collect(build.tree).graph[node.name]["options"]


class Sockets(Case):
    def test_a_socket_replaces_an_option(self):
        build = Tree()
        noise = build.add("noise", frequency=2.5)
        socket = noise.add_value("o_frequency")
        self.assertEqual((socket.bl_idname, socket.name, socket.default_value), ("NodeSocketFloat", "Frequency", 2.5))
        socket.default_value = 1.5
        self.assertEqual(noise.given(), {"frequency": "1.5"})
        value = build.add("CurlewValue", value=0.75)
        reroute = build.tree.nodes.new("NodeReroute")
        build.tree.links.new(value.outputs[0], reroute.inputs[0])
        build.tree.links.new(reroute.outputs[0], socket)
        self.assertEqual(self.options(build, noise), {"frequency": "0.75"})
        value.text = "{1+F}"
        self.assertEqual(self.options(build, noise), {"frequency": "{1+F}"})
        noise.remove_value("o_frequency")
        self.assertEqual(noise.given(), {"frequency": "2.5"})

    def test_every_type(self):
        build = Tree()
        noise = build.add("noise")
        number, vector = build.add("CurlewValue", value=2.6), build.add("CurlewVector", vector=(1, 2, 3))
        for name in ("octaves", "gain"):
            build.tree.links.new(number.outputs[0], noise.add_value("o_" + name))
        self.assertEqual(self.options(build, noise), {"octaves": "3", "gain": "2.6"})
        bound, uniform = build.add("bound"), build.add("uniform")
        build.tree.links.new(number.outputs[0], bound.add_value("o_separate"))
        build.tree.links.new(vector.outputs[0], uniform.add_value("o_velocity"))
        graph = support.addon("tree").collect(build.tree, roots=[bound.name, uniform.name]).graph
        self.assertEqual(graph[bound.name]["options"], {"separate": "1"})
        self.assertEqual(graph[uniform.name]["options"], {"velocity": "1,2,3"})

    def test_what_does_not_fit_is_an_error(self):
        for kind, output, words in (("sphere", 0, "needs a value, not the output of 'Sphere'"), ("CurlewObject", 0, "needs a number")):
            build = Tree(kind)
            noise = build.add("noise")
            node = build.add(kind)
            if kind == "CurlewObject":
                node.object = support.monkey()
            build.tree.links.new(node.outputs[output], noise.add_value("o_frequency"))
            with self.assertRaisesRegex(support.addon("actions").TreeError, words):
                self.options(build, noise)

    def test_keyframes_of_values_are_followed(self):
        """Of a Value node, and of a socket of a group."""
        for own in (False, True):
            inner = Tree("inner")
            noise = inner.add("noise")
            start = inner.tree.nodes.new("NodeGroupInput")
            support.interface_socket(inner.tree, "INPUT", "NodeSocketFloat", "Frequency")
            support.interface_socket(inner.tree, "OUTPUT", "CurlewFieldSocket", "Field")
            inner.tree.links.new(start.outputs[0], noise.add_value("o_frequency"))
            inner.tree.links.new(noise.outputs[0], inner.tree.nodes.new("NodeGroupOutput").inputs[0])
            build = Tree("keyed")
            group = build.add("CurlewGroup", node_tree=inner.tree)
            group.renew_sockets()
            owner, name = (group.inputs[0], "default_value") if own else (build.add("CurlewValue"), "value")
            if not own:
                build.tree.links.new(owner.outputs[0], group.inputs[0])
            for frame, number in ((1, 1.0), (4, 2.5)):
                setattr(owner, name, number)
                owner.keyframe_insert(name, frame=frame)
            for curve in build.tree.animation_data.action.fcurves:
                for key in curve.keyframe_points:
                    key.interpolation = "LINEAR"
            build.add("CurlewParticlesResult", build.add("scatter", build.add("dfvn", group, build.add("noise")), count=5))
            build.tree.sequence = True
            plan = support.addon("job").plan_of(build.tree, self.scene)
            (text,) = [node["options"]["frequency"] for node in plan.graph["nodes"] if node["name"].endswith("/Noise")]
            self.assertTrue(text.startswith("{FF<2?1+0.5*max(FF-1,0):"), text)
            owner.driver_add(name).driver.expression = "frame"
            with self.assertRaisesRegex(support.addon("actions").TreeError, "has a driver"):
                support.addon("job").plan_of(build.tree, self.scene)

    def test_sockets_are_kept_by_files_and_groups(self):
        build = Tree("kept")
        noise = build.add("noise")
        noise.add_value("o_frequency").default_value = 3
        build.tree.use_fake_user = True
        bpy.ops.wm.save_as_mainfile(filepath=str(support.WORK / "kept.blend"))
        bpy.ops.wm.open_mainfile(filepath=str(support.WORK / "kept.blend"))
        tree = bpy.data.node_groups["kept"]
        self.assertEqual(tree.nodes["Noise"].given(), {"frequency": "3"})
        group = support.addon("groups").group_of(tree, [tree.nodes["Noise"]])
        self.assertEqual(group.node_tree.nodes["Noise"].given(), {"frequency": "3"})


class Arrows(Case):
    def test_points_follow_an_arrow_that_turns(self):
        arrow = bpy.data.objects.new("arrow", None)
        self.scene.collection.objects.link(arrow)
        arrow.scale = (1, 1, 2.4)
        for frame, angle in ((1, 0.0), (2, 0.0), (3, math.pi / 2), (4, math.pi / 2)):
            arrow.rotation_euler.y = angle
            arrow.keyframe_insert("rotation_euler", frame=frame)
        build = Tree("windy")
        node = build.add("CurlewArrow")
        source = build.add("CurlewObject", object=arrow)
        build.tree.links.new(source.outputs[0], node.inputs[0])
        flow = build.add("uniform", box="-9,-9,-9,9,9,9")
        build.tree.links.new(node.outputs["Vector"], flow.add_value("o_velocity"))
        points = build.add("advect", flow, build.add("scatter", flow, count=20, box="-1,-1,-1,1,1,1"), scheme="euler", steps=1)
        result = build.add("CurlewParticlesResult", points)
        build.tree.sequence = True
        job = self.bake.bake(build.tree)
        self.assertTrue(any("FF" in node["options"].get("velocity", "") for node in job.plan.graph["nodes"]))
        means = []
        for frame in (1, 2, 3, 4):
            self.scene.frame_set(frame)
            means.append(positions(result.target).mean(axis=0))
        # 2.4 units per second along z, later along x; the steps between are not exact.
        self.assertTrue(np.allclose(means[1] - means[0], (0, 0, 0.1), atol=1e-5), means)
        self.assertTrue(np.allclose(means[3] - means[2], (0.1, 0, 0), atol=1e-5), means)

    def test_without_an_object_the_option_is_automatic(self):
        build = Tree()
        wind = self.shots.add(build.tree, "WIND", Collider=build.add("sphere"))
        build.add("CurlewParticlesResult", build.add("scatter", wind, count=5))
        graph = support.addon("tree").collect(build.tree).graph
        self.assertEqual(next(node for node in graph.values() if node["action"] == "wind")["options"], {"layer": "9%", "padding": "100%"})
        self.bake.bake(build.tree)


class Shots(Case):
    def test_the_sockets_of_all_parts(self):
        tree = Tree().tree
        made = {kind: self.shots.add(tree, kind) for kind in self.shots.SHOTS}
        self.assertEqual({kind: [s.name for s in node.inputs] for kind, node in made.items()}, {
            **dict.fromkeys(("SURFACE_EMITTER", "INSIDE_EMITTER"), [
                "Object", "Collection", "Resolution", "Points per Second", "Lifetime", "Lifetime Randomness", "Random Seed", "Flow",
                "Density"]),
            "COLLIDER": ["Object", "Collection", "Resolution"], "WIND": ["Collider", "Arrow"],
            "TURBULENCE": ["Collider", "Speed", "Frequency"]})
        for node in made.values():
            self.assertEqual(len(node.outputs), 1)
        self.assertAlmostEqual(made["TURBULENCE"].inputs["Speed"].default_value, 0.5)
        self.assertEqual(made["COLLIDER"].inputs["Resolution"].default_value, 80)
        again = self.shots.add(tree, "COLLIDER")
        self.assertEqual(again.node_tree, made["COLLIDER"].node_tree)

    def test_emitters(self):
        bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24)
        ball = bpy.context.active_object
        # Births on the surface are 1 % of the diagonal of the box, 0.035, outside of it.
        for kind, lower, upper in (("SURFACE_EMITTER", 1.02, 1.05), ("INSIDE_EMITTER", 0.0, 1.0)):
            build = Tree(kind)
            emit = self.shots.add(build.tree, kind, Object=ball, Points_per_Second=2400)
            still = build.add("uniform", velocity="0,0,1e-6", box="-9,-9,-9,9,9,9")
            result = build.add("CurlewParticlesResult", build.add("advect", still, emit))
            build.tree.sequence = True
            self.bake.bake(build.tree)
            self.scene.frame_set(4)
            radii = np.linalg.norm(positions(result.target), axis=1)
            self.assertEqual(len(radii), 300)
            self.assertTrue(lower <= radii.min() and radii.max() <= upper, (kind, radii.min(), radii.max()))
            self.assertEqual(radii.min() < 0.8, kind == "INSIDE_EMITTER")

    def test_a_collection_collides_as_one(self):
        inside = bpy.data.collections.new("inside")
        self.scene.collection.children.link(inside)
        for x in (-1, 1):
            bpy.ops.mesh.primitive_cube_add(size=1, location=(x, 0, 0))
            obj = bpy.context.active_object
            self.scene.collection.objects.unlink(obj)
            inside.objects.link(obj)
        build = Tree()
        collider = self.shots.add(build.tree, "COLLIDER", Collection=inside, Resolution=40)
        flow = self.shots.add(build.tree, "TURBULENCE", Collider=collider)
        points = build.add("scatter", flow, count=20000)
        result = build.add("CurlewParticlesResult", points)
        self.bake.bake(build.tree)
        found = positions(result.target)
        beside = np.abs(np.abs(found[:, 0]) - 1)
        within = (beside < 0.45) & (np.abs(found[:, 1]) < 0.45) & (np.abs(found[:, 2]) < 0.45)
        self.assertFalse(within.any())
        between = (np.abs(found) < (0.4, 0.5, 0.5)).all(axis=1)
        self.assertGreater(between.sum(), 20)
        for obj in list(inside.objects):
            inside.objects.unlink(obj)
        with self.assertRaisesRegex(RuntimeError, "'inside' has no meshes"):
            bpy.ops.curlew.bake(tree=build.tree.name)

    def test_a_shot_without_an_object_is_an_error_on_the_group(self):
        build = Tree("bare")
        collider = self.shots.add(build.tree, "COLLIDER")
        build.add("CurlewMeshResult", build.add("ls2mesh", collider))
        with self.assertRaisesRegex(RuntimeError, "choose a mesh object or a collection"):
            bpy.ops.curlew.bake(tree="bare")
        self.assertIn("choose a mesh object", collider.error)

    def test_a_shot_is_exported_as_a_scene(self):
        monkey = support.monkey()
        self.scene.frame_end = 3
        bpy.context.view_layer.objects.active = monkey
        bpy.ops.curlew.quick(preset="SHOT", bake=False)
        tree = bpy.data.node_groups[self.scene.curlew_tree]
        tree.run_up = 0
        folder = support.WORK / "scene"
        folder.mkdir(exist_ok=True)
        support.addon("scene_io").export(tree, folder / "shot.txt", self.scene)
        done = support.run_command("shot.txt", folder)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(len(list(folder.glob("shot_particles.*.ply"))), 3)
        self.assertEqual(len([obj for obj in bpy.data.objects if obj.type == "EMPTY"]), 1)


support.main(Sockets, Arrows, Shots)
