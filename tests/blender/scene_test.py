# SPDX-License-Identifier: Apache-2.0
"""A tree and its scene are the same program: both write the same files, byte for byte."""

import hashlib
import json
import re
import shlex
import shutil
import sys
import unittest
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import support  # noqa: E402
from support import Tree  # noqa: E402


def folder(name):
    """Creates an empty folder."""
    path = support.WORK / name
    shutil.rmtree(path, ignore_errors=True)
    path.mkdir()
    return path


def content(file):
    """Returns the bytes of a file; of a page, without the command that made it."""
    return re.sub(rb"<pre>.*?</pre>", b"", file.read_bytes(), flags=re.S) if file.suffix == ".html" else file.read_bytes()


def written(path, *left_out):
    """Returns the digests of the files in a folder, by name."""
    return {f.name: hashlib.sha256(content(f)).hexdigest() for f in sorted(path.iterdir())
            if f.is_file() and f.suffix != ".json" and f.name not in left_out}


def meaning(document):
    """Returns what a graph computes, without the names of its nodes and with the default of fps=."""
    nodes = {node["name"]: node for node in document["nodes"]}
    used = {link.partition(".")[0] for node in nodes.values() for links in node.get("inputs", {}).values() for link in links}

    def of(link):
        name, _, part = link.partition(".")
        if name not in nodes:
            return link  # a state of the previous frame
        node = nodes[name]
        inputs = {key: [of(each) for each in links] for key, links in node.get("inputs", {}).items()}
        return part, node["action"], node.get("words", []), node.get("options", {}), inputs

    frames = {"options": {"fps": "24"}, **document["frames"]} if "frames" in document else None
    return frames, [of(name) for name in nodes if name not in used]


LIMITS = {"count": 300, "rate": 500, "dim": 16, "width": 48, "duration": 0.1}
GIVEN = {"advect": "duration", "scatter": "count", "mesh2ls": "dim", "union": "dim", "velocity": "dim", **dict.fromkeys(("lic", "shade", "slice", "splat", "warp"), "width")}


def reduced(words, frames):
    """Returns the words of an action with fewer points, voxels, pixels, frames and seconds: the results of both programs are
    compared at any size. With frames, an action has the duration of a frame."""
    name, options = words[0], [word for word in words[1:] if not word.startswith("voxel=")]
    if name == "frames":
        options[0] = "1-2"
    given = GIVEN.get(name)
    if given and not (frames and given == "duration") and not any(word.startswith(given + "=") for word in options):
        options.append(f"{given}={LIMITS[given]}")

    def limited(option):
        return f"{option[1]}={min(float(option[2]), LIMITS[option[1]]):g}"

    return [name, *(re.sub(rf"^({'|'.join(LIMITS)})=([0-9][0-9.e+]*)$", limited, word) for word in options)]


class Export(unittest.TestCase):
    def setUp(self):
        support.empty()
        self.bake = support.addon("bake")
        self.io = support.addon("scene_io")

    def same(self, tree, files):
        """Exports the tree, runs the scene with the command, and bakes the tree. Returns the scene's folder and the job."""
        there = folder("exported")
        self.io.export(tree, there / "scene.txt", bpy.context.scene)
        done = support.run_command("scene.txt", there)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        job = self.bake.bake(tree)
        return there, job

    def test_what_results_show_is_what_the_command_writes(self):
        build = Tree("around")
        obj = support.monkey(location=(0.3, -0.2, 0.1))
        obj.rotation_euler, obj.scale = (0.3, 0.2, 0.1), (1.1, -0.9, 1.0)  # mirrored
        flow = build.around(obj)
        grid = build.add("velocity", flow, dim=32, name="velocity", density=1)
        build.add("CurlewVolumeResult", (grid, "Velocity"), (grid, "Density"))
        points = build.add("advect", flow, build.add("scatter", flow, count=500), steps=5)
        build.add("CurlewParticlesResult", points)
        here = folder("here")
        build.add("write", points, words=f"{here}/p.csv {here}/p.ply")
        build.add("write", build.add("slice", flow, width=64), words=f"{here}/slice.png")
        there, job = self.same(build.tree, here)
        volume = next(job.folder.glob("*.vdb"))
        self.assertEqual(volume.read_bytes(), (there / "scene_Volume_Result.vdb").read_bytes())
        baked = written(here)
        self.assertEqual(set(baked), {"p.csv", "p.ply", "slice.png"})
        for file in here.iterdir():
            file.unlink()
        self.assertEqual(support.run_command("scene.txt", there).returncode, 0)
        self.assertEqual(written(here), baked)
        self.assertEqual((there / "scene_particles.ply").read_bytes(), (here / "p.ply").read_bytes())

    def test_a_drawn_curve(self):
        bpy.ops.curve.primitive_nurbs_circle_add(location=(1, 0, 0))
        build = Tree("circle")
        flow = build.add("rail", build.add("CurlewCurveObject", object=bpy.context.active_object), radius=0.2)
        here = folder("here")
        build.add("write", build.add("scatter", flow, count=50), words=f"{here}/p.csv")
        there, _ = self.same(build.tree, here)
        baked = written(here)
        self.assertEqual(set(baked), {"p.csv"})
        self.assertEqual(support.run_command("scene.txt", there).returncode, 0)
        self.assertEqual(written(here), baked)

    def test_a_sequence(self):
        scene = bpy.context.scene
        scene.frame_start, scene.frame_end = 1, 3
        bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8)
        ball = bpy.context.active_object
        ball.keyframe_insert("location", frame=1)
        ball.location.x = 0.5
        ball.keyframe_insert("location", frame=3)
        build = Tree("moving")
        level = build.add("mesh2ls", build.add("CurlewMeshObject", object=ball, motion="ON"), dim=24)
        f, g = build.add("noise", alpha="{T}"), build.add("noise", seed=1)
        flow = build.add("dfvn", f, build.add("bound", g, level, side="outside", layer=0.3), speed=1)
        points = build.add("advect", flow, build.add("scatter", flow, count=300))
        build.add("CurlewParticlesResult", points)
        here = folder("here")
        build.add("write", points, words=f"{here}/p.$F4.csv")
        build.tree.sequence = True
        there, _ = self.same(build.tree, here)
        baked = written(here)
        self.assertEqual(len(baked), 3)
        self.assertEqual(support.run_command("scene.txt", there).returncode, 0)
        self.assertEqual(written(here), baked)
        self.assertEqual(len(list(there.glob("scene_particles.*.ply"))), 3)


class Import(unittest.TestCase):
    def setUp(self):
        support.empty()
        self.io = support.addon("scene_io")
        self.trees = support.addon("tree")

    def again(self, text, name="scene"):
        """Imports the scene as a tree. Returns the tree and its scene."""
        tree = self.io.tree_of(text, name)
        collected = self.trees.collect(tree)
        graph = collected.document(bpy.context.scene, self.trees.frames_of(tree, bpy.context.scene, collected))
        return tree, support.addon("library").curlew().translate(graph, "scene")

    def agree(self, text, name):
        """Imports the scene, and runs it. If the tree's scene has another graph, that must write the same files."""
        one, other = folder("one"), folder("other")
        tree, program = self.again(text, name)
        translate = support.addon("library").curlew().translate
        graphs = [meaning(json.loads(translate(each, "json"))) for each in (text, program)]
        for path, scene in ((one, text), (other, program)):
            (path / "scenes").mkdir()
            for mesh in {"spot.obj", "scenes/spot.obj", *re.findall(r"\b\w+\.obj", text)}:
                shutil.copy(support.SOURCE / "scenes" / "spot.obj", path / mesh)
            for mesh in ("walker.glb", "scenes/walker.glb"):
                shutil.copy(support.SOURCE / "scenes" / "walker.glb", path / mesh)
            (path / "scene.txt").write_text(scene)
        first = support.run_command("scene.txt", one)
        self.assertEqual((first.returncode, first.stderr), (0, ""), name)
        if graphs[0] != graphs[1]:
            second = support.run_command("scene.txt", other)
            self.assertEqual((second.returncode, second.stderr), (0, ""), program)
            self.assertEqual(written(one, "scene.txt"), written(other, "scene.txt"), program)
        return tree, program

    def test_examples_of_the_registry(self):
        tried = 0
        for action in support.addon("library").curlew().registry()["actions"]:
            for example in action["examples"]:
                lines = []
                for token in shlex.split(example)[1:]:
                    if token.startswith("-") and not token[1:2].isdigit():
                        lines.append([token[1:]])
                    else:
                        lines[-1].append(token)
                names = {line[0] for line in lines}
                text = "".join(shlex.join(reduced(line, "frames" in names)) + "\n" for line in lines)
                reads_what_is_not_here = any(word.endswith((".vdb", ".png", ".exr", ".gz", "in.csv", "points.csv")) for line in lines
                                             if line[0] in ("read", "probe") for word in line[1:])
                made = any(word for line in lines if line[0] == "write" for word in line[1:])
                if names & {"config", "resume", "help", "list"} or reads_what_is_not_here or not made:
                    continue
                self.agree(text, action["name"])
                tried += 1
        self.assertGreater(tried, 35)

    def test_what_is_shared_kept_and_chosen_by_age(self):
        self.agree(
            "sphere radius=0.6\nnoise frequency=2\nnoise seed=1\nbound keep=1\ndfvn f=noise speed=1\n"
            "sphere radius=0.3\nnoise seed=3\nnoise seed=4\nbound side=outside\ndfvn\n"
            "scatter count=50 seed=1\nscatter count=60 seed=2\nwrite geo=1 old.csv\nadvect steps=2\nwrite new.csv\n"
            "velocity dim=16 density=1 potentials=1\nwrite grid=0,1,3 three.vdb\ntrace geo=1 maxLength=1\nwrite c.obj c.csv\n",
            "ages")

    def test_fields_of_other_dimensions(self):
        self.agree("noise dimensions=2 frequency=3 amplitude=0.4\nnoise type=simplex\nlift\nslice width=40\nwrite a.png\n"
                   "noise type=simplex dimensions=4\nnoise type=simplex dimensions=4 seed=1\nnoise type=simplex dimensions=4 seed=2\n"
                   "noise dimensions=2 seed=8\ndfvn\nslice width=40\nwrite b.png\nnoise dimensions=2\nheight\nslice axis=y width=40\n"
                   "write c.png\nnoise\ncurl shift=100\nslice width=40\nwrite d.png\n", "dimensions")

    def test_pictures_that_are_drawn_into_and_joined(self):
        text = ("noise\nnoise seed=1\ndfvn speed=1\nscatter count=50 seed=1\nscatter count=50 seed=2\n"
                "advect duration=0.2 steps=4 pathlines=1\nsplat width=60\nwrite x.png\ntorus\nshade width=60\n"
                "splat over=1 geo=2\nwrite y.png\nslice width=40\npanels count=2\nwrite z.png\ndistance geo=1,2\n"
                "expect distance/mean min=0\n")
        _, program = self.agree(text, "pictures")
        self.assertIn("image=Shade\n", program)
        self.assertIn("panels images=Shade,Slice", program)

    def test_every_scene_is_a_tree(self):
        for path in sorted((support.SOURCE / "scenes").glob("*.txt")):
            text = path.read_text()
            tree, program = self.again(text, path.stem)
            for action in ("write", "expect", "frames"):
                given = [line for line in text.splitlines() if line.startswith(action + " ")]
                made = [line for line in program.splitlines() if line.startswith(action + " ")]
                self.assertGreaterEqual(len(made), len(given), path.name)
            self.assertEqual(bool(tree.nodes), bool(program))

    def test_frames(self):
        _, program = self.agree(
            "noise seed=5\nnoise seed=6\ndfvn\nscatter count=40\nadvect duration=0.1 steps=2\nframes 3-5 fps=12 substeps=2\n"
            "noise alpha={T}\nnoise seed=1\ndfvn speed=1\nadvect\nscatter count=5 seed=9\nwrite 'new.$F4.csv'\n"
            "sphere radius=0.3\nkill side=inside\nwrite 'b.$F2.csv'\n", "frames")
        self.assertIn("frames 3-5 fps=12 substeps=2\n", program)

    def test_a_tree_is_laid_out_from_left_to_right(self):
        text = (support.SOURCE / "scenes" / "demo.txt").read_text()
        tree = self.io.tree_of(text, "demo")
        self.assertGreater(len(tree.nodes), 10)
        for link in tree.links:
            self.assertGreater(link.to_node.location.x, link.from_node.location.x + 200)
        boxes = [(n.location.x, n.location.y, n.name) for n in tree.nodes]
        for x, y, name in boxes:
            for u, v, other in boxes:
                self.assertTrue(name == other or abs(x - u) >= 200 or abs(y - v) >= 80, (name, other))

    def test_what_a_tree_loses_nothing_of(self):
        text = "noise frequency=0.123456789012 seed=4503599627370497 'alpha={0.5}' type=psrd\nnoise\ndfvn\nslice\nwrite a.png\n"
        tree, program = self.again(text)
        self.assertIn("frequency=0.123456789012", program)
        self.assertIn("seed=4503599627370497", program)
        self.assertIn("type=psrd", program)
        again = self.again(program)[1]
        self.assertEqual(again, program)
        del tree

    def test_lines_that_are_wrong(self):
        for text, words in (("noise\nnois\n", "wrong:2: there is no action '-nois'"), ("noise freq=1 gai='2\n", "wrong:1"),
                            ("noise colour=3\n", "no option 'colour'"), ("noise \\\n", "line that should follow")):
            with self.assertRaises(support.addon("actions").TreeError) as raised:
                self.io.tree_of(text, "wrong")
            self.assertIn(words, str(raised.exception))
        self.assertFalse(bpy.data.node_groups)


class Walk(unittest.TestCase):
    """Reroutes, groups, muted nodes and frames do not change a graph."""

    def setUp(self):
        support.empty()
        self.trees = support.addon("tree")

    def said(self, tree):
        """Returns the actions, options and links of the graph, by the names of nodes."""
        return {key: (node["action"], node["options"], node["inputs"]) for key, node in self.trees.collect(tree).graph.items()}

    def test_reroutes_and_frames(self):
        build = Tree()
        plain = build.add("noise", frequency=2)
        flow = build.add("dfvn", plain, build.add("noise", seed=1))
        build.add("write", build.add("slice", flow), words="a.png")
        expected = self.said(build.tree)
        route = build.add("NodeReroute", plain)
        second = build.add("NodeReroute", route)
        build.tree.links.new(second.outputs[0], flow.inputs[0])
        plain.parent = build.add("NodeFrame")
        self.assertEqual(self.said(build.tree), expected)

    def test_muted_nodes_hand_on(self):
        build = Tree()
        noise = build.add("noise")
        clip = build.add("clip", noise, limit=0.3)
        flow = build.add("dfvn", clip, build.add("noise", seed=1))
        build.add("write", build.add("slice", flow), words="a.png")
        muted = build.add("write", build.add("slice", flow, axis="x"), words="b.png")
        self.assertEqual(self.said(build.tree)["Clip"], ("clip", {"limit": "0.3"}, {"field": ["Noise"]}))
        clip.mute = muted.mute = True
        self.assertEqual(self.said(build.tree), {
            "Noise": ("noise", {}, {}), "Noise.001": ("noise", {"seed": "1"}, {}),
            "Flow (∇f × ∇g)": ("dfvn", {}, {"f": ["Noise"], "g": ["Noise.001"]}),
            "Slice": ("slice", {}, {"what": ["Flow (∇f × ∇g)"]}), "Write": ("write", {}, {"what": ["Slice"]})})
        noise.mute = True
        with self.assertRaises(support.addon("actions").TreeError) as raised:
            self.said(build.tree)
        self.assertIn("muted", str(raised.exception))

    def test_groups_within_groups(self):
        inner = Tree("inner")
        support.interface_socket(inner.tree, "INPUT", "CurlewFieldSocket", "Field")
        support.interface_socket(inner.tree, "OUTPUT", "CurlewFieldSocket", "Field")
        start, end = inner.add("NodeGroupInput"), inner.add("NodeGroupOutput")
        inner.tree.links.new(inner.add("clip", start, limit=0.25).outputs[0], end.inputs[0])
        outer = Tree("outer")
        support.interface_socket(outer.tree, "INPUT", "CurlewFieldSocket", "Field")
        support.interface_socket(outer.tree, "OUTPUT", "CurlewFlowSocket", "Flow")
        start, end = outer.add("NodeGroupInput"), outer.add("NodeGroupOutput")
        group = outer.add("CurlewGroup", node_tree=inner.tree)
        support.addon("nodes").renew_groups()
        outer.tree.links.new(start.outputs[0], group.inputs[0])
        flow = outer.add("dfvn", group, outer.add("noise", seed=1))
        outer.tree.links.new(flow.outputs[0], end.inputs[0])
        build = Tree()
        group = build.add("CurlewGroup", node_tree=outer.tree)
        support.addon("nodes").renew_groups()
        build.tree.links.new(build.add("noise", seed=7).outputs[0], group.inputs[0])
        build.add("write", build.add("slice", group), words="a.png")
        said = self.said(build.tree)
        self.assertEqual(said["Slice"][2], {"what": ["Group/Flow (∇f × ∇g)"]})
        self.assertEqual(said["Group/Flow (∇f × ∇g)"][2], {"f": ["Group/Group/Clip"], "g": ["Group/Noise"]})
        self.assertEqual(said["Group/Group/Clip"], ("clip", {"limit": "0.25"}, {"field": ["Noise"]}))
        result = build.add("CurlewParticlesResult", build.add("scatter", group, count=5))
        flow.set_option("speed", "{1/0}")
        with self.assertRaises(RuntimeError):
            bpy.ops.curlew.bake(tree=build.tree.name)
        self.assertIn("speed", flow.error)
        self.assertIn("speed", group.error)
        self.assertEqual(result.error, "")

    def test_a_volume_as_a_source(self):
        build = Tree()
        sphere = build.add("sphere", radius=0.5)
        grid = build.add("velocity", build.add("dfvn", build.add("noise"), build.add("bound", build.add("noise", seed=1), sphere)),
                         dim=24, name="velocity", density=1)
        result = build.add("CurlewVolumeResult", (grid, "Velocity"), (grid, "Density"))
        support.addon("bake").bake(build.tree)
        again = Tree()
        volume = again.add("CurlewVolumeObject", object=result.target, grids="density")
        flow = again.add("dfvn", again.add("noise"), again.add("noise", seed=1), speed=1)
        moved = again.add("CurlewVolumeResult", again.add("advectGrid", flow, volume, duration=0.2))
        support.addon("bake").bake(again.tree)
        moved.target.data.grids.load()
        self.assertEqual([g.name for g in moved.target.data.grids], ["density"])


support.main(Export, Import, Walk)
