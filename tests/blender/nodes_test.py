# SPDX-License-Identifier: Apache-2.0
"""Every action is a node with the options of the registry. The add-on can be enabled and disabled."""

import gc
import importlib
import json
import math
import sys
import unittest
import zipfile
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import support  # noqa: E402


def resident():
    """Returns the resident memory in MiB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 2**20


class Nodes(unittest.TestCase):
    def setUp(self):
        support.empty()
        self.actions = support.addon("library").actions()
        self.classes = support.addon("nodes").node_classes()

    def test_every_action_is_a_node(self):
        left_out = set(self.actions) - set(self.classes)
        self.assertEqual(left_out, {"config", "help", "list", "set", "version"})
        self.assertGreater(len(self.classes), 50)

    def test_properties_are_what_the_registry_says(self):
        tree = bpy.data.node_groups.new("t", "CurlewTree")
        for name, action in self.actions.items():
            if name not in self.classes:
                continue
            node = tree.nodes.new("CurlewNode_" + name)
            self.assertEqual(node.given(), {}, name)
            for option in action.options:
                about = node.bl_rna.properties["o_" + option.name]
                self.assertTrue(about.description.startswith(option.help), (name, option.name))
                if option.type == "choice":
                    self.assertEqual([item.identifier for item in about.enum_items], list(option.choices))
                    self.assertEqual(getattr(node, "o_" + option.name), option.default)
                elif option.type in ("real", "integer") and option.default:
                    self.assertAlmostEqual(getattr(node, "o_" + option.name), float(option.default), delta=1e-6 * abs(
                        float(option.default)))
                if option.type in ("real", "integer"):
                    if math.isfinite(option.lower) and not option.exclusive:
                        self.assertAlmostEqual(about.hard_min, max(option.lower, -2**31 + 1), msg=(name, option.name))
                    if math.isfinite(option.upper) and option.upper < 1e9:
                        self.assertAlmostEqual(about.hard_max, option.upper, delta=1e-6 * abs(option.upper))

    def test_what_names_a_file_that_is_written_is_known(self):
        """Otherwise a foreign .blend could write there."""
        options = support.addon("writing").OPTIONS
        self.assertEqual({name for name, action in self.actions.items() if action.writes}, {"plot", "probe", "report", "write"})
        for name, action in self.actions.items():
            for option in action.options:
                if option.type == "text" and any(word in option.help for word in ("to write", "written", ".svg", ".json")):
                    self.assertEqual(options.get(name), option.name)

    def test_options_without_effect_are_known(self):
        jitter, shade = self.actions["jitter"], self.actions["shade"]
        layer, seed, sheet = jitter.option("layer"), jitter.option("seed"), shade.option("sheet")
        for given, effect in (({}, True), ({"method": "curl"}, True), ({"method": "random"}, False)):
            self.assertEqual(jitter.has_effect(layer, given), effect, given)
            self.assertTrue(jitter.has_effect(seed, given))
        write = self.actions["write"]
        for words, given, effect in (("a.ply", {}, False), ("a.ply b.VDB", {}, True), ("a.ply", {"format": "vdb"}, True), ("", {}, False)):
            self.assertEqual(write.has_effect(write.option("codec"), given, words), effect, words)
        self.assertFalse(shade.has_effect(sheet, {"sheet": "1"}))
        self.assertTrue(shade.has_effect(sheet, {"iso": "0.5"}))

    def test_every_option_at_its_limits(self):
        """The program accepts every value that a property can have."""
        tree = bpy.data.node_groups.new("t", "CurlewTree")
        curlew = support.addon("library").curlew()
        tried = 0
        for name, action in self.actions.items():
            if name not in self.classes or name in ("resume", "threads"):
                continue
            words = ["1-2"] if name == "frames" else [{"read": "a.ply", "formula": "x + y"}.get(name, "a.json")] * action.fewest_words
            for option in action.options:
                for end in ("lower", "upper"):
                    node = tree.nodes.new("CurlewNode_" + name)
                    prop = "o_" + option.name
                    about = node.bl_rna.properties[prop]
                    if option.type == "flag":
                        setattr(node, prop, end == "upper")
                    elif option.type == "choice":
                        setattr(node, prop, option.choices[0 if end == "lower" else -1])
                    elif option.type in ("real", "integer"):
                        setattr(node, prop, about.hard_min if end == "lower" else about.hard_max)
                    elif option.type in ("vector", "interval", "box"):
                        setattr(node, prop, [-1e6] * (about.array_length // 2) + [1e6] * (
                            about.array_length - about.array_length // 2))
                    else:
                        setattr(node, prop, "1/2" if option.name == "part" else {"coordinates": "1"}.get(option.type, "word"))
                    given = node.given()
                    self.assertEqual(list(given), [option.name], name)
                    what = {"words": words, "options": given}
                    graph = {"nodes": [{"action": "print"}], "frames": what} if name == "frames" else {
                        "nodes": [{"name": "it", "action": name, **what}]}
                    try:
                        curlew.translate(graph, "json")
                    except curlew.Error as error:
                        self.assertRegex(str(error), "nothing is connected|has no effect|is after the first frame", graph)
                    tree.nodes.remove(node)
                    tried += 1
        self.assertGreater(tried, 300)

    def test_text_holds_what_a_property_cannot(self):
        tree = bpy.data.node_groups.new("t", "CurlewTree")
        node = tree.nodes.new("CurlewNode_noise")
        for text in ("{2*pi*T}", "0.123456789012", "1e-300"):
            node.set_option("frequency", text)
            self.assertEqual(node.given(), {"frequency": text})
        node.set_option("seed", "9007199254740991")
        self.assertEqual(node.given()["seed"], "9007199254740991")
        node.set_option("frequency", "0.1")
        self.assertEqual(node.given()["frequency"], "0.1")
        node.reset_option("frequency")
        node.reset_option("seed")
        self.assertEqual(node.given(), {})
        node.set_option("freq", "1")  # the default value, given explicitly
        self.assertEqual(node.given(), {"frequency": "1"})

    def test_former_names_of_options_load(self):
        """A file of the last release stores options under their names of that time."""
        tree = bpy.data.node_groups.new("old", "CurlewTree")
        tree.use_fake_user = True

        def stored(action, **properties):
            node = tree.nodes.new("CurlewNode_" + action)
            for name, value in properties.items():
                node[name] = value
            return node

        bound = stored("bound")
        for frame, width in ((1, 0.25), (11, 0.5)):
            bound.o_layer = width
            bound.keyframe_insert("o_layer", frame=frame)
        curve = tree.animation_data.action.fcurves[0]
        curve.data_path = curve.data_path.replace("o_layer", "o_width")  # as that release wrote it
        del bound["o_layer"]
        bound["o_width"] = 0.25
        sphere = stored("sphere", o_offset=(1.0, 2.0, 3.0), o_dim=2)
        noise = stored("noise", o_grid=1, t_offset="{T},0,0")
        stored("splat", o_by=3, o_radius=0.5, o_box=(-1.0, -1.0, -1.0, 1.0, 1.0, 2.0))
        both = stored("advect", o_time=1.0)
        both.o_duration = 2.0
        path = str(support.WORK / "former.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        self.assertEqual((sphere.given(), noise.given()), ({}, {}))
        bpy.ops.wm.open_mainfile(filepath=path)
        tree = bpy.data.node_groups["old"]
        given = {node.name: node.given() for node in tree.nodes}
        self.assertEqual(given, {
            "Bound": {"layer": "0.25"},
            "Sphere": {"dimensions": "2", "translate": "1,2,3"},
            "Noise": {"lattice": "perlin", "translate": "{T},0,0"},
            "Splat": {"show": "id", "pointRadius": "0.5", "viewBox": "-1,-1,-1,1,1,2"},
            "Advect": {"duration": "2"},
        })
        self.assertEqual([c.data_path for c in tree.animation_data.action.fcurves], ['nodes["Bound"].o_layer'])
        support.addon("keyframes").follow(tree, 11)
        self.assertEqual(tree.nodes["Bound"].given(), {"layer": "0.5"})
        tree.nodes["Bound"].set_option("width", "0.75")  # in scripts too
        self.assertEqual(tree.nodes["Bound"].given(), {"layer": "0.75"})

    def test_a_default_is_not_given_and_a_copy_keeps_what_is(self):
        tree = bpy.data.node_groups.new("t", "CurlewTree")
        node = tree.nodes.new("CurlewNode_advect")
        node.o_steps = 7
        copy = tree.copy()
        self.assertEqual(copy.nodes[0].given(), {"steps": "7"})


class Cycles(unittest.TestCase):
    def test_five_times_on_and_off(self):
        support.empty()
        used = []
        for _ in range(5):
            bpy.ops.preferences.addon_disable(module=support.NAME)
            self.assertFalse(hasattr(bpy.types, "CurlewTree"))
            self.assertFalse(hasattr(bpy.types.Scene, "curlew_tree"))
            self.assertFalse([h for h in bpy.app.handlers.frame_change_post if h.__module__.startswith(support.NAME)])
            bpy.ops.preferences.addon_enable(module=support.NAME)
            tree = bpy.data.node_groups.new("t", "CurlewTree")
            self.assertEqual(len(tree.nodes.new("CurlewNode_noise").outputs), 1)
            bpy.data.node_groups.remove(tree)
            gc.collect()
            used.append(resident())
        print("MiB after each cycle:", json.dumps([round(u, 1) for u in used]))
        self.assertLess(used[-1] - used[1], 4.0)  # growth over three cycles; the classes of one cycle take about 10 MiB


class Extension(unittest.TestCase):
    def test_the_other_package_under_another_name(self):
        """An extension is a submodule of another module, so its code must not depend on its own module name. Blender
        installs its wheel."""
        support.empty()
        bpy.ops.preferences.addon_disable(module=support.NAME)
        packed = next(support.PACKAGES.glob("*-linux-x64.zip"))
        place = support.WORK / "extension" / "bl_ext_of_test" / "inner"
        with zipfile.ZipFile(packed) as archive:
            archive.extractall(place)
        (place.parent / "__init__.py").write_text("")
        wheels = support.WORK / "extension" / "wheels"
        with zipfile.ZipFile(next(place.glob("wheels/*.whl"))) as archive:
            archive.extractall(wheels)
        sys.path[:0] = [str(place.parents[1]), str(wheels)]  # as Blender 4.2 does
        before = list(sys.path)
        module = importlib.import_module("bl_ext_of_test.inner")
        module.register()
        library = sys.modules["bl_ext_of_test.inner.library"].curlew()
        self.assertEqual(library.__name__, "curlew")
        self.assertEqual(library.find_library(), str(wheels / "curlew/libcurlew.so"))
        self.assertEqual(sys.path, before)
        tree = bpy.data.node_groups.new("t", "CurlewTree")
        tree.nodes.new("CurlewNode_noise")
        bpy.data.node_groups.remove(tree)
        module.unregister()
        bpy.ops.preferences.addon_enable(module=support.NAME)


support.main(Nodes, Cycles, Extension)
