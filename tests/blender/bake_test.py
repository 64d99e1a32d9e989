# SPDX-License-Identifier: Apache-2.0
"""Bakes give the right results, and show errors on the node that caused them."""
# Longer than 400 lines, because the bakes of all kinds of results share one scene and one Blender process.

import json
import os
import sys
import time
import unittest
from pathlib import Path

import bpy
import numpy as np
from mathutils.bvhtree import BVHTree

sys.path.insert(0, str(Path(__file__).parent))
import support  # noqa: E402
from support import Tree  # noqa: E402


def inside(obj, points):
    """Returns the number of points inside a closed object, by the direction of the nearest face. Ignores points less than
    0.05 deep, because the level set differs from the polygons."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    tree = BVHTree.FromObject(obj, depsgraph)
    count = 0
    for p in points:
        place, normal, _, distance = tree.find_nearest(p)
        offset = np.array(p) - np.array(place)
        if distance > 0.05 and float(np.dot(offset, np.array(normal))) < -0.5 * distance:
            count += 1
    return count


def attribute(mesh, name, size, part):
    values = np.empty(size * len(mesh.vertices), np.float32)
    mesh.attributes[name].data.foreach_get(part, values)
    return values.reshape(-1, size)


class Around(unittest.TestCase):
    """The most common use in Blender: a flow around Suzanne."""

    def setUp(self):
        support.empty()
        self.bake = support.addon("bake")

    def make(self):
        build = Tree("around")
        flow = build.around(support.monkey())
        grid = build.add("velocity", flow, dim=40, name="velocity", density=1)
        self.volume = build.add("CurlewVolumeResult", (grid, "Velocity"), (grid, "Density"))
        points = build.add("advect", flow, build.add("scatter", flow, count=4000, seed=3), duration=1, steps=10)
        self.particles = build.add("CurlewParticlesResult", points)
        curves = build.add("trace", flow, build.add("scatter", flow, count=40), maxLength=3)
        self.curves = build.add("CurlewCurvesResult", curves)
        level = build.add("advectLevelSet", flow, build.add("mesh2ls", build.tree.nodes["Mesh Object"], dim=32), duration=0.3)
        self.level = build.add("CurlewMeshResult", build.add("ls2mesh", level))
        return build.tree

    def test_everything(self):
        tree = self.make()
        job = self.bake.bake(tree)
        self.assertEqual(job.report["advect"]["outside"], 0)
        self.assertEqual(tree.message[:8], "baked in")

        points = self.particles.target
        self.assertEqual(len(points.data.vertices), 4000)
        positions = np.array([v.co for v in points.data.vertices])
        self.assertEqual(inside(bpy.data.objects["Suzanne"], positions), 0)
        self.assertEqual(points.data.attributes["id"].data_type, "INT")
        ids = np.empty(4000, np.int32)
        points.data.attributes["id"].data.foreach_get("value", ids)
        self.assertEqual(sorted(ids), list(range(4000)))
        speed = np.linalg.norm(attribute(points.data, "velocity", 3, "vector"), axis=1)
        self.assertGreater(speed.max(), 0.5)
        self.assertEqual(points.modifiers[0].node_group.name, "Curlew Particles")
        shown = points.evaluated_get(bpy.context.evaluated_depsgraph_get())
        self.assertEqual(len(shown.data.vertices) if shown.type == "MESH" and shown.data else 0, 0)  # Geometry Nodes make points of them

        volume = self.volume.target.data
        volume.grids.load()
        self.assertEqual({(g.name, g.data_type, g.channels) for g in volume.grids},
                         {("velocity", "VECTOR_FLOAT", 3), ("density", "FLOAT", 1)})
        self.assertEqual((volume.velocity_grid, volume.velocity_unit, volume.velocity_scale), ("velocity", "SECOND", 1.0))

        self.assertGreater(len(self.curves.target.data.splines), 20)
        self.assertGreater(len(self.level.target.data.polygons), 500)
        self.assertFalse(self.level.target.data.validate())

    def test_the_same_again_and_into_new_files(self):
        tree = self.make()
        first = self.bake.bake(tree)
        one = self.volume.target.data.filepath
        again = self.bake.bake(tree)
        self.assertNotEqual(first.folder, again.folder)
        self.assertNotEqual(one, self.volume.target.data.filepath)
        self.assertEqual(len([o for o in bpy.data.objects if o.type == "VOLUME"]), 1)
        for name in sorted(os.listdir(first.folder)):
            self.assertEqual((first.folder / name).read_bytes(), (again.folder / name).read_bytes(), name)
        cache = support.addon("cache")
        self.assertEqual(cache.clear(tree)[0], 1)
        self.assertFalse(first.folder.exists())
        self.assertTrue(again.folder.exists())

    def test_saved_and_opened_again(self):
        self.make()
        path = support.WORK / "saved.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        bpy.ops.curlew.bake(tree="around")
        tree = bpy.data.node_groups["around"]
        tree.use_fake_user = True
        self.assertTrue(str(support.addon("cache").root(tree)).startswith(str(support.WORK / "curlew_cache")))
        before = {n.name: (n.bl_idname, n.given() if hasattr(n, "given") else {}) for n in tree.nodes}
        file = bpy.data.objects["around Volume"].data.filepath
        self.assertTrue(file.startswith("//curlew_cache"))
        bpy.ops.wm.save_mainfile()
        bpy.ops.wm.open_mainfile(filepath=str(path))
        tree = bpy.data.node_groups["around"]
        self.assertEqual(before, {n.name: (n.bl_idname, n.given() if hasattr(n, "given") else {}) for n in tree.nodes})
        volume = bpy.data.objects["around Volume"].data
        self.assertTrue(volume.grids.load())
        self.assertEqual(len(bpy.data.objects["around Particles"].data.vertices), 4000)
        self.assertEqual(bpy.ops.curlew.bake(tree="around"), {"FINISHED"})
        self.assertNotEqual(bpy.data.objects["around Volume"].data.filepath, file)


class Frames(unittest.TestCase):
    def setUp(self):
        support.empty()
        self.bake = support.addon("bake")

    def test_saving_moves_no_bake_of_an_earlier_file(self):
        """A new file follows one that was baked but never saved. Only its own bake moves beside it."""

        def baked():
            build = Tree("dust")
            build.add("CurlewParticlesResult", build.add("scatter", build.add("sphere"), count=10))
            return self.bake.bake(build.tree).folder

        earlier = baked()
        bpy.ops.wm.read_homefile(use_empty=True)
        folder = support.WORK / "new_file"
        folder.mkdir()
        later = baked()
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / "new.blend"))
        self.assertEqual([path.name for path in (folder / "curlew_cache").glob("*/*")], [later.name])
        self.assertTrue(earlier.is_dir())

    def test_a_sequence(self):
        scene = bpy.context.scene
        scene.frame_start, scene.frame_end = 5, 9
        build = Tree("moving")
        f = build.add("noise", frequency=2, alpha="{2*pi*T}")
        flow = build.add("dfvn", f, build.add("noise", frequency=2, seed=1), speed=1)
        source = build.add("sphere", radius=0.3)
        emitted = build.add("emit", source, rate=24 * 50, life=0.1)
        particles = build.add("CurlewParticlesResult", build.add("advect", flow, emitted))
        grid = build.add("velocity", flow, dim=12, name="velocity")
        volume = build.add("CurlewVolumeResult", (grid, "Velocity"))
        build.tree.sequence = True
        job = self.bake.bake(build.tree)
        self.assertEqual(job.plan.graph["frames"], {"words": ["5-9"], "options": {"fps": "24"}})
        self.assertEqual(len(list(job.folder.iterdir())), 10)

        counts, places = [], []
        for frame in range(4, 11):
            scene.frame_set(frame)
            mesh = particles.target.data
            counts.append(len(mesh.vertices))
            places.append(tuple(mesh.vertices[0].co) if counts[-1] else None)
        self.assertEqual(counts[:4], [0, 0, 50, 100])
        for count in counts[4:]:
            self.assertAlmostEqual(count, 120, delta=1)  # the number of points that are born within one life
        self.assertEqual(len(set(places[2:6])), 4)
        mesh = particles.target.data
        self.assertEqual({a.name for a in mesh.attributes} & {"id", "velocity", "age"}, {"id", "velocity", "age"})
        ages = attribute(mesh, "age", 1, "value")
        self.assertLessEqual(ages.max(), 0.1 + 1e-6)

        data = volume.target.data
        self.assertTrue(data.is_sequence)
        self.assertEqual((data.frame_start, data.frame_duration), (5, 5))
        for frame in (5, 7, 9):
            scene.frame_set(frame)
            data.grids.load()
            self.assertEqual(Path(data.grids.frame_filepath).name, f"Volume_Result.{frame:04d}.vdb")

    def loop(self, name):
        """Builds a tree with particles in a ball that are back where they began after 8 frames."""
        build = Tree(name)
        bound = build.add("bound", build.add("noise", frequency=1.5, seed=1), build.add("sphere"), layer=0.2)
        flow = build.add("dfvn", build.add("noise", frequency=1.5), bound, speed=1)
        points = build.add("advect", flow, build.add("scatter", flow, count=200), loop=8 / 24)
        build.particles = build.add("CurlewParticlesResult", points)
        return build

    def seen(self, result, frame):
        """Returns the positions of a result's points in a frame of the scene, and their `fade`, as bytes."""
        bpy.context.scene.frame_set(frame)
        mesh = result.target.data
        places = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", places)
        return places.tobytes(), attribute(mesh, "fade", 1, "value").tobytes()

    def test_a_sequence_that_loops_and_scrubs(self):
        scene = bpy.context.scene
        scene.frame_start, scene.frame_end = 1, 9
        build = self.loop("loop")
        build.tree.sequence = True
        job = self.bake.bake(build.tree)
        report = job.report["loop"]
        self.assertEqual(report["closed"] + report["faded"], 200)
        self.assertGreater(report["faded"], 0)
        whole = {frame: self.seen(build.particles, frame) for frame in (1, 2, 5, 9)}
        self.assertEqual(whole[1], whole[9])
        self.assertEqual(len(set(whole.values())), 3)
        fade = np.frombuffer(whole[5][1], np.float32)
        self.assertEqual((fade == 1).sum() + (fade < 1).sum(), 200)
        self.assertLess(fade.min(), 1)
        # The result does not depend on the order of the frames or on frames in between, and is the same if each frame is
        # baked separately.
        for frame in (5, 1, 9, 2):
            self.assertEqual(self.seen(build.particles, frame), whole[frame])
        live = self.loop("scrubbed")
        live.tree.bake_on_frame = True
        for frame in (5, 9, 2, 1):
            self.assertEqual(self.seen(live.particles, frame), whole[frame], frame)

    def test_an_empty_that_moves_and_a_mesh_that_deforms(self):
        scene = bpy.context.scene
        scene.frame_start, scene.frame_end = 1, 4
        empty = bpy.data.objects.new("empty", None)
        scene.collection.objects.link(empty)
        for frame, x in ((1, 0.0), (4, 0.6)):
            empty.location.x = x
            empty.keyframe_insert("location", frame=frame)
        build = Tree("moving")
        sphere = build.add("sphere", radius=0.5, place=empty)
        flow = build.add("uniform", velocity="0,0,1")
        points = build.add("emit", sphere, rate=2400)
        build.add("CurlewParticlesResult", build.add("advect", flow, points))
        build.tree.sequence = True
        job = self.bake.bake(build.tree)
        self.assertIn("FF<", json.dumps(job.plan.graph))
        bpy.ops.mesh.primitive_uv_sphere_add()
        ball = bpy.context.active_object
        for frame, size in ((1, 0.5), (4, 1.0)):
            ball.scale = (size,) * 3
            ball.keyframe_insert("scale", frame=frame)
        build = Tree("growing")
        mesh = build.add("CurlewMeshObject", object=ball, motion="ON")
        result = build.add("CurlewMeshResult", build.add("ls2mesh", build.add("mesh2ls", mesh, dim=24)))
        build.tree.sequence = True
        self.bake.bake(build.tree)
        sizes = []
        for frame in range(1, 5):
            scene.frame_set(frame)
            sizes.append(max(v.co.x for v in result.target.data.vertices))
        for size, frame in zip(sizes, range(1, 5)):
            scene.frame_set(frame)
            self.assertAlmostEqual(size, ball.matrix_world[0][0], delta=0.03)
        self.assertEqual(scene.frame_current, 4)

    def test_particles_stay_in_the_tube_around_a_drawn_curve(self):
        bpy.ops.curve.primitive_bezier_circle_add(location=(0, 0, 2))
        build = Tree("rail")
        curves = build.add("CurlewCurveObject", object=bpy.context.active_object)
        flow = build.add("rail", curves, radius=0.1, speed=2)
        moved = build.add("advect", flow, build.add("scatter", flow, count=500), duration=3)
        result, back = build.add("CurlewParticlesResult", moved), build.add("CurlewCurvesResult", curves)
        self.bake.bake(build.tree)
        spline, = back.target.data.splines
        self.assertTrue(spline.use_cyclic_u)
        ring = np.array([p.co[:3] for p in spline.points])
        self.assertEqual(len(ring), 48)  # 12 segments between two of its four points
        self.assertTrue(np.allclose(ring[:, 2], 2, atol=1e-6))
        fine = np.concatenate([np.linspace(a, b, 20) for a, b in zip(ring, np.roll(ring, -1, axis=0))])
        points = np.array([v.co for v in result.target.data.vertices])
        self.assertEqual(len(points), 500)
        distances = [np.linalg.norm(fine - p, axis=1).min() for p in points]
        self.assertLess(max(distances), 0.104)  # the axis of the tube is smooth, and `fine` consists of points
        self.assertGreater(max(distances), 0.08)

    def test_a_moving_curve_takes_its_flow_along(self):
        bpy.ops.curve.primitive_bezier_circle_add()
        circle, scene = bpy.context.active_object, bpy.context.scene
        scene.frame_start, scene.frame_end = 1, 3
        for frame in (1, 3):
            circle.location[2] = frame
            circle.keyframe_insert("location", frame=frame)
        build = Tree("moving rail")
        curves = build.add("CurlewCurveObject", object=circle)
        flow = build.add("rail", curves, radius=0.1, speed=2)
        emitted = build.add("emit", flow, rate=2400, life=0.02)  # less than a frame: only the newest are left
        result, back = build.add("CurlewParticlesResult", emitted), build.add("CurlewCurvesResult", curves)
        build.tree.sequence = True
        self.bake.bake(build.tree)
        for frame in (2, 3):
            scene.frame_set(frame)
            points = np.array([v.co for v in result.target.data.vertices])
            self.assertGreater(len(points), 20)
            self.assertLessEqual(np.abs(points[:, 2] - frame).max(), 0.1)
            self.assertTrue(all(abs(p.co[2] - frame) < 1e-6 for p in back.target.data.splines[0].points))

    def heights(self, result, axis=2):
        """Returns the number of a result's points and their mean coordinate, for each frame of the scene."""
        seen = []
        for frame in range(bpy.context.scene.frame_start, bpy.context.scene.frame_end + 1):
            bpy.context.scene.frame_set(frame)
            points = np.array([v.co for v in result.target.data.vertices])
            seen.append((len(points), float(points[:, axis].mean()) if len(points) else 0.0))
        return seen

    def test_curves_from_points_do_not_freeze_them(self):
        """The points move in every frame, whatever the order of the branches is."""
        bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 4
        for curves_first in (True, False):
            support.empty()
            bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 4
            build = Tree("both")
            flow = build.add("uniform", velocity="0,0,2.4", box="-9,-9,-9,9,9,9")
            points = build.add("scatter", flow, count=50, box="-1,-1,-1,1,1,1")

            def add_curves():
                return build.add("CurlewCurvesResult", build.add("trace", flow, points, maxLength=1))

            curves = add_curves() if curves_first else None
            result = build.add("CurlewParticlesResult", build.add("advect", flow, points))
            curves = curves or add_curves()
            build.tree.sequence = True
            self.bake.bake(build.tree)
            seen = self.heights(result)
            self.assertEqual([count for count, _ in seen], [50] * 4)
            self.assertTrue(np.allclose(np.diff([height for _, height in seen]), 0.1, atol=1e-5), seen)
            self.assertEqual(len(curves.target.data.splines), 50)

    def test_points_join_others_only_by_links(self):
        bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 3
        build = Tree()
        flow = build.add("uniform", velocity="0,0,1", box="-1,-1,-1,1,1,1")
        scattered = build.add("scatter", flow, count=7)
        build.add("CurlewCurvesResult", build.add("trace", flow, scattered, maxLength=1))
        results, emitters = [], []
        for x, rate in ((-0.5, 240), (0.5, 480)):
            emitters.append(build.add("emit", build.add("sphere", radius=0.1, translate=f"{x},0,0"), rate=rate))
            results.append(build.add("CurlewParticlesResult", build.add("advect", flow, emitters[-1]), label=f"at {x}"))
        build.tree.sequence = True
        self.bake.bake(build.tree)
        for result, x, rate in zip(results, (-0.5, 0.5), (240, 480)):
            seen = self.heights(result, axis=0)
            self.assertEqual([count for count, _ in seen], [0, rate / 24, 2 * rate / 24])
            self.assertAlmostEqual(seen[-1][1], x, delta=0.1)
        build.tree.links.new(scattered.outputs[0], emitters[0].inputs[1])
        self.bake.bake(build.tree)
        self.assertEqual([count for count, _ in self.heights(results[0])], [7, 7 + 10, 7 + 20])
        self.assertEqual([count for count, _ in self.heights(results[1])], [0, 20, 40])

    def test_a_thread_can_be_cancelled(self):
        build = Tree("long")
        flow = build.add("dfvn", build.add("noise"), build.add("noise", seed=1))
        points = build.add("advect", flow, build.add("scatter", flow, count=200000), steps=5000)
        build.add("CurlewParticlesResult", points)
        job = support.addon("job").prepare(build.tree, bpy.context.scene)
        job.start()
        began = time.monotonic()
        while not job.title and time.monotonic() - began < 20:
            time.sleep(0.01)
        self.assertTrue(job.running())
        self.assertTrue(job.title)
        job.cancelled = True
        job.wait()
        self.assertLess(time.monotonic() - began, 30)
        with self.assertRaises(support.addon("actions").TreeError):
            self.bake.finish(build.tree, job, bpy.context.scene)
        self.assertEqual(build.tree.message, "cancelled")
        self.assertFalse([n.name for n in build.tree.nodes if n.error])


class Errors(unittest.TestCase):
    """Each error is a message of one line on its node."""

    def setUp(self):
        support.empty()

    def fails(self, build, node, words):
        with self.assertRaises(RuntimeError) as raised:
            bpy.ops.curlew.bake(tree=build.tree.name)
        self.assertIn(words, str(raised.exception))
        if node is not None:
            self.assertIn(words, node.error)
            self.assertGreater(node.color.r, 0.4)
            self.assertEqual([n.name for n in build.tree.nodes if getattr(n, "error", "") and n != node], [])

    def test_curves_with_faces_or_none(self):
        bpy.ops.curve.primitive_bezier_circle_add()
        circle = bpy.context.active_object
        build = Tree()
        curves = build.add("CurlewCurveObject")
        build.add("CurlewCurvesResult", curves)
        self.fails(build, curves, "choose a curve")
        curves.object = circle
        circle.data.bevel_depth = 0.1
        self.fails(build, curves, "has faces: turn off its bevel")
        circle.data.bevel_depth = 0
        bpy.ops.curlew.bake(tree=build.tree.name)
        circle.data.splines.clear()
        self.fails(build, curves, "has no curves")

    def test_nothing_is_connected(self):
        build = Tree()
        self.fails(build, None, "nothing to do")
        node = build.add("CurlewParticlesResult")
        self.fails(build, node, "nothing is connected")
        advect = build.add("advect")
        build.tree.links.new(advect.outputs[0], node.inputs[0])
        self.fails(build, advect, "nothing is connected to 'flow'")

    def test_what_nothing_needs_may_be_unfinished(self):
        build = Tree()
        flow = build.add("dfvn", build.add("noise"), build.add("noise", seed=1))
        build.add("CurlewParticlesResult", build.add("scatter", flow, count=10))
        build.add("advect", flow)
        build.add("CurlewMeshObject")
        self.assertEqual(bpy.ops.curlew.bake(tree=build.tree.name), {"FINISHED"})

    def test_a_result_of_another_kind(self):
        build = Tree()
        flow = build.add("dfvn", build.add("noise"), build.add("noise", seed=1))
        result = build.add("CurlewParticlesResult", build.add("trace", flow, build.add("scatter", flow, count=10), maxLength=1))
        self.fails(build, result, "is of kind 'curves', not 'points'")

    def test_cycles(self):
        build = Tree()
        a = build.add("clip")
        b = build.add("clip", a)
        build.tree.links.new(b.outputs[0], a.inputs[0])
        flow = build.add("dfvn", build.add("noise"), b)
        build.add("CurlewParticlesResult", build.add("scatter", flow))
        self.fails(build, None, "cycle")
        build = Tree()
        one, two = build.add("NodeReroute"), build.add("NodeReroute")
        build.tree.links.new(one.outputs[0], two.inputs[0])
        build.tree.links.new(two.outputs[0], one.inputs[0])
        node = build.add("scatter")
        build.tree.links.new(one.outputs[0], node.inputs[0])
        build.add("CurlewParticlesResult", node)
        self.fails(build, None, "cycle")

    def test_links_of_the_wrong_kind(self):
        build = Tree()
        node = build.add("advect", build.add("noise"), build.add("noise"))
        build.add("CurlewParticlesResult", node)
        self.fails(build, node, "flow= needs a flow, but 'Noise' is a field")
        build = Tree()
        node = build.add("bound", build.add("noise"), build.add("noise", seed=1))
        build.add("CurlewParticlesResult", build.add("scatter", build.add("dfvn", build.add("noise"), node)))
        self.fails(build, node, "wall= needs a shape or a level set, but 'Noise.001' is a field")

    def test_no_mesh(self):
        build = Tree()
        flow = build.around(None)
        build.add("CurlewParticlesResult", build.add("scatter", flow))
        self.fails(build, build.tree.nodes["Mesh Object"], "choose a mesh object")
        bare = bpy.data.objects.new("bare", bpy.data.meshes.new("bare"))
        bpy.context.scene.collection.objects.link(bare)
        build.tree.nodes["Mesh Object"].object = bare
        self.fails(build, build.tree.nodes["Mesh Object"], "'bare' has no faces")
        sheet = bpy.data.objects.new("sheet", bpy.data.meshes.new("sheet"))
        sheet.data.from_pydata([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [], [(0, 1, 2, 3)])
        bpy.context.scene.collection.objects.link(sheet)
        build.tree.nodes["Mesh Object"].object = sheet
        mesh2ls = next(n for n in build.tree.nodes if n.bl_idname == "CurlewNode_mesh2ls")
        self.fails(build, mesh2ls, "the mesh encloses nothing")

    def test_what_the_library_says_is_on_its_node_and_goes_away(self):
        build = Tree()
        bad = build.add("noise", frequency="{1/0}")
        flow = build.add("dfvn", bad, build.add("noise", seed=1))
        build.add("CurlewParticlesResult", build.add("scatter", flow, count=10))
        self.fails(build, bad, "frequency")
        bad.reset_option("frequency")
        self.assertEqual(bpy.ops.curlew.bake(tree=build.tree.name), {"FINISHED"})
        self.assertEqual(bad.error, "")
        self.assertLess(bad.color.r, 0.4)

    def test_staggered_velocities_are_refused(self):
        build = Tree()
        flow = build.add("dfvn", build.add("noise"), build.add("noise", seed=1))
        grid = build.add("velocity", flow, dim=16, staggered=1)
        build.add("CurlewVolumeResult", (grid, "Velocity"))
        self.fails(build, grid, "staggered=0")

    def test_what_a_volume_holds(self):
        """Level sets are also found behind reroutes. Fog volumes and velocities are refused in their place."""
        build = Tree()
        level = build.add("mesh2ls", build.add("CurlewMeshObject", object=support.monkey()), dim=24)
        flow = build.add("uniform", velocity="0,0,1", box="-1,-1,-1,1,1,1")
        grid = build.add("velocity", flow, dim=8, density=1)
        level_set = build.add("CurlewVolumeResult", level)
        others = build.add("CurlewVolumeResult", (grid, "Velocity"), (grid, "Density"))
        bpy.ops.curlew.bake(tree=build.tree.name)
        build = Tree()
        volume = build.add("CurlewVolumeObject", object=level_set.target)
        result = build.add("CurlewMeshResult", build.add("ls2mesh", build.add("NodeReroute", volume)))
        bpy.ops.curlew.bake(tree=build.tree.name)
        self.assertGreater(len(result.target.data.polygons), 100)
        taker = result.inputs[0].links[0].from_node
        volume.object = others.target
        volume.grids = "density"
        self.fails(build, taker, "needs a level set, but 'Volume Object' is a grid")
        volume.grids = next(g.name for g in others.target.data.grids if g.data_type == "VECTOR_FLOAT")
        self.fails(build, taker, "needs a level set, but 'Volume Object' is a velocity grid")

    def test_a_cache_that_cannot_be_written(self):
        build = Tree()
        build.tree.use_fake_user = True
        blocking = support.blocked_cache("locked")
        flow = build.add("dfvn", build.add("noise"), build.add("noise", seed=1))
        build.add("CurlewParticlesResult", build.add("scatter", flow, count=10))
        self.fails(build, None, "cannot write the cache")
        blocking.unlink()


support.main(Around, Frames, Errors)
