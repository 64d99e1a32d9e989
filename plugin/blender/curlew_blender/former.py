# SPDX-License-Identifier: GPL-3.0-or-later
"""Former names of options. A .blend file stores the options of a node by name, so those of the last release are renamed
when a file is loaded."""

from typing import Any, Iterator, List, Tuple

import bpy

from . import nodes


def _properties(node: bpy.types.Node) -> Iterator[Tuple[str, str]]:
    """Yields the former and the current name of each renamed property of a node."""
    for option in node.action.options:
        for former in option.formerly:
            for prefix in ("o_", "t_"):
                yield prefix + former, prefix + option.name


def _curves(tree: bpy.types.NodeTree) -> List[bpy.types.FCurve]:
    """Returns the keyframes and drivers of a tree."""
    data = tree.animation_data
    return [*(data.action.fcurves if data.action else ()), *data.drivers] if data else []


def _rename(node: Any, former: str, name: str) -> None:
    value = node[former]
    if name not in node:
        node[name] = value.to_list() if hasattr(value, "to_list") else value
    del node[former]


def rename(tree: bpy.types.NodeTree) -> None:
    """Renames the options of a tree that have former names, with their keyframes and drivers. If the option is also set
    under its current name, that value wins."""
    curves = _curves(tree)
    for node in tree.nodes:
        if node.bl_idname == nodes.CurlewMeshObject.bl_idname and "animated" in node:
            node.motion = "ON" if node["animated"] else "AUTO"
            del node["animated"]
        if not isinstance(node, nodes.ActionNode):
            continue
        path = node.path_from_id()
        for former, name in _properties(node):
            if former in node:
                _rename(node, former, name)
            for curve in curves:
                if curve.data_path == f"{path}.{former}":
                    curve.data_path = f"{path}.{name}"
                    curve.is_valid = True  # Blender may have tried the former name


@bpy.app.handlers.persistent
def rename_all(*_: Any) -> None:
    """Renames the options of all trees of the file."""
    for tree in bpy.data.node_groups:
        if tree.bl_idname == nodes.TREE:
            rename(tree)


def register() -> None:
    """Registers the handler, and renames the options of the open file."""
    bpy.app.handlers.load_post.append(rename_all)
    if hasattr(bpy.data, "node_groups"):  # not while Blender starts
        rename_all()


def unregister() -> None:
    """Unregisters the handler."""
    bpy.app.handlers.load_post.remove(rename_all)
