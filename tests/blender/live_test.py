# SPDX-License-Identifier: Apache-2.0
"""Bake on Frame Change: each frame shows its own bake, whatever changes the frame and whatever happens meanwhile."""
# Longer than 400 lines, because each Blender process takes seconds to start and these tests share one.

import contextlib
import io
import subprocess
import sys
import threading
import time
import unittest
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import support  # noqa: E402
from support import Tree  # noqa: E402


def keyed(owner, name, values):
    """Sets keyframes of a property."""
    for frame, value in values:
        setattr(owner, name, value)
        owner.keyframe_insert(name, frame=frame)


def growing():
    """Builds a tree whose flow, obstacle and source move independently."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8)
    ball = bpy.context.active_object
    keyed(ball, "scale", ((1, (0.5,) * 3), (11, (1.0,) * 3)))
    ball.hide_render = True
    empty = bpy.data.objects.new("empty", None)
    bpy.context.scene.collection.objects.link(empty)
    keyed(empty, "location", ((1, (0, 0, 0)), (11, (0.6, 0, 0))))
    build = Tree("live")
    mesh = build.add("CurlewMeshObject", object=ball)
    level = build.add("mesh2ls", mesh, dim=16)
    f = build.add("noise", alpha="{2*pi*T}")
    keyed(f, "o_frequency", ((1, 1.0), (11, 2.0)))
    flow = build.add("dfvn", f, build.add("bound", build.add("noise", seed=2), level, layer=0.3), speed=1)
    source = build.add("sphere", radius=0.2, place=empty)
    build.points = build.add("CurlewParticlesResult", build.add("scatter", source, count=200), thickness=0.05)
    build.curves = build.add("CurlewCurvesResult", build.add("trace", flow, build.add("scatter", flow, count=20), maxLength=1))
    build.mesh = build.add("CurlewMeshResult", build.add("ls2mesh", level))
    grid = build.add("velocity", flow, dim=16, name="velocity")
    build.volume = build.add("CurlewVolumeResult", (grid, "Velocity"))
    build.tree.bake_on_frame = True
    return build


def long(count=200000, steps=5000):
    """Builds a tree whose bake takes minutes."""
    build = Tree("long")
    flow = build.add("dfvn", build.add("noise"), build.add("noise", seed=1))
    points = build.add("advect", flow, build.add("scatter", flow, count=count), steps=steps, duration="{1+F}")
    build.points = build.add("CurlewParticlesResult", points)
    build.tree.bake_on_frame = True
    return build


def shown(node):
    """Returns the folder of the files that a result node's object shows."""
    data = node.target.data
    return Path(bpy.path.abspath(data.filepath if node.kind == "grid" else node.target["curlew_cache"])).parent


def contents(folder):
    """Returns the contents of a bake's files, and of an .npz the arrays, because the file contains its time."""
    cache = support.addon("cache")
    return {path.name: {k: (v.dtype, v.shape, v.tobytes()) for k, v in cache.load(path).items()} if path.suffix == ".npz"
            else path.read_bytes() for path in sorted(folder.iterdir())}


def leftovers():
    """Returns the names of bake threads that are still alive."""
    return [t.name for t in threading.enumerate() if t.name == "curlew bake"]


class Live(unittest.TestCase):
    def setUp(self):
        support.empty()
        self.bake, self.live, self.cache = support.addon("bake"), support.addon("live"), support.addon("cache")
        self.scene = bpy.context.scene
        self.synchronous = self.live.synchronous

    def tearDown(self):
        self.live.synchronous = self.synchronous
        self.assertEqual(leftovers(), [])

    def threaded(self):
        """Bakes in threads as in the interface. The tests replace its timer."""
        self.live.synchronous = lambda: False

    def settle(self):
        began = time.monotonic()
        while self.live.step() is not None:
            self.assertLess(time.monotonic() - began, 60)
            time.sleep(0.002)
        if bpy.app.timers.is_registered(self.live.step):
            bpy.app.timers.unregister(self.live.step)

    def folders(self, tree):
        base = self.cache.root(tree)
        return sorted(p.name for p in base.iterdir()) if base.is_dir() else []

    def begin_long(self):
        """Starts a long bake and waits until it is running."""
        self.threaded()
        build = long()
        self.scene.frame_set(3)
        self.live.step()
        job, began = self.live._jobs["long"], time.monotonic()
        while not job.title and time.monotonic() - began < 20:
            time.sleep(0.01)
        self.assertTrue(job.running())
        return build, job


class Frames(Live):
    def test_nothing_happens_unless_it_is_wanted(self):
        build = growing()
        build.tree.bake_on_frame = False
        self.scene.frame_set(5)
        self.assertIsNone(build.points.target)
        self.assertEqual(self.folders(build.tree), [])

    def test_a_foreign_file_writes_nothing_of_its_own(self):
        """A .blend file from an unknown source may contain a tree that is baked on frame change and nodes that write anywhere."""
        victim, blend = support.WORK / "victim.ply", support.WORK / "foreign" / "foreign.blend"
        victim.write_text("precious")
        build = Tree("foreign")
        points = build.add("scatter", build.add("sphere"), count=50)
        build.add("CurlewParticlesResult", points)
        build.add("write", points, words=str(victim))
        build.add("report", words=str(support.WORK / "report.json"))
        build.tree.bake_on_frame = True
        build.tree.use_fake_user = True
        blend.parent.mkdir(exist_ok=True)
        bpy.ops.wm.save_as_mainfile(filepath=str(blend))
        support.empty()
        bpy.ops.wm.open_mainfile(filepath=str(blend), load_ui=False, use_scripts=False)
        bpy.context.scene.frame_set(7)
        tree = bpy.data.node_groups["foreign"]
        self.assertIn("frame 7 baked", tree.message)
        self.assertEqual(victim.read_text(), "precious")
        self.assertFalse((support.WORK / "report.json").exists())
        self.assertEqual({path.name for path in blend.parent.iterdir()}, {"foreign.blend", "curlew_cache"})
        # Also not in a bake that the user starts, until the user allows each path or types it.
        for name, kept in (("Report", support.WORK / "report.json"), ("Write", victim)):
            with self.assertRaisesRegex(RuntimeError, f"this node came with the file and would write '{kept}'"):
                bpy.ops.curlew.bake(tree="foreign")
            self.assertIn("Allow Writing", tree.nodes[name].error)
            self.assertEqual(victim.read_text(), "precious")
            self.assertFalse((support.WORK / "report.json").exists())
            if name == "Report":
                self.assertEqual(bpy.ops.curlew.allow_writing(tree="foreign", node=name), {"FINISHED"})
        tree.nodes["Write"].words = str(victim)
        self.assertEqual(bpy.ops.curlew.bake(tree="foreign"), {"FINISHED"})
        self.assertNotEqual(victim.read_bytes()[:8], b"precious")
        self.assertTrue((support.WORK / "report.json").exists())

    def test_ways_around_the_names_of_files(self):
        """A hostile file hides the name: in a group, behind .., in a link to a folder, in an option, in a scene."""
        blend = support.WORK / "hostile" / "hostile.blend"
        blend.parent.mkdir(exist_ok=True)
        bpy.ops.wm.save_as_mainfile(filepath=str(blend))
        cache, outside = blend.parent / "curlew_cache", support.WORK / "outside"
        outside.mkdir(exist_ok=True)
        cache.mkdir(exist_ok=True)
        (cache / "link").symlink_to(outside)
        inner = Tree("inner")
        inner.add("write", inner.add("scatter", inner.add("sphere"), count=5), words=str(outside / "a.ply"))
        build = Tree("hostile")
        build.add("CurlewGroup", node_tree=inner.tree)
        points = build.add("scatter", build.add("sphere"), count=5)
        build.add("write", points, words="//curlew_cache/b.ply //curlew_cache/../../outside/c.ply")
        build.add("write", points, words=str(cache / "link" / "d.ply"))
        build.add("check", build.add("dfvn", build.add("noise"), build.add("noise", seed=1)), report=str(outside / "e.json"))
        build.add("CurlewParticlesResult", points)
        build.tree.use_fake_user = True
        bpy.ops.wm.save_mainfile()
        support.empty()
        bpy.ops.wm.open_mainfile(filepath=str(blend), load_ui=False, use_scripts=False)
        tree = bpy.data.node_groups["hostile"]
        mine = support.addon("writing")
        refused = {key: mine.refused(node) for key, node in support.addon("tree").nodes_of(tree).items()}
        self.assertEqual({key: names for key, names in refused.items() if names}, {
            "Group/Write": [str(outside / "a.ply")], "Write": ["//curlew_cache/../../outside/c.ply"],
            "Write.001": [str(cache / "link" / "d.ply")], "Check": [str(outside / "e.json")]})
        for name in ("Group", "Write", "Write.001", "Check"):
            with self.assertRaises(RuntimeError):
                bpy.ops.curlew.bake(tree="hostile")
            tree.nodes[name].mute = True
        self.assertEqual(bpy.ops.curlew.bake(tree="hostile"), {"FINISHED"})  # the rest is harmless
        scene = support.addon("scene_io").tree_of(f"sphere\nscatter count=5\nwrite {outside}/f.ply\n", "scene")
        with self.assertRaises(RuntimeError):
            bpy.ops.curlew.bake(tree=scene.name)
        self.assertEqual(list(outside.iterdir()), [])
        self.assertEqual(bpy.ops.curlew.bake(tree=scene.name, allow_writing=True), {"FINISHED"})
        self.assertEqual([path.name for path in outside.iterdir()], ["f.ply"])

    def test_a_frame_is_what_one_bake_of_it_is(self):
        for threaded in (False, True):
            support.empty()
            self.scene = bpy.context.scene
            build = growing()
            if threaded:
                self.threaded()
            seen = {}
            for frame in (1, 5, 11):
                self.scene.frame_set(frame)
                if threaded:
                    self.assertIsNone(build.points.target if frame == 1 else None)
                    self.settle()
                for node in (build.points, build.curves, build.mesh, build.volume):
                    self.assertEqual(node.error, "")
                    self.assertTrue(shown(node).name.startswith("frame_"))
                seen[frame] = contents(shown(build.points))
                self.assertEqual(len(seen[frame]), 4)
                # Within half a voxel (1/16). The mean of 200 points within a radius of 0.2 has a standard deviation of 0.006.
                size = max(v.co.x for v in build.mesh.target.data.vertices)
                self.assertAlmostEqual(size, bpy.data.objects["Sphere"].matrix_world[0][0], delta=0.05)
                center = np.mean([v.co for v in build.points.target.data.vertices], axis=0)
                self.assertAlmostEqual(center[0], bpy.data.objects["empty"].matrix_world.translation.x, delta=0.05)
                self.assertTrue(build.tree.message.startswith(f"frame {frame} baked"))
            self.scene.frame_set(5)
            if threaded:
                self.settle()
            self.assertAlmostEqual(build.tree.nodes["Noise"].o_frequency, 1.352, places=5)  # Blender eases in and out
            job = self.bake.bake(build.tree)
            self.assertEqual(shown(build.points), job.folder)
            self.assertEqual(contents(job.folder), seen[5])
            for name in seen[5]:
                self.assertEqual(len({repr(seen[frame][name]) for frame in seen}), 3, name)

    def test_a_gpu_shows_what_the_processor_shows(self):
        """In a thread, as in the interface. Steps of both devices differ near stagnation points only."""
        gpus = subprocess.run([support.COMMAND, "-device", "list"], capture_output=True, text=True, check=False)
        if gpus.returncode != 0 or not gpus.stdout:
            self.skipTest(f"there is no GPU, and no driver in software: {gpus.stderr}")
        places = {}
        for device in ("cpu", "gpu"):
            support.empty()
            self.threaded()
            build = Tree("live")
            flow = build.around(support.monkey())
            moved = build.add("advect", flow, build.add("scatter", flow, count=500), duration=0.2, steps=10, device=device)
            points = build.add("CurlewParticlesResult", moved)
            grid = build.add("velocity", flow, dim=12, device=device)
            volume = build.add("CurlewVolumeResult", (grid, "Velocity"))
            build.tree.bake_on_frame = True
            bpy.context.scene.frame_set(2)
            self.settle()
            self.assertEqual((moved.error, grid.error, points.error), ("", "", ""))
            self.assertIsNotNone(volume.target)
            places[device] = np.array([v.co for v in points.target.data.vertices])
        apart = np.linalg.norm(places["gpu"] - places["cpu"], axis=1)
        self.assertEqual(len(apart), 500)
        self.assertGreater(apart.max(), 0, "both are computed by the processor")
        self.assertLess(np.median(apart), 1e-5)

    def test_a_still_is_of_a_moment(self):
        """A still depends on the frame only if the tree has expressions."""
        build = Tree()
        noise = build.add("noise")
        build.add("CurlewParticlesResult", build.add("scatter", build.add("dfvn", noise, build.add("noise", seed=1)), count=9))
        plan_of = support.addon("job").plan_of
        self.scene.frame_set(7)
        self.assertNotIn("moment", plan_of(build.tree, self.scene).graph)
        noise.set_option("translate", "{F},{T},{fps}")
        self.assertEqual(plan_of(build.tree, self.scene).graph["moment"], {"frame": 7, "fps": 24, "time": 0.25})
        self.bake.bake(build.tree)
        moving = contents(shown(build.tree.nodes["Particles Result"]))
        noise.set_option("translate", "7,0.25,24")
        self.bake.bake(build.tree)
        self.assertEqual(contents(shown(build.tree.nodes["Particles Result"])), moving)

    def numbered(self, *names, frames=(1, 2, 3)):
        """Writes one point for each frame, at its number, with these patterns as names."""
        for name in names:
            for frame in frames:
                (support.WORK / name.format(frame)).write_text(f"x,y,z\n{frame},0,0\n")

    def test_a_still_reads_the_files_of_its_frame(self):
        self.numbered("still.{:04d}.csv")
        build = Tree()
        read = build.add("read")
        result = build.add("CurlewParticlesResult", (read, "Points"))
        self.scene.frame_set(3)
        for pattern in ("$F4", "####", "%04d", "%4d"):
            read.words = str(support.WORK / f"still.{pattern}.csv")
            self.bake.bake(build.tree)
            self.assertEqual(result.target.data.vertices[0].co.x, 3, pattern)
        # What looks like the frame at first sight does not make a still depend on it.
        plan_of = support.addon("job").plan_of
        for name in ("100%.0001.csv", "$#$#$#$#.csv", "$%04d.csv", "{{F}.csv", "a#b.csv"):
            read.words = f"'{support.WORK / name}'"
            self.assertNotIn("moment", plan_of(build.tree, self.scene).graph, name)

    def test_a_still_shows_the_pose_of_its_frame(self):
        walker = support.SOURCE / "scenes/walker.glb"
        build = Tree()
        read = build.add("read", words=str(walker), clip="walk")
        result = build.add("CurlewMeshResult", (read, "Meshes"))
        plan_of = support.addon("job").plan_of

        def pose(frame):
            self.scene.frame_set(frame)
            self.bake.bake(build.tree)
            vertices = result.target.data.vertices
            found = np.empty(3 * len(vertices), np.float32)
            vertices.foreach_get("co", found)
            return found

        first, later = pose(1), pose(8)
        self.assertGreater(np.abs(first - later).max(), 0.1)
        np.testing.assert_array_equal(pose(-5), first)
        read.set_option("time", str(7 / 24))
        np.testing.assert_allclose(pose(1), later, atol=1e-5)
        read.reset_option("time")
        read.set_option("clip", "none")
        self.assertNotIn("moment", plan_of(build.tree, self.scene).graph)
        # A model without animation.
        still = support.WORK / "still.gltf"
        still.write_text('{"asset": {"version": "2.0"}}')
        read.reset_option("clip")
        read.words = str(still)
        self.assertNotIn("moment", plan_of(build.tree, self.scene).graph)

    def test_a_still_of_a_flow_that_changes_by_itself_has_a_moment(self):
        build = Tree()
        points = build.add("scatter", count=5, box="0,0,0,1,1,1")
        build.add("CurlewParticlesResult", build.add("advect", build.add("enright"), points))
        self.assertIn("moment", support.addon("job").plan_of(build.tree, self.scene).graph)

    def test_only_what_changes_is_evaluated(self):
        """A tree's session continues from its last run."""
        build = growing()
        self.scene.frame_set(3)
        session = self.live._sessions._kept["live"].session
        self.assertIn("Mesh to Level Set", session.evaluated)
        build.tree.nodes["Scatter"].set_option("seed", "5")
        self.scene.frame_set(3)
        evaluated = set(session.evaluated)
        self.assertIs(self.live._sessions._kept["live"].session, session)
        self.assertIn("Scatter", evaluated)
        self.assertFalse({"Mesh Object", "Mesh to Level Set", "Noise", "Trace", "Velocity"} & evaluated)
        job = self.bake.bake(build.tree)
        self.assertEqual(contents(job.folder), contents(self.live_folder(build)))

    def live_folder(self, build):
        """Returns the folder of the current frame, baked on frame change."""
        self.scene.frame_set(self.scene.frame_current)
        return shown(build.points)

    def test_an_exported_still_is_of_its_frame(self):
        build = growing()
        build.tree.bake_on_frame = False
        build.tree.nodes["Mesh Object"].animated = True
        self.scene.frame_set(7)
        there = support.WORK / "exported"
        there.mkdir(exist_ok=True)
        support.addon("scene_io").export(build.tree, there / "scene.txt", self.scene)
        done = support.run_command("scene.txt", there)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        job = self.bake.bake(build.tree)
        self.assertTrue((there / "scene_Sphere.0007.ply").exists())
        self.assertEqual((job.folder / "Volume_Result.vdb").read_bytes(), (there / "scene_Volume_Result.vdb").read_bytes())

    def test_each_option_counts(self):
        """Keyframes of integers, flags, choices and vectors take effect."""
        build = Tree("keys")
        noise = build.add("noise")
        keyed(noise, "o_octaves", ((1, 1), (11, 5)))
        wind = build.add("uniform")
        keyed(wind, "o_velocity", ((1, (0, 0, 0)), (11, (1, 2, 4))))
        trace = build.add("trace")
        keyed(trace, "o_integrate", ((1, "forward"), (11, "both")))
        bound = build.add("bound")
        keyed(bound, "o_separate", ((1, False), (11, True)))
        build.tree.nodes.remove(build.add("noise"))
        gone = build.add("noise")
        keyed(gone, "o_frequency", ((1, 1), (2, 2)))
        build.tree.nodes.remove(gone)
        self.scene.frame_set(1)
        self.assertEqual((noise.o_octaves, trace.o_integrate, bound.o_separate), (1, "forward", False))
        self.scene.frame_set(6)
        self.assertEqual((noise.o_octaves, list(wind.o_velocity)), (3, [0.5, 1, 2]))
        self.scene.frame_set(11)
        self.assertEqual((noise.o_octaves, trace.o_integrate, bound.o_separate), (5, "both", True))
        self.assertEqual(wind.given()["velocity"], "1,2,4")

    def test_a_sequence_has_keyframes_too(self):
        build = Tree("keys")
        wind = build.add("uniform", velocity="0,0,1")
        keyed(wind, "o_velocity", ((1, (0, 0, 0)), (5, (1, 2, 4))))
        shape = build.add("sphere")
        keyed(shape, "o_radius", ((1, 0.25), (5, 0.5)))
        points = build.add("jitter", shape, box="-1,-1,-1,1,1,1", spacing=0.06)
        keyed(points, "o_seed", ((1, 3), (5, 7)))
        node = build.add("CurlewParticlesResult", points)
        build.tree.sequence = True
        self.scene.frame_start, self.scene.frame_end = 1, 5
        self.scene.frame_set(2)
        self.bake.bake(build.tree)
        seen = []
        for frame in range(1, 6):
            self.scene.frame_set(frame)
            seen.append(np.array([v.co for v in node.target.data.vertices]))
        self.assertEqual(len({len(points) for points in seen}), 5)
        build.tree.sequence = False
        for frame in (1, 3, 5):
            self.scene.frame_set(frame)
            self.bake.bake(build.tree)
            still = np.array([v.co for v in node.target.data.vertices])
            self.assertEqual(still.shape, seen[frame - 1].shape)
            self.assertLess(np.abs(still - seen[frame - 1]).max(), 1e-6)  # the slopes have 7 digits
        trace = build.add("trace", wind, node.inputs[0].links[0].from_node, maxLength=1)
        build.add("CurlewCurvesResult", trace)
        keyed(trace, "o_integrate", ((1, "forward"), (5, "both")))
        build.tree.sequence = True
        with self.assertRaises(RuntimeError) as raised:
            bpy.ops.curlew.bake(tree=build.tree.name)
        self.assertIn("'integrate' changes during the sequence", str(raised.exception))
        self.assertTrue(trace.error)

    def test_a_sequence_wins(self):
        build = growing()
        build.tree.sequence = True
        self.scene.frame_set(5)
        self.assertEqual(self.folders(build.tree), [])
        self.assertEqual(build.tree.message, self.live.SEQUENCE_WINS)
        build.tree.sequence = False
        build.add("frames", words="1-3")
        self.scene.frame_set(6)
        self.assertEqual(self.folders(build.tree), [])

    def test_what_is_in_the_cache_is_not_baked_again(self):
        self.caches()

    def test_the_same_beside_a_saved_file(self):
        blend = support.WORK / "caches" / "a.blend"
        blend.parent.mkdir(exist_ok=True)
        bpy.ops.wm.save_as_mainfile(filepath=str(blend))
        self.caches()

    def caches(self):
        build = growing()
        build.tree.keep_frames = 4
        times = {}
        for frame in (1, 2, 3, 2, 1):
            self.scene.frame_set(frame)
            times.setdefault(frame, []).append(shown(build.points))
        self.assertEqual(times[1][0], times[1][1])
        self.assertEqual(times[2][0], times[2][1])
        self.assertEqual(len(self.folders(build.tree)), 3)
        before = (times[1][0] / "Particles_Result.npz").stat().st_mtime_ns
        self.scene.frame_set(1)
        self.assertEqual((times[1][0] / "Particles_Result.npz").stat().st_mtime_ns, before)
        for frame in range(1, 13):
            self.scene.frame_set(frame)
            self.assertLessEqual(len(self.folders(build.tree)), 4)
        self.assertTrue(shown(build.points).is_dir())
        self.assertEqual(self.cache.clear(build.tree)[0], 3)
        # A changed mesh or a changed option needs another bake.
        there = {shown(build.points)}
        bpy.data.objects["Sphere"].data.vertices[0].co.z += 0.1
        self.scene.frame_set(12)
        there.add(shown(build.points))
        build.tree.nodes["Scatter"].set_option("seed", "5")
        self.scene.frame_set(12)
        there.add(shown(build.points))
        self.assertEqual(len(there), 3)

    def test_files_that_are_written_again_are_read_again(self):
        """Names that the digest of a bake has to expand: with the frame, with escapes, with an expression."""
        for pattern in ("again.$F4.csv", "again.####.csv", "again.%04d.csv", "again.000{F}.csv", "{{$$$#$%.csv", "//again.$F4.csv"):
            support.empty()
            self.scene = bpy.context.scene
            bpy.ops.wm.save_as_mainfile(filepath=str(support.WORK / "again.blend"))
            self.numbered("again.{:04d}.csv")
            (support.WORK / "{$#%.csv").write_text("x,y,z\n3,0,0\n")
            build = Tree()
            read = build.add("read", words=f"'{pattern if pattern.startswith('//') else support.WORK / pattern}'")
            result = build.add("CurlewParticlesResult", (read, "Points"))
            build.tree.bake_on_frame = True
            x = []
            for change in (False, True):
                if change:
                    for name in ("again.0003.csv", "{$#%.csv"):
                        (support.WORK / name).write_text("x,y,z\n3,0,0\n9,0,0\n")
                self.scene.frame_set(3)
                x.append([v.co.x for v in result.target.data.vertices])
            self.assertEqual(x, [[3], [3, 9]], pattern)
        # A file of another frame does not matter.
        before = shown(result)
        (support.WORK / "again.0002.csv").write_text("x,y,z\n7,0,0\n")
        self.scene.frame_set(3)
        self.assertEqual(shown(result), before)

    def test_no_part_of_a_bake_is_left(self):
        build, _ = self.begin_long()
        self.assertEqual([name[:5] for name in self.folders(build.tree)], ["part_"])
        self.live.on_load()
        self.assertEqual(self.folders(build.tree), [])


class Scrubbing(Live):
    def test_the_newest_frame_wins(self):
        self.threaded()
        build = growing()
        frames, plain = [], self.live._show

        def watched(name, job):
            frames.append(job.frame)
            self.assertEqual(job.frame, self.scene.frame_current)
            plain(name, job)

        self.live._show = watched
        try:
            for frame in range(1, 31):
                self.scene.frame_set(frame)
                self.live.step()
                time.sleep(0.005 * (frame % 3))
            self.settle()
        finally:
            self.live._show = plain
        self.assertEqual(frames[-1], 30)
        self.assertEqual(frames, sorted(frames))
        print("frames shown while scrubbing over 30:", frames)
        result = contents(shown(build.points))
        self.assertEqual(contents(self.bake.bake(build.tree).folder), result)

    def test_an_older_bake_is_cancelled(self):
        build, job = self.begin_long()
        began = time.monotonic()
        next(n for n in build.tree.nodes if n.bl_idname == "CurlewNode_advect").set_option("steps", "1")
        self.scene.frame_set(4)
        job.wait()
        print(f"a bake of minutes made way after {1000 * (time.monotonic() - began):.0f} ms")
        self.settle()
        self.assertFalse(job.running())
        self.assertTrue(job.cancelled)
        self.assertTrue(build.tree.message.startswith("frame 4 baked"))
        self.assertEqual(len(build.points.target.data.vertices), 200000)

    def test_a_change_of_frame_does_not_wait(self):
        """Uses the obstacle wake around Suzanne. Prints the times that the main thread needs."""
        support.monkey(closed=False)
        bpy.ops.curlew.quick(preset="WAKE", bake=False)
        tree = bpy.data.node_groups[bpy.context.scene.curlew_tree]
        keyed(tree.nodes["Noise"], "o_seed", ((1, 0), (20, 19)))
        for scene in bpy.data.scenes:
            scene.frame_set(1)
        changes, starts, shows, updates, bakes = [], [], [], [], []
        for live in (False, True):
            tree.bake_on_frame = live
            self.threaded()
            for frame in range(2, 9):
                began = time.perf_counter()
                bpy.context.scene.frame_set(frame)
                changes.append((live, time.perf_counter() - began))
                self.assertEqual(self.live.idle(), not live)
                self.assertFalse(self.live._jobs)  # no job has started yet
                if not live:
                    continue
                began = time.perf_counter()
                self.live.step()
                starts.append(time.perf_counter() - began)
                job = self.live._jobs[tree.name]
                job.wait()
                bakes.append(job.seconds)
                began = time.perf_counter()
                self.settle()
                shows.append(time.perf_counter() - began)
                began = time.perf_counter()
                bpy.context.view_layer.update()
                updates.append(time.perf_counter() - began)
        for what, seconds in (("change, off", [s for live, s in changes if not live]),
                              ("change, on", [s for live, s in changes if live]), ("start", starts), ("bake", bakes),
                              ("show", shows), ("Blender's evaluation of the curves", updates)):
            print(f"obstacle wake, {what}: {1000 * np.median(seconds):.1f} ms, at most {1000 * max(seconds):.1f} ms")
        self.assertGreater(len([o for o in bpy.data.objects if o.get("curlew_kind") == "curves"]), 0)


class Meanwhile(Live):
    """The tree, its file or the add-on is removed during a bake."""

    def test_the_tree_is_removed(self):
        build, job = self.begin_long()
        bpy.data.node_groups.remove(build.tree)
        self.scene.frame_set(4)
        job.cancelled = True
        self.settle()
        self.assertTrue(self.live.idle())
        self.assertNotIn("long Particles", bpy.data.objects)

    def test_a_node_is_removed(self):
        build, job = self.begin_long()
        build.tree.nodes.remove(build.points)
        job.stop()
        job.cancelled, job.error = False, None
        self.settle()
        self.assertTrue(build.tree.message.startswith("frame 3 baked"))

    def test_it_is_switched_off(self):
        build, job = self.begin_long()
        build.tree.bake_on_frame = False
        job.stop()
        self.settle()
        self.assertEqual(build.tree.message, "")

    def test_another_file_is_loaded(self):
        _, job = self.begin_long()
        support.empty()
        self.assertFalse(job.running())
        self.assertTrue(self.live.idle())
        self.assertEqual(leftovers(), [])
        self.assertFalse(bpy.app.timers.is_registered(self.live.step))

    def test_the_addon_is_disabled(self):
        _, job = self.begin_long()
        bpy.ops.preferences.addon_disable(module=support.NAME)
        self.assertFalse(job.running())
        self.assertEqual(leftovers(), [])
        for name in ("frame_change_post", "undo_post", "redo_post", "load_pre", "render_init", "render_complete",
                     "render_cancel"):
            self.assertEqual([h for h in getattr(bpy.app.handlers, name) if support.NAME in h.__module__], [])
        self.scene.frame_set(9)
        bpy.ops.preferences.addon_enable(module=support.NAME)

    def test_undo(self):
        self.threaded()
        build = growing()
        self.scene.frame_set(2)
        self.settle()
        bpy.ops.ed.undo_push(message="before")
        build.tree.nodes["Scatter"].set_option("count", "50")
        bpy.ops.ed.undo_push(message="after")
        counts = set()
        for k in range(4):
            bpy.context.scene.frame_set(3 + k)
            self.live.step()
            self.assertEqual(len(self.live._jobs), 1)
            (bpy.ops.ed.undo, bpy.ops.ed.redo)[k % 2]()
            self.settle()
            tree = bpy.data.node_groups["live"]
            result = tree.nodes["Particles Result"]
            count = len(result.target.data.vertices)
            self.assertEqual(count, tree.nodes["Scatter"].o_count)
            counts.add(count)
            self.assertTrue(tree.message.startswith(f"frame {bpy.context.scene.frame_current} baked"), tree.message)
        self.assertEqual(counts, {200, 50})

    def test_a_manual_bake_goes_first(self):
        build = growing()
        self.threaded()
        job = support.addon("job").prepare(build.tree, self.scene)
        self.bake.running[build.tree.name] = job
        self.scene.frame_set(4)
        self.live.step()
        self.assertFalse(self.live._jobs)
        del self.bake.running[build.tree.name]
        self.settle()
        self.assertTrue(build.tree.message.startswith("frame 4 baked"))


class Errors(Live):
    def wrong(self, threaded):
        build = Tree("wrong")
        bad = build.add("noise", frequency="{1/(F-5)^2}")
        flow = build.add("dfvn", bad, build.add("noise", seed=1))
        build.add("CurlewParticlesResult", build.add("scatter", flow, count=10))
        build.tree.bake_on_frame = True
        said = io.StringIO()
        with contextlib.redirect_stderr(said):
            for frame in (4, 5, 5, 5, 6, 7):
                self.scene.frame_set(frame)
                if threaded:
                    self.settle()
                self.assertEqual("{1/(F-5)^2} is inf" in bad.error, frame == 5)
                self.assertEqual(bad.color.r > 0.4, frame == 5)
                self.assertEqual(build.tree.message.startswith("frame"), frame != 5)
            build.tree.links.clear()
            self.scene.frame_set(8)
            if threaded:
                self.settle()
        nodes = [n.name for n in build.tree.nodes if n.error]
        self.assertEqual(nodes, ["Particles Result"])
        lines = said.getvalue().splitlines()
        self.assertEqual(len(lines), 2, lines)
        self.assertTrue(lines[0].startswith("Curlew: tree 'wrong', frame 5: "), lines)

    def test_they_are_on_the_node_and_said_once(self):
        self.wrong(False)

    def test_also_from_threads(self):
        self.wrong(True)

    def test_a_mesh_that_cannot_be_read_spoils_no_other(self):
        """One whose vertices are not numbers, between others that move, come and go."""
        balls = []
        for x in (0, 3, 6):
            bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8, radius=0.5, location=(x, 0, 0))
            balls.append(bpy.context.active_object)
        build = Tree("spoiled")
        read = [build.add("CurlewMeshObject", object=ball) for ball in balls]
        shown = [build.add("CurlewMeshResult", each) for each in read]
        build.tree.bake_on_frame = True
        self.scene.frame_set(1)
        self.assertEqual(build.tree.message[:13], "frame 1 baked")
        height = balls[1].data.vertices[0].co.z
        # The first one moves, the second one breaks, the third one goes.
        balls[0].location.y = 9
        balls[1].data.vertices[0].co.z = float("nan")
        read[2].mute = shown[2].mute = True
        self.scene.frame_set(2)
        self.assertIn("finite", build.tree.message)
        balls[0].location.y = 0
        balls[1].data.vertices[0].co.z = height
        self.scene.frame_set(3)
        self.assertEqual(build.tree.message[:13], "frame 3 baked")
        self.assertLess(max(v.co.y for v in shown[0].target.data.vertices), 1)
        read[2].mute = shown[2].mute = False
        self.scene.frame_set(4)
        self.assertEqual(build.tree.message[:13], "frame 4 baked")

    def test_a_cache_that_cannot_be_written(self):
        build = growing()
        build.tree.bake_on_frame = False
        blocking = support.blocked_cache("locked_live")
        build.tree.bake_on_frame = True
        with contextlib.redirect_stderr(io.StringIO()):
            self.scene.frame_set(3)
        self.assertIn("cannot write the cache", build.tree.message)
        blocking.unlink()


class Renders(Live):
    """Each picture of an animation shows its own frame."""

    def stage(self):
        scene = self.scene
        scene.render.engine = "CYCLES"
        scene.cycles.samples = 2
        scene.cycles.use_denoising = False
        scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 64, 48, 100
        lamp = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "SUN"))
        lamp.data.energy = 5
        camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        camera.location, camera.rotation_euler = (0, -4, 0), (np.pi / 2, 0, 0)
        for obj in (lamp, camera):
            scene.collection.objects.link(obj)
        scene.camera = camera
        scene.frame_start, scene.frame_end = 3, 5

    def frame(self, name):
        self.scene.render.filepath = str(support.WORK / name)
        bpy.ops.render.render(write_still=True)
        return support.image(support.WORK / f"{name}.png")

    def animation(self, blur):
        build = growing()
        self.stage()
        self.scene.render.use_motion_blur = blur
        self.scene.render.filepath = str(support.WORK / f"live_{blur}_")
        frames = []
        bpy.app.handlers.render_pre.append(lambda *_: frames.append(self.scene.frame_current))
        bpy.ops.render.render(animation=True)
        bpy.app.handlers.render_pre.pop()
        self.assertEqual(frames, [3, 4, 5])
        self.assertFalse(self.live._rendering)
        moving = [support.image(support.WORK / f"live_{blur}_{frame:04d}.png") for frame in frames]
        build.tree.bake_on_frame = False
        for frame, picture in zip(frames, moving):
            self.scene.frame_set(frame)
            self.bake.bake(build.tree)
            still = self.frame(f"still_{blur}_{frame}")
            self.assertGreater(still[:, :, :3].std(), 0.02)
            self.assertTrue(np.array_equal(still, picture), np.abs(still - picture).max())
        self.assertGreater(np.abs(moving[0] - moving[2]).max(), 0.1)

    def test_an_animation(self):
        self.animation(False)

    def test_an_animation_with_motion_blur(self):
        self.animation(True)

    def in_a_thread(self, function):
        """Calls a function in a thread, as a render from the interface does, and makes the calls that it hands to this
        thread. Returns the names of the threads from which the results' vertices were set."""
        results, threads = support.addon("results"), set()
        plain = results._positions

        def watched(*arguments):
            threads.add(threading.current_thread().name)
            plain(*arguments)

        results._positions = watched
        try:
            thread = threading.Thread(target=function)
            thread.start()
            while thread.is_alive():
                support.addon("main_thread").step()
        finally:
            results._positions = plain
        return threads

    def test_objects_change_in_the_main_thread(self):
        """Blender crashes if the thread of a render changes them."""
        build = growing()
        self.assertTrue(self.scene.render.use_lock_interface)  # the option turns it on
        self.scene.frame_current = 5

        def render():
            self.live.on_render(self.scene)
            self.live.on_frame(self.scene)
            self.live.on_rendered(self.scene)

        main = threading.current_thread().name
        self.assertEqual(self.in_a_thread(render), {main})
        self.assertTrue(build.tree.message.startswith("frame 5 baked"), build.tree.message)
        obj = build.points.target
        self.assertIsNotNone(obj)
        obj["curlew_frames"] = [5, 6]
        self.assertEqual(self.in_a_thread(lambda: support.addon("results").on_frame(self.scene)), {main})

    def test_a_call_is_repeated_if_blender_refuses_changes(self):
        """Blender refuses them while it draws."""
        refused = AttributeError("Writing to ID classes in this context is not allowed: Scene, Object datablock")
        for error, refusals, wanted in ((refused, 3, 4), (AttributeError("no such attribute"), 1, 1)):
            calls, returned, failed = [], [], []

            @support.addon("main_thread").in_main_thread
            def change(error, refusals):
                calls.append(error)
                if len(calls) <= refusals:
                    raise error
                return "changed"

            def run():
                try:
                    returned.append(change(error, refusals))
                except AttributeError as caught:
                    failed.append(caught)

            self.in_a_thread(run)
            self.assertEqual(len(calls), wanted)
            self.assertEqual(returned, ["changed"] if error is refused else [])
            self.assertEqual(failed, [] if error is refused else [error])

    def test_a_render_does_not_wait_forever_for_the_interface(self):
        main_thread, failed = support.addon("main_thread"), []
        limit, main_thread._LIMIT = main_thread._LIMIT, 0.1

        def run():
            try:
                main_thread.in_main_thread(failed.clear)()
            except RuntimeError as error:
                failed.append(str(error))

        try:
            thread = threading.Thread(target=run)
            thread.start()
            thread.join()
        finally:
            main_thread._LIMIT = limit
        self.assertEqual(len(failed), 1)
        self.assertIn("has not answered", failed[0])
        main_thread.step()
        self.assertEqual(len(failed), 1)  # the call is not made later

    def test_a_still_waits_for_its_bake(self):
        build = growing()
        self.stage()
        self.threaded()
        self.scene.frame_set(4)
        self.live.step()
        self.live.synchronous = self.synchronous
        one = self.frame("waited")
        self.assertTrue(self.live.idle())
        build.tree.bake_on_frame = False
        self.bake.bake(build.tree)
        self.assertTrue(np.array_equal(one, self.frame("baked")))


support.main(Frames, Scrubbing, Meanwhile, Errors, Renders)
