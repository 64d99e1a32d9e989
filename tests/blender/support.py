# SPDX-License-Identifier: Apache-2.0
"""Shared code of the tests in Blender."""

import faulthandler
import os
import re
import shutil
import subprocess
import sys
import traceback
import unittest
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np

faulthandler.enable()
WORK = Path(os.environ["CURLEW_WORK"])
SOURCE = Path(os.environ["CURLEW_SOURCE"])
PACKAGES = Path(os.environ["CURLEW_PACKAGES"])
COMMAND = os.environ["CURLEW_COMMAND"]
NAME = "curlew_blender"


def install():
    """Installs the packed add-on as a user would, and enables it."""
    packed = next(PACKAGES.glob("*-legacy.zip"))
    bpy.ops.preferences.addon_install(filepath=str(packed), overwrite=True)
    bpy.ops.preferences.addon_enable(module=NAME)


def addon(module):
    """Returns a module of the installed add-on."""
    __import__(f"{NAME}.{module}")
    return sys.modules[f"{NAME}.{module}"]


def empty():
    """Opens an empty file, with the add-on enabled, and removes bakes of files that were not saved."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    if NAME not in bpy.context.preferences.addons:
        bpy.ops.preferences.addon_enable(module=NAME)
    shutil.rmtree(addon("cache").temporary(), ignore_errors=True)


def reduce_presets(count=1500, dim=24):
    """Gives presets fewer points, and voxels along the mesh, and a shorter run-up: their work grows with them."""
    limits, presets = {"count": count, "dim": dim}, addon("presets").PRESETS
    for name, preset in presets.items():
        few = re.sub(r"(count|dim)=(\d+)", lambda found: f"{found[1]}={min(int(found[2]), limits[found[1]])}", preset.text)
        presets[name] = replace(preset, text=few, seconds=min(preset.seconds, 0.1))


def monkey(location=(0, 0, 0), closed=True):
    """Adds Blender's monkey. If `closed`, a voxel remesh closes the holes of its eyes."""
    bpy.ops.mesh.primitive_monkey_add(location=location)
    obj = bpy.context.active_object
    if closed:
        remesh = obj.modifiers.new("closed", "REMESH")
        remesh.mode = "VOXEL"
        remesh.voxel_size = 0.06
    return obj


class Tree:
    """Builds a tree with short code."""

    def __init__(self, name="Test"):
        self.tree = bpy.data.node_groups.new(name, "CurlewTree")

    def add(self, action, *inputs, words="", **options):
        """Adds a node of an action (or of a bl_idname). Links its inputs in order to nodes or to (node, output)."""
        kind = action if action.startswith(("Curlew", "Node")) else "CurlewNode_" + action
        node = self.tree.nodes.new(kind)
        for k, source in enumerate(inputs):
            if source is not None:
                source, output = source if isinstance(source, tuple) else (source, 0)
                output = source.outputs[output]
                self.tree.links.new(output, node.inputs[k])
        if words:
            node.words = words
        for name, value in options.items():
            if hasattr(node, "o_" + name):
                node.set_option(name, str(value))
            else:
                setattr(node, name, value)
        return node

    def around(self, obj, side="outside", width=0.2):
        """Adds a flow around (or in) a mesh object."""
        mesh = self.add("CurlewMeshObject", object=obj)
        level = self.add("mesh2ls", mesh, dim=24)
        f = self.add("noise", frequency=1.5, seed=1)
        g = self.add("noise", frequency=1.5, seed=2)
        bound = self.add("bound", g, level, layer=width, side=side)
        return self.add("dfvn", f, bound, speed=1)


def interface_socket(tree, direction, kind, name):
    """Adds a socket to the interface of a tree, in any version of Blender."""
    if hasattr(tree, "interface"):
        return tree.interface.new_socket(name, in_out=direction, socket_type=kind)
    return (tree.inputs if direction == "INPUT" else tree.outputs).new(kind, name)


def blocked_cache(name):
    """Saves the .blend in a folder where no cache can be created. Returns the file that blocks it."""
    folder = WORK / name
    folder.mkdir(exist_ok=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "file.blend"))
    (folder / "curlew_cache").write_text("a file where the folder should be")
    return folder / "curlew_cache"


def run_command(scene, folder):
    """Runs the command line program on a scene in a folder."""
    return subprocess.run([COMMAND, "-quiet", "-config", scene], cwd=folder, capture_output=True, text=True, check=False)


def image(path):
    """Returns the pixels of a picture, with rows from the bottom."""
    picture = bpy.data.images.load(str(path))
    pixels = np.empty(len(picture.pixels), np.float32)
    picture.pixels.foreach_get(pixels)
    return pixels.reshape(picture.size[1], picture.size[0], -1)


def main(*cases):
    """Runs test cases. Blender exits with 1 if one fails."""
    try:
        install()
        suite = unittest.TestSuite(unittest.defaultTestLoader.loadTestsFromTestCase(case) for case in cases)
        result = unittest.TextTestRunner(stream=sys.stdout, verbosity=2).run(suite)
        code = 0 if result.wasSuccessful() and result.testsRun else 1
    except BaseException:  # otherwise Blender would continue
        traceback.print_exc()
        code = 1
    sys.stdout.flush()
    sys.exit(code)
