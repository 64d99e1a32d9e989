# SPDX-License-Identifier: GPL-3.0-or-later
"""The preview: shows 2,000 particles or a coarse slice of the tree's flow while options are dragged."""

import atexit
import time
from typing import List, Optional

import bpy
import numpy as np

from . import job, library, looks, nodes, results, values
from . import tree as trees
from .actions import TreeError
from .sources import MeshArrays, coarse
from .tree import Collected, graph_node

NAME = "Curlew Preview"
PARTICLES, PIXELS, COARSE = 2000, 72, 32
_HALF_WIDTH = 13  # voxels: layers up to 0.3 of the size of the object can be dragged without a new level set
_MANY = 100000  # faces of a mesh that is coarsened
_POINTS, _SHOWN = "@points", "@preview"  # names of the nodes that the preview adds

_pending: List[str] = []
_sessions = library.Sessions()
atexit.register(_sessions.keep, {})
last_seconds = 0.0  # duration of the last preview
last_tree = ""  # the name of its tree


def _makes_flow(node: bpy.types.Node) -> bool:
    return any(made.kinds == {"flow"} for made in getattr(node, "makes", ()))


def _flow(tree: bpy.types.NodeTree) -> str:
    """Returns the flow of the active node, or else one that the results depend on."""
    active = tree.nodes.active
    if active and not active.mute and _makes_flow(active):
        return active.name
    collected = trees.collect(tree, lambda key, name: name)  # results first, then their dependencies
    for key in collected.graph:
        if _makes_flow(collected.nodes[key]):
            return key
    for key, node in trees.nodes_of(tree).items():
        if _makes_flow(node):
            return key
    raise TreeError("", "there is no flow to preview")


def _add(collected: Collected, flow: str, is_slice: bool) -> None:
    """Adds the nodes that show the flow, and coarsens the meshes."""
    graph = collected.graph
    for node in graph.values():
        if node["action"] == "mesh2ls":
            node["options"].pop("voxel", None)
            node["options"] |= {"dim": str(COARSE), "halfWidth": str(_HALF_WIDTH)}
    if is_slice:
        graph[_SHOWN] = graph_node(_SHOWN, "slice", [], {"width": str(PIXELS)}, {"what": [flow]})
    else:
        short = {"duration": "0.3", "steps": "2", "scheme": "midpoint"}
        graph[_POINTS] = graph_node(_POINTS, "scatter", [], {"count": str(PARTICLES)}, {"domain": [flow]})
        graph[_SHOWN] = graph_node(_SHOWN, "advect", [], short, {"flow": [flow], "points": [_POINTS]})
    collected.wanted[_SHOWN] = ("image" if is_slice else "points", _SHOWN)


def show(tree: bpy.types.NodeTree, scene: bpy.types.Scene) -> bpy.types.Object:
    """Creates or updates the preview object. Raises TreeError if the tree is invalid."""
    global last_seconds, last_tree
    began = time.perf_counter()
    flow, is_slice = _flow(tree), tree.preview == "SLICE"
    collected = trees.collect(tree, roots=[flow])
    _add(collected, flow, is_slice)
    plan = job.finished(job.planned(tree, scene, collected, still=True))
    plan.meshes = {name: coarse(mesh, 4 * COARSE) if isinstance(mesh, MeshArrays) and len(mesh.sizes) > _MANY else mesh
                   for name, mesh in plan.meshes.items()}
    _sessions.keep(bpy.data.node_groups)
    with library.said_of_nodes(), _sessions.of(tree.name, plan.meshes) as session:
        session.run_graph(plan.graph, name="preview")
        if is_slice:
            about = session.flow(flow)
            obj = _slice(session.image(_SHOWN).pixels[:, :, 0], about.lower, about.upper, scene)
        else:
            obj = _points(results.points_arrays(session.points(_SHOWN)), scene)
    last_seconds, last_tree = time.perf_counter() - began, tree.name
    return obj


def _object(kind: str, scene: bpy.types.Scene) -> Optional[bpy.types.Object]:
    obj = bpy.data.objects.get(NAME)
    if obj and obj.type != kind:
        bpy.data.objects.remove(obj)
        return None
    return obj


def _points(arrays: results.Arrays, scene: bpy.types.Scene) -> bpy.types.Object:
    obj = _object("MESH", scene)
    if obj is None:
        obj = bpy.data.objects.new(NAME, bpy.data.meshes.new(NAME))
        scene.collection.objects.link(obj)
    results.show_points(obj.data, arrays)
    size = float(np.ptp(arrays["position"], axis=0).max()) if len(arrays["position"]) else 1.0
    looks.particles(obj, 0.004 * size, results.fastest(arrays))
    obj.hide_render = True
    return obj


def _slice(values: np.ndarray, lower: np.ndarray, upper: np.ndarray, scene: bpy.types.Scene) -> bpy.types.Object:
    """Creates an image of the central plane, white where the flow is fastest."""
    height, width = values.shape
    image = bpy.data.images.get(NAME)
    if image is None or tuple(image.size) != (width, height):
        if image:
            bpy.data.images.remove(image)
        image = bpy.data.images.new(NAME, width, height, alpha=True, float_buffer=True)
    shown = np.nan_to_num(values[::-1])
    bright = shown / max(float(shown.max()), 1e-30)
    pixels = np.stack([bright ** 1.5, bright, np.sqrt(bright), np.where(np.isnan(values[::-1]), 0.0, 0.9)], axis=2)
    image.pixels.foreach_set(np.ascontiguousarray(pixels, np.float32).reshape(-1))
    image.update()
    obj = _object("EMPTY", scene)
    if obj is None:
        obj = bpy.data.objects.new(NAME, None)
        scene.collection.objects.link(obj)
    obj.empty_display_type = "IMAGE"
    obj.data = image
    size = upper[:2] - lower[:2]
    obj.empty_display_size = float(size.max())
    obj.location = [float(v) for v in (lower + upper) / 2][:3] if len(lower) == 3 else (0.0, 0.0, 0.0)
    obj.use_empty_image_alpha = True
    return obj


def remove() -> None:
    """Removes the preview."""
    obj = bpy.data.objects.get(NAME)
    if obj:
        bpy.data.objects.remove(obj)


def _later() -> Optional[float]:
    while _pending:
        tree = bpy.data.node_groups.get(_pending.pop())
        if tree is None or tree.bl_idname != nodes.TREE:
            continue
        try:
            trees.clear_errors(tree)
            if tree.preview == "NONE":
                remove()
            else:
                show(tree, bpy.context.scene)
        except TreeError as error:
            trees.show_error(tree, error)
    return None


def _contains(tree: bpy.types.NodeTree, part: bpy.types.NodeTree) -> bool:
    """Returns whether `part` is the tree or one of its groups, at any depth."""
    seen, waiting = set(), [tree]
    while waiting:
        group = waiting.pop()
        if group == part:
            return True
        if group.name not in seen:  # a group may contain itself
            seen.add(group.name)
            waiting += [node.node_tree for node in group.nodes if getattr(node, "node_tree", None)]
    return False


def schedule(tree: bpy.types.NodeTree) -> None:
    """Schedules an update of the previews that show a tree which has changed."""
    if tree.bl_idname != nodes.TREE:
        return
    shown = [other for other in bpy.data.node_groups if other.bl_idname == nodes.TREE and other.preview != "NONE"]
    wanted = [other.name for other in shown if _contains(other, tree)]
    if tree.preview == "NONE" and NAME in bpy.data.objects and (not shown or tree.name == last_tree):
        wanted = [other.name for other in shown] or [tree.name]  # its preview has been switched off
    if not wanted:
        return
    _pending.extend(name for name in wanted if name not in _pending)
    if not bpy.app.timers.is_registered(_later):
        bpy.app.timers.register(_later)  # called when Blender has handled its events


def register() -> None:
    """Registers the listener for changes in trees."""
    values.changed.append(schedule)


def unregister() -> None:
    """Unregisters the listener."""
    values.changed.remove(schedule)
    if bpy.app.timers.is_registered(_later):
        bpy.app.timers.unregister(_later)
    _pending.clear()
    _sessions.keep({})
