# SPDX-License-Identifier: GPL-3.0-or-later
"""Marks the results that are older than the settings of the nodes that they depend on."""

import hashlib
import json
from typing import Any, Dict, List, Mapping, Optional, Set

import bpy

from . import handlers, keyframes, nodes, values
from . import tree as trees
from .actions import TreeError

_DELAY = 0.25  # seconds after a change
_pending: Set[str] = set()


def _upstream(graph: Mapping[str, Mapping[str, Any]], links: List[str]) -> Set[str]:
    """Returns the nodes that these links depend on."""
    found: Set[str] = set()
    waiting = list(links)
    while waiting:
        link = waiting.pop()
        key = link if link in graph else link.rpartition(".")[0]
        if key not in found:
            found.add(key)
            waiting += [each for each in sum(graph[key]["inputs"].values(), [])]
    return found


def settings(tree: bpy.types.NodeTree, scene: bpy.types.Scene, collected: trees.Collected) -> Dict[str, str]:
    """Returns a digest of all that each result depends on in the tree, by key: the same in every frame, whatever is
    animated. The contents of objects and files do not count."""
    animated = keyframes.of(collected)
    frames = trees.frames_of(tree, scene, collected)
    result: Dict[str, str] = {}
    for key in [*collected.files, *collected.wanted]:
        link = collected.wanted[key][1] if key in collected.wanted else None
        links = [link] if link else sum(collected.graph[key]["inputs"].values(), []) if key in collected.files else []
        about: List[Any] = [frames, links]
        for name in sorted(_upstream(collected.graph, links)):
            node = {**collected.graph[name], "options": dict(collected.graph[name]["options"])}
            keyed = animated.get(name, {})
            for option in keyed:
                node["options"].pop(option, None)
            places = [(place.object.name, option) for (owner, option), place in collected.places.items() if owner == name]
            about.append([node, keyed, sorted(places)])
        result[key] = hashlib.blake2b(json.dumps(about, sort_keys=True).encode(), digest_size=12).hexdigest()
    return result


def refresh(tree: bpy.types.NodeTree, scene: Optional[bpy.types.Scene] = None) -> None:
    """Sets the marks of a tree's results. Those of an invalid tree stay."""
    try:
        collected = trees.collect(tree, lambda key, name: name)
        now = settings(tree, scene or bpy.context.scene, collected)
    except TreeError:
        return
    for key, node in collected.nodes.items():
        if hasattr(node, "kind"):
            old = bool(node.baked) and node.baked != now.get(key)
            if node.outdated != old:
                node.outdated = old


def results(tree: bpy.types.NodeTree) -> int:
    """Returns the number of results that are marked."""
    return sum(getattr(node, "outdated", False) for node in trees.nodes_of(tree).values())


def _refresh_all() -> None:
    names = sorted(_pending)
    _pending.clear()
    for tree in filter(None, map(bpy.data.node_groups.get, names)):
        if tree.bl_idname == nodes.TREE and not tree.get("curlew_shot"):
            refresh(tree)


def schedule(tree: bpy.types.NodeTree) -> None:
    """Refreshes the marks of all trees soon: a group may be in any of them."""
    if bpy.app.background:
        return
    _pending.update(each.name for each in bpy.data.node_groups if each.bl_idname == nodes.TREE)
    if not bpy.app.timers.is_registered(_refresh_all):
        bpy.app.timers.register(_refresh_all, first_interval=_DELAY)


@bpy.app.handlers.persistent
def on_undo(*_: Any) -> None:
    """Undo changes settings without their update functions."""
    for tree in bpy.data.node_groups:
        if tree.bl_idname == nodes.TREE:
            schedule(tree)
            return


_add, _remove = handlers.factory(("undo_post", on_undo), ("redo_post", on_undo))


def register() -> None:
    """Registers the listeners."""
    values.changed.append(schedule)
    _add()


def unregister() -> None:
    """Unregisters them."""
    _remove()
    values.changed.remove(schedule)
    if bpy.app.timers.is_registered(_refresh_all):
        bpy.app.timers.unregister(_refresh_all)
    _pending.clear()
