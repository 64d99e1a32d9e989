"""Keyframes of nodes' options: Blender itself only follows those of trees that an object or a scene uses."""

from typing import Any, List, Tuple

import bpy


def follow(tree: bpy.types.NodeTree, frame: float) -> None:
    """Sets what has keyframes in a tree to its value in a frame. What they are about may be gone."""
    action = tree.animation_data.action if tree.animation_data else None
    for curve in action.fcurves if action else ():
        if curve.mute or not curve.is_valid:
            continue
        path, _, name = curve.data_path.rpartition(".")
        try:
            owner = tree.path_resolve(path) if path else tree
        except ValueError:
            continue
        _set(owner, name, curve.array_index, curve.evaluate(frame))


def _set(owner: Any, name: str, index: int, value: float) -> None:
    about = owner.bl_rna.properties.get(name)
    if about is None:
        return
    if getattr(about, "is_array", False):
        if getattr(owner, name)[index] != value:
            getattr(owner, name)[index] = value
        return
    if about.type == "ENUM":
        items: List[Tuple[int, str]] = [(item.value, item.identifier) for item in about.enum_items]
        wanted: Any = dict(items).get(round(value))
    else:
        wanted = {"BOOLEAN": bool, "INT": round}.get(about.type, float)(value)
    if wanted is not None and getattr(owner, name) != wanted:
        setattr(owner, name, wanted)
