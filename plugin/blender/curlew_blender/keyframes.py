# SPDX-License-Identifier: GPL-3.0-or-later
"""Keyframes of nodes' options. Blender itself only evaluates the keyframes of trees that an object or a scene uses."""

import re
from typing import Any, Dict, List, Sequence, Tuple

import bpy

from .actions import Option, TreeError
from .sources import in_time
from .tree import Collected

_NUMBERS = ("real", "integer", "flag", "vector", "interval", "box")


def follow(tree: bpy.types.NodeTree, frame: float) -> None:
    """Sets the keyframed properties of a tree to their values in a frame. Ignores keyframes whose property no longer
    exists."""
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


def _used(collected: Collected) -> Dict[str, bpy.types.Node]:
    """Returns the nodes of the graph and those that give them values."""
    return {**{key: collected.nodes[key] for key in collected.graph if key in collected.nodes},  # the preview adds others
            **collected.values}


def of(collected: Collected) -> Dict[str, Dict[str, List[Any]]]:
    """Returns the keyframes of options, by the keys of their nodes. An option that sockets feed has those of all nodes that
    give values."""
    fed = [key for node in collected.values.values() for key in _keys(node, "")]
    result: Dict[str, Dict[str, List[Any]]] = {}
    for key in collected.graph:
        node = collected.nodes.get(key)
        for option in getattr(node, "action", None) and node.action.options or ():
            socket = node.value_sockets().get("o_" + option.name)
            found = _keys(node, "o_" + option.name) or (fed if socket and socket.is_linked else _keys(socket, "") if socket else [])
            if found:
                result.setdefault(key, {})[option.name] = found
    return result


def _keys(owner: bpy.types.bpy_struct, name: str) -> List[Any]:
    """Returns the keyframes of a property, or of all if the name is empty."""
    data = owner.id_data.animation_data
    start = f"{owner.path_from_id()}.{name}"
    return [[curve.array_index, *key.co, *key.handle_left, *key.handle_right, key.interpolation]
            for curve in (data.action.fcurves if data and data.action else ())
            if (curve.data_path == start if name else curve.data_path.startswith(start)) for key in curve.keyframe_points]


def check(collected: Collected) -> None:
    """Raises TreeError if an option has a driver, or if the keyframes of a tree are strips of the nonlinear animation
    editor. Blender does not evaluate them, because no object or scene uses the tree."""
    for key, node in _used(collected).items():
        data = node.id_data.animation_data
        if not data:
            continue
        start = node.path_from_id() + "."

        def named(curve: bpy.types.FCurve) -> str:
            is_option = curve.data_path.startswith(start) and not curve.mute
            name = curve.data_path[len(start):].removeprefix("o_")
            number = re.fullmatch(r"inputs\[(\d+)\]\.default_value", name)
            return (node.inputs[int(number[1])].name if number else name) if is_option else ""

        for name in filter(None, map(named, data.drivers)):
            raise TreeError(key, f"'{name}' has a driver, which a bake cannot follow; use keyframes, or text with "
                                 "{expressions} of F and T")
        for strip in (strip for track in data.nla_tracks if not track.mute for strip in track.strips if not strip.mute):
            for name in filter(None, map(named, strip.action.fcurves if strip.action else ())):
                raise TreeError(key, f"'{name}' is animated by the strip '{strip.name}' of the nonlinear animation editor, "
                                     "which a bake cannot follow; make its action the active one")


def over_frames(collected: Collected, frames: Sequence[int], now: int, shift: int = 0) -> Dict[str, Dict[str, str]]:
    """Returns the options that change in these frames, by the keys of their nodes, as expressions that are linear
    between frames. `shift`: what to subtract from a frame to get that of the scene. Raises TreeError if an option cannot be an
    expression."""
    trees = {node.id_data.name: node.id_data for node in _used(collected).values() if node.id_data.animation_data}
    given: Dict[str, List[Dict[str, str]]] = {key: [] for key in collected.given}
    for frame in frames if trees else ():
        for tree in trees.values():
            follow(tree, frame - shift)
        for key, options in collected.given.items():
            given[key].append(options())
    for tree in trees.values():
        follow(tree, now)
    return {key: {name: _expression(key, collected.nodes[key].action.option(name), [each[name] for each in texts], frames)
                  for name in texts[0] if len({each[name] for each in texts}) > 1}
            for key, texts in given.items() if texts}


def _expression(key: str, option: Option, texts: Sequence[str], frames: Sequence[int]) -> str:
    if option.type not in _NUMBERS:
        raise TreeError(key, f"'{option.name}' changes during the sequence, but only numbers can be animated")
    values = [[float(part) for part in text.split(",")] for text in texts]
    whole = option.type in ("integer", "flag")
    return ",".join(in_time(column, frames, whole) for column in zip(*values))
