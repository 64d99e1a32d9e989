# SPDX-License-Identifier: Apache-2.0
"""The Python blocks for Blender on the pages run, with smaller presets, and give the results that the pages state."""

import os
import re
import sys
import unittest
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import support  # noqa: E402


def blocks(page):
    """Returns the Python blocks for Blender on a page. Each is a separate script."""
    found = re.findall(r"^```python\n(.*?)^```", (support.SOURCE / page).read_text(), re.MULTILINE | re.DOTALL)
    return [block for block in found if re.search(r"^import bpy", block, re.MULTILINE)]


class Pages(unittest.TestCase):
    """The scripts run in the folder of the test."""

    def setUp(self):
        support.empty()
        support.reduce_presets()
        os.chdir(support.WORK)

    def test_the_tutorial_renders_its_picture(self):
        for block in blocks("docs/tutorials/in_blender.md"):
            exec(block, {})
        self.assertEqual(bpy.data.images.load(str(support.WORK / "skin.png")).size[:], (400, 300))
        pixels = support.image(support.WORK / "skin.png")[:, :, :3]
        self.assertGreater(pixels.max() - pixels.min(), 0.3, "the picture is empty")

    def test_the_recipe_makes_objects(self):
        (block,) = blocks("docs/recipes.md")
        exec(block, {})
        self.assertGreater(len(bpy.data.objects), 1)
        self.assertTrue([obj for obj in bpy.data.objects if obj.get("curlew_kind") == "points" and len(obj.data.vertices) > 1000])


support.main(Pages)
