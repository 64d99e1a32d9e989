# SPDX-License-Identifier: Apache-2.0
"""What an artist does besides pressing Bake: save, save elsewhere, undo, animate, link outputs that are off."""
# Longer than 400 lines in time, because each Blender process takes seconds to start.

import errno
import functools
import shutil
import sys
import time
import unittest
from pathlib import Path
from unittest import mock

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import support  # noqa: E402
from support import Tree  # noqa: E402


def rising(name="rising", count=20):
    """Builds a sequence of points that rise by 0.1 in each frame."""
    build = Tree(name)
    build.tree.use_fake_user = True
    flow = build.add("uniform", velocity="0,0,2.4", box="-9,-9,-9,9,9,9")
    points = build.add("advect", flow, build.add("scatter", flow, count=count, box="-1,-1,-1,1,1,1"))
    build.result = build.add("CurlewParticlesResult", points)
    build.volume = build.add("CurlewVolumeResult", (build.add("velocity", flow, dim=8, name="velocity"), "Velocity"))
    build.tree.sequence = True
    return build


def height(obj):
    """Returns the mean height of an object's points."""
    return float(np.mean([v.co.z for v in obj.data.vertices]))


def heights(obj, frames):
    """Returns the mean heights in frames, relative to the first."""
    found = []
    for frame in frames:
        bpy.context.scene.frame_set(frame)
        found.append(height(obj))
    return [round(z - found[0], 3) for z in found]


def folder(name):
    """Returns a new folder."""
    path = support.WORK / name
    shutil.rmtree(path, ignore_errors=True)
    path.mkdir()
    return path


class Case(unittest.TestCase):
    def setUp(self):
        support.empty()
        self.bake = support.addon("bake")
        self.scene = bpy.context.scene
        self.scene.frame_start, self.scene.frame_end = 1, 4


class Saving(Case):
    """Bakes stay with the file."""

    def check(self, name="rising"):
        """The particles move, and the volume can be read."""
        self.assertEqual(heights(bpy.data.objects[f"{name} Particles"], (1, 2, 4)), [0, 0.1, 0.3])
        volume = bpy.data.objects[f"{name} Volume"].data
        for frame in (1, 4):
            bpy.context.scene.frame_set(frame)
            volume.grids.unload()
            self.assertTrue(volume.grids.load(), volume.grids.error_message)
            self.assertTrue(Path(bpy.path.abspath(volume.grids.frame_filepath)).exists())

    def test_a_bake_before_the_file_is_saved(self):
        build = rising()
        self.bake.bake(build.tree)
        place = folder("first")
        bpy.ops.wm.save_as_mainfile(filepath=str(place / "a.blend"))
        self.check()
        (baked,) = (place / "curlew_cache" / "rising").iterdir()
        bpy.ops.wm.open_mainfile(filepath=str(place / "a.blend"))
        self.check()
        self.assertTrue(bpy.data.objects["rising Volume"].data.filepath.startswith("//curlew_cache"))
        # Into another folder, where the bakes of the first are found.
        other = folder("second")
        bpy.ops.wm.save_as_mainfile(filepath=str(other / "b.blend"))
        self.check()
        self.assertFalse((other / "curlew_cache").exists())
        bpy.ops.wm.open_mainfile(filepath=str(other / "b.blend"))
        self.check()
        # The first file has not changed, and can move together with its cache.
        self.assertTrue(baked.exists())
        moved = support.WORK / "moved"
        shutil.rmtree(moved, ignore_errors=True)
        place.rename(moved)
        bpy.ops.wm.open_mainfile(filepath=str(moved / "a.blend"))
        self.check()
        self.assertEqual(support.addon("cache").clear(bpy.data.node_groups["rising"]), (0, 0, 0))

    def test_a_saved_bake_moves_with_its_file(self):
        place = folder("third")
        build = rising()
        bpy.ops.wm.save_as_mainfile(filepath=str(place / "a.blend"))
        self.bake.bake(build.tree)
        bpy.ops.wm.save_mainfile()
        bpy.ops.wm.open_mainfile(filepath=str(place / "a.blend"))
        self.assertTrue(bpy.data.objects["rising Particles"]["curlew_cache"].startswith(str(place)))
        moved = support.WORK / "fourth"
        shutil.rmtree(moved, ignore_errors=True)
        place.rename(moved)
        bpy.ops.wm.open_mainfile(filepath=str(moved / "a.blend"))
        self.check()

    def test_a_copy_of_an_unsaved_file(self):
        build = rising()
        self.bake.bake(build.tree)
        bpy.ops.wm.save_as_mainfile(filepath=str(folder("copy") / "a.blend"), copy=True)
        self.check()

    def test_others_with_the_same_name_are_left_alone(self):
        place = folder("shared")
        for k in range(2):
            support.empty()
            self.scene = bpy.context.scene
            self.scene.frame_start, self.scene.frame_end = 1, 4
            build = rising()
            self.bake.bake(build.tree)
            bpy.ops.wm.save_as_mainfile(filepath=str(place / f"{k}.blend"))
            self.check()
        self.assertEqual(len(list((place / "curlew_cache" / "rising").iterdir())), 2)

    def test_a_project_folder_whose_name_looks_like_a_frame(self):
        for name in ("shot_####", "100%d $# {1+1} $F"):
            support.empty()
            self.scene = bpy.context.scene
            self.scene.frame_start, self.scene.frame_end = 1, 4
            place = folder(name)
            bpy.ops.wm.save_as_mainfile(filepath=str(place / "a.blend"))
            build = rising()
            (place / "seeds.0001.csv").write_text("x,y,z\n0,0,0\n0.5,0,0\n")
            read = build.add("read", words="//seeds.%04d.csv", when="once")
            build.add("CurlewParticlesResult", (read, "Points"))
            build.add("write", build.tree.nodes["Advect"], words="//dust.$F.csv")
            self.bake.bake(build.tree)
            self.check()
            self.assertEqual(sorted(path.name for path in place.glob("*.csv")), [*(f"dust.{k}.csv" for k in range(1, 5)), "seeds.0001.csv"])
            support.addon("scene_io").export(build.tree, place / "a##{.txt", self.scene)
            ran = support.run_command("a$#$#{{.txt", place)
            self.assertEqual(ran.returncode, 0, ran.stderr)
            self.assertTrue((place / "a##{_Volume_Result.0003.vdb").exists())

    def clear(self):
        """Returns the number of bakes that Remove Old Bakes removes."""
        return support.addon("cache").clear(bpy.data.node_groups["rising"])[0]

    def test_what_another_version_of_the_file_shows_is_not_deleted(self):
        """Save As gives a second version of the shot, which shows the bakes of the first."""
        place = folder("versions")
        first, second = (str(place / f"shot_v00{k}.blend") for k in (1, 2))
        build = rising()
        bpy.ops.wm.save_as_mainfile(filepath=first)
        self.bake.bake(build.tree)
        bpy.ops.wm.save_mainfile()
        bpy.ops.wm.save_as_mainfile(filepath=second)
        self.bake.bake(build.tree)
        self.assertEqual(self.clear(), 0)
        bpy.ops.wm.save_mainfile()
        bpy.ops.wm.open_mainfile(filepath=first)
        self.check()
        # The other direction.
        bpy.ops.wm.save_as_mainfile(filepath=second)
        bpy.ops.wm.open_mainfile(filepath=first)
        self.scene = bpy.context.scene
        bpy.ops.curlew.free_bake(tree="rising")
        self.bake.bake(bpy.data.node_groups["rising"])
        bpy.ops.wm.save_mainfile()
        bpy.ops.wm.open_mainfile(filepath=second)
        self.check()
        # A file deletes the bakes that it alone has shown.
        self.bake.bake(bpy.data.node_groups["rising"])
        bpy.ops.wm.save_mainfile()
        self.assertEqual(self.clear(), 1)
        bpy.ops.wm.open_mainfile(filepath=first)
        self.check()

    def test_what_the_file_on_disk_shows_is_kept_until_the_file_is_saved(self):
        place = str(folder("not_saved") / "a.blend")
        build = rising()
        bpy.ops.wm.save_as_mainfile(filepath=place)
        self.bake.bake(build.tree)
        bpy.ops.wm.save_mainfile()
        self.bake.bake(build.tree)
        self.assertEqual(self.clear(), 0)
        bpy.ops.wm.open_mainfile(filepath=place)
        self.check()
        self.bake.bake(bpy.data.node_groups["rising"])
        self.assertEqual(self.clear(), 1)  # the bake of which the file on disk knows nothing
        bpy.ops.wm.save_mainfile()
        self.assertEqual(self.clear(), 1)

    def test_what_a_copy_of_the_file_shows_is_not_deleted(self):
        """Older Blenders do not say where a copy was saved."""
        place = folder("with_copy")
        build = rising()
        bpy.ops.wm.save_as_mainfile(filepath=str(place / "a.blend"))
        self.bake.bake(build.tree)
        bpy.ops.wm.save_mainfile()
        bpy.ops.wm.save_as_mainfile(filepath=str(place / "copy.blend"), copy=True)
        for _ in range(2):
            self.bake.bake(build.tree)
        bpy.ops.wm.save_mainfile()
        self.assertEqual(self.clear(), 1)
        bpy.ops.wm.open_mainfile(filepath=str(place / "copy.blend"))
        self.check()

    def test_opening_a_file_does_not_make_it_the_only_user_of_an_earlier_bake(self):
        place = folder("earlier_versions")
        build, first, second = rising(), str(place / "a.blend"), str(place / "b.blend")
        bpy.ops.wm.save_as_mainfile(filepath=first)
        self.bake.bake(build.tree)
        bpy.ops.wm.save_mainfile()
        bpy.ops.wm.save_as_mainfile(filepath=second)
        for users in place.glob("curlew_cache/*/*/used_by.txt"):
            users.unlink()
        bpy.ops.wm.open_mainfile(filepath=first)
        self.bake.bake(bpy.data.node_groups["rising"])
        bpy.ops.wm.save_mainfile()
        self.assertEqual(self.clear(), 0)
        bpy.ops.wm.open_mainfile(filepath=second)
        self.check()

    def test_bakes_of_the_last_release_may_belong_to_any_file(self):
        place = folder("earlier")
        build = rising()
        bpy.ops.wm.save_as_mainfile(filepath=str(place / "a.blend"))
        self.bake.bake(build.tree)
        unknown = place / "curlew_cache" / "rising" / "0099"
        unknown.mkdir()
        self.assertEqual(self.clear(), 0)
        self.assertTrue(unknown.exists())

    def test_no_note_is_left_where_files_of_others_are(self):
        place = folder("volumes")
        build = rising()
        job = self.bake.bake(build.tree)
        shutil.copy(next(job.folder.glob("*.vdb")), place / "own.vdb")
        volume = bpy.data.volumes.new("own")
        volume.filepath = str(place / "own.vdb")
        volume.use_fake_user = True
        bpy.ops.wm.save_as_mainfile(filepath=str(folder("volumes_file") / "a.blend"))
        self.assertEqual([path.name for path in place.iterdir()], ["own.vdb"])


class Undo(Case):
    def test_undo_and_redo_of_a_bake(self):
        build = rising()
        bpy.ops.ed.undo_push(message="tree")
        self.assertEqual(bpy.ops.curlew.bake("EXEC_DEFAULT", True, tree="rising"), {"FINISHED"})
        bpy.ops.ed.undo()
        self.assertNotIn("rising Particles", bpy.data.objects)
        bpy.ops.ed.redo()
        self.assertEqual(heights(bpy.data.objects["rising Particles"], (1, 2, 4)), [0, 0.1, 0.3])
        # A second bake with other points, undone in another frame.
        tree = bpy.data.node_groups["rising"]
        next(n for n in tree.nodes if n.bl_idname == "CurlewNode_scatter").set_option("count", "30")
        bpy.ops.ed.undo_push(message="count")
        bpy.ops.curlew.bake("EXEC_DEFAULT", True, tree="rising")
        self.assertEqual(len(bpy.data.objects["rising Particles"].data.vertices), 30)
        bpy.ops.ed.undo()
        self.assertEqual(len(bpy.data.objects["rising Particles"].data.vertices), 20)
        bpy.ops.ed.redo()
        self.assertEqual(len(bpy.data.objects["rising Particles"].data.vertices), 30)
        self.assertEqual(heights(bpy.data.objects["rising Particles"], (1, 2, 4)), [0, 0.1, 0.3])

    def test_free_bake(self):
        build = rising()
        job = self.bake.bake(build.tree)
        bpy.ops.curlew.free_bake(tree="rising")
        self.assertFalse(job.folder.exists())
        self.assertEqual(len(build.result.target.data.vertices), 0)
        self.scene.frame_set(3)
        self.bake.bake(build.tree)
        self.assertEqual(len(build.result.target.data.vertices), 20)


class Missing(Case):
    def test_a_bake_after_its_volume_was_missing(self):
        build = rising()
        job = self.bake.bake(build.tree)
        shutil.rmtree(job.folder)
        volume = build.volume.target.data
        volume.grids.unload()
        self.assertFalse(volume.grids.load())
        self.bake.bake(build.tree)
        self.assertTrue(volume.grids.load())


class Frames(Case):
    def test_every_third_frame(self):
        """The frames between show what the last baked frame shows."""
        build = rising()
        build.add("frames", words="1-7x3")
        job = self.bake.bake(build.tree)
        self.assertEqual(heights(build.result.target, (1, 2, 3, 4, 6, 7, 9)), [0, 0, 0, 0.3, 0.3, 0.6, 0.6])
        files = sorted(path.name for path in job.folder.glob("*.vdb"))
        self.assertEqual(files, [f"Volume_Result.{k:04d}.vdb" for k in range(1, 8)])
        data = build.volume.target.data
        for frame in range(1, 8):
            self.scene.frame_set(frame)
            data.grids.unload()
            self.assertTrue(data.grids.load(), frame)

    def test_a_file_system_without_hard_links(self):
        build = rising()
        build.add("frames", words="1-7x3")
        with mock.patch("os.link", side_effect=PermissionError(errno.EPERM, "Operation not permitted")):
            job = self.bake.bake(build.tree)
        files = [path.read_bytes() for path in sorted(job.folder.glob("*.vdb"))]
        self.assertEqual(len(files), 7)
        self.assertEqual((files[1], files[4]), (files[0], files[3]))

    def test_a_run_up(self):
        """The emitter has filled the air in the first frame, also if that is before the number of frames of the run-up."""
        for start in (1, 101):
            self.scene.frame_start, self.scene.frame_end = start, start + 2
            build = Tree("run up")
            flow = build.add("uniform", velocity="0,0,1", box="-9,-9,-9,9,9,9")
            emitted = build.add("emit", build.add("sphere", radius=0.1), rate=240)
            result = build.add("CurlewParticlesResult", build.add("advect", flow, emitted))
            volume = build.add("CurlewVolumeResult", (build.add("velocity", flow, dim=4, name="velocity"), "Velocity"))
            build.tree.sequence, build.tree.run_up = True, 20
            job = self.bake.bake(build.tree)
            counts = []
            for frame in range(start, start + 3):
                self.scene.frame_set(frame)
                counts.append(len(result.target.data.vertices))
                volume.target.data.grids.unload()
                self.assertTrue(volume.target.data.grids.load(), volume.target.data.grids.error_message)
            self.assertEqual(counts, [200, 210, 220])
            self.assertEqual(len(list(job.folder.glob("*.npz"))), 3)

    def test_a_sequence_that_repeats(self):
        build = rising()
        build.tree.repeat = True
        self.bake.bake(build.tree)
        self.assertEqual(heights(build.result.target, (1, 4, 5, 8, 0)), [0, 0.3, 0, 0.3, 0.3])
        self.assertEqual(build.volume.target.data.sequence_mode, "REPEAT")

    def test_the_first_frame_is_shown_early(self):
        build = rising()
        job = support.addon("job").prepare(build.tree, self.scene)
        shown = []

        def store(frame, session):
            type(job)._store(job, frame, session)
            job.show_early(build.tree, self.scene)
            shown.append(len(build.result.target.data.vertices) if build.result.target else None)

        job._store, job.running = store, lambda: True
        job.run()
        self.assertEqual(shown, [20] * 4)
        self.assertEqual(list(build.result.target["curlew_frames"]), [1, 1])
        del job._store, job.running
        job.finish(build.tree, self.scene)
        self.assertEqual(list(build.result.target["curlew_frames"]), [1, 4])

    def test_points_that_die_fade(self):
        self.scene.frame_end = 40
        build = Tree("fading")
        flow = build.add("uniform", velocity="0,0,1", box="-9,-9,-9,9,9,9")
        emitted = build.add("emit", build.add("sphere", radius=0.1), rate=2400, life=1)
        result = build.add("CurlewParticlesResult", build.add("advect", flow, emitted))
        build.tree.sequence = True
        self.bake.bake(build.tree)
        self.scene.frame_set(40)
        data = result.target.data.attributes
        ages, fades = (np.array([v.value for v in data[name].data]) for name in ("age", "fade"))
        self.assertTrue(np.allclose(fades, np.clip(np.minimum(ages / 0.1, (1 - ages) / 0.25), 0, 1), atol=1e-4))


class Animation(Case):
    def flow(self):
        build = Tree("animated")
        noise = build.add("noise")
        flow = build.add("dfvn", noise, build.add("noise", seed=1))
        build.add("CurlewParticlesResult", build.add("scatter", flow, count=10))
        return build, noise

    def fails(self, build, node, words):
        with self.assertRaises(RuntimeError):
            bpy.ops.curlew.bake(tree=build.tree.name)
        self.assertIn(words, node.error)

    def test_drivers_are_refused(self):
        build, noise = self.flow()
        curve = noise.driver_add("o_frequency")
        curve.driver.expression = "frame"
        self.fails(build, noise, "'frequency' has a driver")
        noise.driver_remove("o_frequency")
        self.assertEqual(bpy.ops.curlew.bake(tree=build.tree.name), {"FINISHED"})

    def test_strips_are_refused(self):
        build, noise = self.flow()
        noise.o_frequency = 1
        noise.keyframe_insert("o_frequency", frame=1)
        self.assertEqual(bpy.ops.curlew.bake(tree=build.tree.name), {"FINISHED"})
        about = build.tree.animation_data
        about.nla_tracks.new().strips.new("pushed down", 1, about.action)
        about.action = None
        self.fails(build, noise, "'frequency' is animated by the strip 'animatedAction'")

    def test_what_moves_is_read_in_each_frame(self):
        """Without a setting: animated objects, children of animated ones, and those with an armature or changing modifiers."""
        may_change = support.addon("sources").may_change
        still = support.monkey()
        self.assertFalse(may_change(still))
        parent = bpy.data.objects.new("parent", None)
        self.scene.collection.objects.link(parent)
        child = support.monkey()
        child.parent = parent
        self.assertFalse(may_change(child))
        parent.keyframe_insert("location", frame=1)
        self.assertTrue(may_change(child))
        rig = bpy.data.objects.new("rig", bpy.data.armatures.new("rig"))
        self.scene.collection.objects.link(rig)
        body = support.monkey()
        body.modifiers.new("rig", "ARMATURE").object = rig
        self.assertFalse(may_change(body))
        rig.keyframe_insert("location", frame=1)
        self.assertTrue(may_change(body))
        keyed = support.monkey(closed=False)
        keyed.shape_key_add(name="base")
        keyed.shape_key_add(name="big").value = 1
        self.assertFalse(may_change(keyed))
        keyed.data.shape_keys.key_blocks["big"].keyframe_insert("value", frame=1)
        self.assertTrue(may_change(keyed))
        still.modifiers.new("wave", "WAVE")
        self.assertTrue(may_change(still))

    def test_a_mesh_that_grows(self):
        bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8)
        ball = bpy.context.active_object
        for frame, size in ((1, 0.5), (4, 1.0)):
            ball.scale = (size,) * 3
            ball.keyframe_insert("scale", frame=frame)
        build = Tree("growing")
        level = build.add("mesh2ls", build.add("CurlewMeshObject", object=ball), dim=24)
        result = build.add("CurlewMeshResult", build.add("ls2mesh", level))
        build.tree.sequence = True
        self.bake.bake(build.tree)
        sizes = []
        for frame in (1, 4):
            self.scene.frame_set(frame)
            sizes.append(max(v.co.x for v in result.target.data.vertices))
        self.assertAlmostEqual(sizes[0], 0.5, delta=0.05)
        self.assertAlmostEqual(sizes[1], 1.0, delta=0.05)
        # One that only could change is read once.
        ball.animation_data_clear()
        ball.modifiers.new("nodes", "NODES")
        with self.assertRaisesRegex(support.addon("actions").TreeError, "turn Sequence off"):
            self.bake.bake(build.tree)
        job = support.addon("job").prepare(build.tree, self.scene)
        self.assertEqual([name.split(".")[1] for name in job.plan.meshes], ["still"])

    def test_sampling_can_be_stopped(self):
        ball = support.monkey()
        ball.keyframe_insert("location", frame=1)
        self.scene.frame_end = 60
        self.scene.frame_set(3)
        build = Tree("sampled")
        level = build.add("mesh2ls", build.add("CurlewMeshObject", object=ball), dim=24)
        build.add("CurlewMeshResult", build.add("ls2mesh", level))
        build.tree.sequence = True
        step, self.bake._STEP = self.bake._STEP, 0  # one frame in each step, however fast the machine is
        self.addCleanup(setattr, self.bake, "_STEP", step)
        run = self.bake.Run(build.tree, self.scene)
        self.assertTrue(run.advance())
        self.assertIsNone(run.job)
        title, fraction = run.progress()
        self.assertEqual(title, "sampling objects")
        self.assertTrue(0 < fraction < 1)
        run.cancel()
        self.assertFalse(run.advance())
        self.assertIsNone(run.job)
        self.assertEqual(self.scene.frame_current, 3)


class Pressed(Case):
    """What happens while a bake runs that a button has started. These tests stand in for the window and its timer."""

    def press(self, tree):
        """Starts the bake of a tree. Returns its operator."""
        operator = mock.Mock(tree=tree.name, spec=["tree", "report", "_timer"])
        kind = self.bake.CURLEW_OT_bake
        operator._stop, operator._end = (functools.partial(getattr(kind, name), operator) for name in ("_stop", "_end"))
        self.bake.running[tree.name] = self.bake.Run(tree, self.scene)
        return operator

    def tick(self, operator, kind="TIMER"):
        context = mock.Mock(scene=bpy.context.scene, workspace=None, screen=None)
        return self.bake.CURLEW_OT_bake.modal(operator, context, mock.Mock(type=kind))

    def finish(self, operator):
        """Returns the result, and what was reported."""
        began, result = time.monotonic(), {"PASS_THROUGH"}
        while result == {"PASS_THROUGH"}:
            self.assertLess(time.monotonic() - began, 60)
            result = self.tick(operator)
            time.sleep(0.002)
        self.assertEqual(self.bake.running, {})
        return result, operator.report.call_args

    def sampled(self):
        """Builds a tree that samples an object in each of many frames."""
        self.scene.frame_end = 500
        build = rising()
        obj = support.monkey(closed=False)
        build.add("CurlewMeshResult", build.add("CurlewMeshObject", object=obj, motion="ON"))
        self.addCleanup(setattr, self.bake, "_STEP", self.bake._STEP)
        self.bake._STEP = 0
        operator = self.press(build.tree)
        self.tick(operator)
        self.assertIsNone(self.bake.running["rising"].job)
        return build, obj, operator

    def test_an_object_is_deleted_while_it_is_sampled(self):
        build, obj, operator = self.sampled()
        bpy.data.objects.remove(obj)
        result, report = self.finish(operator)
        self.assertEqual((result, report[0][0]), ({"CANCELLED"}, {"ERROR"}))
        self.assertIn("removed during the bake", report[0][1])
        self.assertIn("removed during the bake", build.tree.message)

    def test_the_scene_is_deleted_while_it_is_sampled(self):
        _, _, operator = self.sampled()
        bpy.context.window.scene = bpy.data.scenes.new("other")
        bpy.data.scenes.remove(self.scene)
        self.assertEqual(self.finish(operator)[0], {"CANCELLED"})

    def test_an_error_of_any_kind_ends_the_bake(self):
        _, _, operator = self.sampled()
        with mock.patch.object(self.bake.Run, "advance", side_effect=ValueError("unheard of")):
            result, report = self.finish(operator)
        self.assertEqual((result, report[0][1]), ({"CANCELLED"}, "unheard of"))

    def test_the_tree_is_renamed(self):
        build = rising()
        operator = self.press(build.tree)
        self.tick(operator)
        build.tree.name = "falling"
        rising()  # takes the former name
        self.assertEqual(self.finish(operator)[0], {"FINISHED"})
        self.assertIsNotNone(build.result.target)

    def test_the_tree_is_removed(self):
        build = rising()
        operator = self.press(build.tree)
        bpy.data.node_groups.remove(build.tree)
        result, report = self.finish(operator)
        self.assertEqual((result, report[0]), ({"CANCELLED"}, ({"WARNING"}, "the tree was removed during its bake")))

    def test_another_scene_is_shown(self):
        build = rising()
        empty = bpy.data.objects.new("empty", None)
        build.add("CurlewParticlesResult", build.add("scatter", build.add("sphere", place=empty), count=5))
        self.scene.collection.objects.link(empty)
        self.scene.frame_end = 50
        for frame, z in ((1, 0), (50, 49)):
            empty.location.z = z
            empty.keyframe_insert("location", frame=frame)
        operator = self.press(build.tree)
        self.addCleanup(setattr, self.bake, "_STEP", self.bake._STEP)
        self.bake._STEP = 0
        self.tick(operator)
        other = bpy.data.scenes.new("other")
        self.scene.name = "renamed"
        bpy.context.window.scene = other
        run = self.bake.running["rising"]
        self.assertEqual(self.finish(operator)[0], {"FINISHED"})
        self.assertEqual(list(build.result.target.users_scene), [self.scene])
        self.assertEqual(len(other.objects), 0)
        (sphere,) = [node for node in run.job.plan.graph["nodes"] if node["action"] == "sphere"]
        self.assertIn("49", sphere["options"]["translate"])


class Outdated(Case):
    """Results that are older than the settings of their nodes."""

    def marks(self, build):
        outdated = support.addon("outdated")
        outdated.refresh(build.tree)
        return (build.result.outdated, build.volume.outdated)

    def test_the_mark_follows_the_settings(self):
        build = rising()
        self.assertEqual(self.marks(build), (False, False))  # never baked
        self.bake.bake(build.tree)
        self.assertEqual(self.marks(build), (False, False))
        scatter = build.tree.nodes["Scatter"]
        scatter.set_option("count", "30")
        self.assertEqual(self.marks(build), (True, False))
        self.assertEqual(build.result.draw_label(), "Outdated: Particles Result")
        scatter.set_option("count", "20")
        self.assertEqual(self.marks(build), (False, False))
        self.scene.frame_end = 5
        self.assertEqual(self.marks(build), (True, True))
        self.bake.bake(build.tree)
        self.assertEqual(self.marks(build), (False, False))
        build.tree.links.remove(build.result.inputs[0].links[0])
        build.tree.links.new(scatter.outputs[0], build.result.inputs[0])
        self.assertEqual(self.marks(build), (True, False))
        bpy.ops.curlew.free_bake(tree="rising")
        self.assertEqual(self.marks(build), (False, False))

    def test_the_mark_is_kept_by_the_file(self):
        build = rising()
        self.bake.bake(build.tree)
        path = str(folder("outdated") / "a.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
        build.tree = bpy.data.node_groups["rising"]
        build.result, build.volume = (build.tree.nodes[name] for name in ("Particles Result", "Volume Result"))
        self.assertEqual(self.marks(build), (False, False))
        build.tree.nodes["Uniform"].set_option("velocity", "0,0,1")
        self.assertEqual(self.marks(build), (True, True))

    def test_animation_is_not_a_change(self):
        """Another frame leaves no mark; a keyframe that moves does, of an option and of a value."""
        build = rising()
        value = build.add("CurlewValue", value=20)
        count = build.tree.nodes["Scatter"].add_value("o_count")
        build.tree.links.new(value.outputs[0], count)
        uniform = build.tree.nodes["Uniform"]
        for frame in (1, 4):
            uniform.o_velocity = (0, 0, frame)
            uniform.keyframe_insert("o_velocity", frame=frame)
            value.value = 20
            value.keyframe_insert("value", frame=frame)
        self.bake.bake(build.tree)
        for frame in (2, 4, 1):
            self.scene.frame_set(frame)
            self.assertEqual(self.marks(build), (False, False))
        curves = build.tree.animation_data.action.fcurves
        curve = next(curve for curve in curves if curve.data_path.endswith("value"))
        curve.keyframe_points[1].co.y = 25
        self.assertEqual(self.marks(build), (True, False))
        curve.keyframe_points[1].co.y = 20
        next(c for c in curves if "velocity" in c.data_path and c.array_index == 2).keyframe_points[1].co.y = 9
        self.assertEqual(self.marks(build), (True, True))


class Links(Case):
    def test_a_link_turns_on_the_output(self):
        build = Tree()
        flow = build.add("dfvn", build.add("noise"), build.add("noise", seed=1))
        grid = build.add("velocity", flow, dim=16, name="velocity")
        result = build.add("CurlewVolumeResult", (grid, "Velocity"), (grid, "Density"))
        self.bake.bake(build.tree)
        volume = result.target.data
        volume.grids.load()
        self.assertEqual({(g.name, g.data_type) for g in volume.grids}, {("velocity", "VECTOR_FLOAT"), ("density", "FLOAT")})
        self.assertEqual(grid.given().get("density"), None)  # the tree itself is not changed by a bake
        grid.turn_on([socket.name for socket in grid.outputs].index("Density"))  # as a link in the editor does
        self.assertEqual(grid.given()["density"], "1")

    def test_a_group_has_the_sockets_of_its_tree(self):
        inner = Tree("inner")
        support.interface_socket(inner.tree, "INPUT", "CurlewFieldSocket", "Field")
        support.interface_socket(inner.tree, "OUTPUT", "CurlewFieldSocket", "Clipped")
        build = Tree("outer")
        group = build.add("CurlewGroup", node_tree=inner.tree)
        support.addon("nodes").renew_groups()
        self.assertEqual(([s.name for s in group.inputs], [s.name for s in group.outputs]), (["Field"], ["Clipped"]))
        build.tree.links.new(build.add("noise").outputs[0], group.inputs[0])
        support.interface_socket(inner.tree, "INPUT", "CurlewShapeSocket", "Wall")
        support.addon("nodes").renew_groups()
        self.assertEqual([s.name for s in group.inputs], ["Field", "Wall"])
        self.assertTrue(group.inputs[0].is_linked)

    def test_selected_nodes_become_a_group(self):
        build = Tree()
        f = build.add("noise", frequency=1.5)
        flow = build.add("dfvn", f, build.add("noise", seed=1), speed=2)
        points = build.add("scatter", flow, count=10)
        build.add("CurlewParticlesResult", build.add("advect", flow, points, steps=3))
        before = self.bake.bake(build.tree)
        group = support.addon("groups").group_of(build.tree, [f, flow])
        self.assertEqual(([s.name for s in group.inputs], len(group.outputs)), (["g"], 1))
        self.assertEqual({n.name: n.given() for n in group.node_tree.nodes if hasattr(n, "given")},
                         {"Noise": {"frequency": "1.5"}, "Flow (∇f × ∇g)": {"speed": "2"}})
        after = self.bake.bake(build.tree)
        for file in before.folder.glob("*.npz"):
            self.assertEqual(file.read_bytes(), (after.folder / file.name).read_bytes())

    def test_groups_and_arrows_become_a_group(self):
        """A group with inputs keeps their values, and an Arrow without a link its object."""
        inner = Tree("inner")
        for kind, name in (("NodeSocketFloat", "Size"), ("NodeSocketObject", "Where"), ("CurlewFieldSocket", "f")):
            support.interface_socket(inner.tree, "INPUT", kind, name)
        build = Tree("outer")
        group = build.add("CurlewGroup", node_tree=inner.tree)
        group.renew_sockets()
        empty = bpy.data.objects.new("empty", None)
        group.inputs["Size"].default_value, group.inputs["Where"].default_value = 7, empty
        build.tree.links.new(build.add("noise").outputs[0], group.inputs["f"])
        arrow = build.add("CurlewArrow")
        arrow.inputs[0].default_value = empty
        uniform = build.add("uniform")
        build.tree.links.new(arrow.outputs[0], uniform.add_value("o_velocity"))
        before = len(bpy.data.node_groups)
        made = support.addon("groups").group_of(build.tree, [group, arrow])
        self.assertEqual(len(bpy.data.node_groups), before + 1)
        copy = made.node_tree.nodes["Group"]
        self.assertEqual((copy.inputs["Size"].default_value, copy.inputs["Where"].default_value), (7, empty))
        self.assertEqual(copy.inputs["f"].links[0].from_node.bl_idname, "NodeGroupInput")
        self.assertEqual(made.node_tree.nodes["Arrow"].inputs[0].default_value, empty)
        self.assertEqual(uniform.value_sockets()["o_velocity"].links[0].from_node, made)

    def test_labels(self):
        noise = Tree().add("noise")
        names = {name: noise.bl_rna.properties["o_" + name].name for name in ("translate", "gain", "frequency", "octaves")}
        self.assertEqual(names, {"translate": "Location", "gain": "Roughness", "frequency": "Frequency", "octaves": "Octaves"})
        bound = Tree().add("bound")
        about = bound.bl_rna.properties["o_layer"]
        self.assertEqual((about.name, about.unit), ("Wall Thickness", "LENGTH"))
        self.assertIn("layer= in scenes", about.description)
        labels = {}
        for action in support.addon("library").actions().values():
            for option in action.options:
                self.assertEqual(labels.setdefault(option.label, option.name), option.name)  # one meaning for each label
            self.assertEqual(len({option.label for option in action.options}), len(action.options), action.name)

    def test_german(self):
        view = bpy.context.preferences.view
        view.language, view.use_translate_interface = "de_DE", True
        try:
            texts = bpy.app.translations
            self.assertEqual(texts.pgettext_iface("Make It Flow", "Operator"), "Fließen lassen")
            self.assertEqual(texts.pgettext_iface("Wall Thickness"), "Dicke der Wand")
        finally:
            view.language = "en_US"

    def test_an_error_does_not_repeat_the_name_of_its_node(self):
        build = Tree()
        bad = build.add("noise", frequency="{1/0}")
        build.add("CurlewParticlesResult", build.add("scatter", build.add("dfvn", bad, build.add("noise")), count=10))
        with self.assertRaises(RuntimeError):
            bpy.ops.curlew.bake(tree=build.tree.name)
        self.assertFalse(bad.error.startswith(("-", "tree")), bad.error)


class Sources(Case):
    def faces(self, *objects):
        """Returns the mesh that the library gets for objects, as the bounds of a level set's mesh and its object."""
        build = Tree()
        meshes = [build.add("mesh2ls", build.add("CurlewMeshObject", object=obj), dim=32) for obj in objects]
        level = meshes[0] if len(meshes) == 1 else build.add("union", *meshes)
        result = build.add("CurlewMeshResult", build.add("ls2mesh", level))
        self.bake.bake(build.tree)
        places = np.array([v.co for v in result.target.data.vertices])
        return places.min(axis=0), places.max(axis=0)

    def instances(self):
        """Returns an object whose modifier puts a cube at x = 2 beside a cube, without realizing it."""
        bpy.ops.mesh.primitive_cube_add(size=1, location=(0, 0, 0))
        obj = bpy.context.active_object
        group = bpy.data.node_groups.new("instances", "GeometryNodeTree")
        support.interface_socket(group, "INPUT", "NodeSocketGeometry", "Geometry")
        support.interface_socket(group, "OUTPUT", "NodeSocketGeometry", "Geometry")
        start, end, join, move, make = (group.nodes.new(kind) for kind in (
            "NodeGroupInput", "NodeGroupOutput", "GeometryNodeJoinGeometry", "GeometryNodeTransform", "GeometryNodeGeometryToInstance"))
        move.inputs["Translation"].default_value = (2, 0, 0)
        for source, target in ((start.outputs[0], make.inputs[0]), (make.outputs[0], move.inputs[0]), (move.outputs[0], join.inputs[0]),
                               (start.outputs[0], join.inputs[0]), (join.outputs[0], end.inputs[0])):
            group.links.new(source, target)
        obj.modifiers.new("instances", "NODES").node_group = group
        return obj

    def test_instances_that_are_not_realized(self):
        lower, upper = self.faces(self.instances())
        self.assertTrue(np.allclose(lower, -0.5, atol=0.06) and np.allclose(upper, (2.5, 0.5, 0.5), atol=0.06), (lower, upper))

    def test_a_collection_as_an_obstacle(self):
        inside = bpy.data.collections.new("inside")
        for x in (-1, 1):
            bpy.ops.mesh.primitive_cube_add(size=1, location=(x, 0, 0))
            obj = bpy.context.active_object
            self.scene.collection.objects.unlink(obj)
            inside.objects.link(obj)
        empty = bpy.data.objects.new("all", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", inside
        empty.location.z = 3
        self.scene.collection.objects.link(empty)
        lower, upper = self.faces(empty)
        self.assertTrue(np.allclose(lower, (-1.5, -0.5, 2.5), atol=0.1) and np.allclose(upper, (1.5, 0.5, 3.5), atol=0.1), (lower, upper))

    def test_two_meshes_are_walls(self):
        monkeys = [support.monkey(location=(x, 0, 0)) for x in (-2, 2)]
        build = Tree()
        levels = [build.add("mesh2ls", build.add("CurlewMeshObject", object=obj), dim=48) for obj in monkeys]
        bound = build.add("bound", build.add("noise", seed=1), *levels, side="outside", layer=0.2)
        flow = build.add("dfvn", build.add("noise"), bound, speed=1)
        points = build.add("advect", flow, build.add("scatter", flow, count=2000, box="-4,-2,-2,4,2,2"), duration=1)
        build.add("CurlewParticlesResult", points)
        job = self.bake.bake(build.tree)
        self.assertEqual(job.report["advect"]["outside"], 0)

    def test_the_preview_of_a_mesh_with_many_faces(self):
        bpy.ops.mesh.primitive_cube_add()
        ball = bpy.context.active_object
        ball.modifiers.new("fine", "SUBSURF").levels = 8
        cast = ball.modifiers.new("round", "CAST")
        cast.factor, cast.use_radius_as_size, cast.size = 1, False, 1
        build = Tree()
        build.around(ball)
        build.tree.preview = "POINTS"
        preview = support.addon("preview")
        obj = preview.show(build.tree, self.scene)
        print(f"preview of 390,000 faces: {preview.last_seconds:.2f} s")
        distances = np.linalg.norm([v.co for v in obj.data.vertices], axis=1)
        self.assertGreater(distances.min(), 0.93)  # of particles around a sphere of radius 1

    def test_a_volume_that_a_modifier_makes(self):
        data = bpy.data.volumes.new("fog")
        fog = bpy.data.objects.new("fog", data)
        self.scene.collection.objects.link(fog)
        fog.modifiers.new("fog", "MESH_TO_VOLUME").object = support.monkey()
        build = Tree()
        flow = build.add("uniform", velocity="1,0,0", box="-9,-9,-9,9,9,9")
        volume = build.add("CurlewVolumeObject", object=fog)
        result = build.add("CurlewVolumeResult", build.add("advectGrid", flow, volume, duration=0.5))
        self.bake.bake(build.tree)
        result.target.data.grids.load()
        self.assertEqual([g.name for g in result.target.data.grids], ["density"])
        fog.modifiers.clear()
        with self.assertRaisesRegex(RuntimeError, "'fog' has no grids"):
            bpy.ops.curlew.bake(tree=build.tree.name)


support.main(Sources, Saving, Undo, Missing, Frames, Animation, Pressed, Outdated, Links)
