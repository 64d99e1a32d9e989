# SPDX-License-Identifier: GPL-3.0-or-later
"""Curlew in Blender: divergence-free flows that conform to walls, as a node tree."""

from types import ModuleType
from typing import Tuple

bl_info = {
    "name": "Curlew",
    "author": "The Curlew developers",
    "version": (0, 2, 0),
    "blender": (3, 4, 0),
    "location": "3D View > Sidebar > Curlew, and the node editor",
    "description": "Divergence-free flows that conform to walls: volumes, particles, streamlines",
    "category": "Physics",
}


def _modules() -> Tuple[ModuleType, ...]:
    """Returns the modules that register something, in their order."""
    from . import bake, former, groups, live, main_thread, nodes, outdated, panel, presets, relocate, results, scene_io, shots
    from . import sockets, translations, values, writing

    return (sockets, nodes, values, writing, former, groups, shots, bake, scene_io, presets, relocate, main_thread, results,
            live, outdated, translations, panel)


def register() -> None:
    """Loads the library, and creates a node class for each of its actions."""
    from . import library

    if library.updated():
        raise RuntimeError("Curlew was updated: restart Blender to use it")
    library.actions()  # its errors, before anything is registered
    for module in _modules():
        module.register()


def unregister() -> None:
    """Unregisters everything."""
    for module in reversed(_modules()):
        module.unregister()
