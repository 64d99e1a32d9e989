# SPDX-License-Identifier: Apache-2.0
"""An update over the enabled add-on: what is loaded runs on, and Blender quits without a crash."""

import sys
import unittest
import zipfile
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import support  # noqa: E402
from support import Tree  # noqa: E402


def another_version():
    """Packs the add-on with one different byte in its library."""
    packed = next(support.PACKAGES.glob("*-legacy.zip"))
    path = support.WORK / "another.zip"
    with zipfile.ZipFile(packed) as old, zipfile.ZipFile(path, "w") as new:
        for entry in old.infolist():
            data = bytearray(old.read(entry))
            if entry.filename.endswith("/libcurlew.so"):
                data.append(0)
            new.writestr(entry, bytes(data), compresslevel=0)
    return path


class Update(unittest.TestCase):
    def bake(self):
        """Bakes particles, and reads points in the library's separate process."""
        build = Tree()
        flow = build.add("dfvn", build.add("noise"), build.add("noise", seed=1))
        points = build.add("advect", flow, build.add("scatter", flow, count=1000), steps=4)
        result = build.add("CurlewParticlesResult", points)
        build.add("write", points, words=str(support.WORK / "points.csv"))
        support.addon("bake").bake(build.tree)
        build = Tree()
        again = build.add("CurlewParticlesResult", build.add("read", words=str(support.WORK / "points.csv")))
        self.assertEqual(bpy.ops.curlew.bake(tree=build.tree.name), {"FINISHED"})
        self.assertEqual((len(result.target.data.vertices), len(again.target.data.vertices)), (1000, 1000))

    def test_an_update_between_bakes(self):
        support.empty()
        self.bake()
        self.assertFalse(support.addon("library").updated())
        bpy.ops.preferences.addon_install(filepath=str(another_version()), overwrite=True)
        self.assertTrue(support.addon("library").updated())
        self.bake()
        bpy.ops.preferences.addon_disable(module=support.NAME)
        with self.assertRaisesRegex(RuntimeError, "restart Blender"):
            bpy.ops.preferences.addon_enable(module=support.NAME)


support.main(Update)
