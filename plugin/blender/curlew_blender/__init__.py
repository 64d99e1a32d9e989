# SPDX-License-Identifier: GPL-3.0-or-later
"""Curlew in Blender: divergence-free flows that conform to walls, as a node tree."""

bl_info = {
    "name": "Curlew",
    "author": "The Curlew developers",
    "version": (0, 2, 0),
    "blender": (3, 4, 0),
    "location": "3D View > Sidebar > Curlew, and the node editor",
    "description": "Divergence-free flows that conform to walls: volumes, particles, streamlines",
    "category": "Physics",
}


def register() -> None:
    """Loads the library, and creates a node class for each of its actions."""
    from . import bake, former, groups, library, live, nodes, panel, presets, relocate, results, scene_io, shots, sockets
    from . import translations, values, writing

    if library.updated():
        raise RuntimeError("Curlew was updated: restart Blender to use it")
    actions = library.actions()
    sockets.register()
    nodes.register(actions)
    values.register()
    for module in (writing, former, groups, shots, bake, scene_io, presets, relocate, results, live, translations):
        module.register()
    panel.register(actions)


def unregister() -> None:
    """Unregisters everything."""
    from . import bake, former, groups, live, nodes, panel, presets, relocate, results, scene_io, shots, sockets
    from . import translations, values, writing

    panel.unregister()
    for module in (translations, live, results, relocate, presets, scene_io, bake, shots, groups, former, writing, values, nodes, sockets):
        module.unregister()
