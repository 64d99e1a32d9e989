"""The preview: while options are dragged, 2,000 particles or a coarse slice of the tree's flow."""

import atexit
import time
from dataclasses import replace
from typing import Any, Dict, List, Optional, Tuple

import bpy
import numpy as np

from . import library, looks, nodes, results
from . import tree as trees
from .job import in_frames
from .program import GraphNode, Program, TreeError, Wanted, program_of
from .slots import made_of
from .sources import MeshArrays, Sampled, provide
from .stacks import Ref
from .tree import Collected

NAME = "Curlew Preview"
PARTICLES, PIXELS, COARSE = 2000, 72, 32
_DELAY = 0.01
_MOST_RUNS = 200  # before a session is made anew: its stacks grow

_pending: List[str] = []
last_seconds = 0.0  # what the last preview took


def _flow(collected: Collected, tree: bpy.types.NodeTree) -> Ref:
    """The flow of the active node, or else the one that the results are made of."""
    actions = library.actions()
    flows = {
        key: Ref(key, 0) for key, node in collected.graph.items()
        if any(made.kind == "flow" for made in made_of(actions[node.action]))
    }
    active = tree.nodes.active.name if tree.nodes.active else ""
    if active in flows:
        return flows[active]
    for key, node in collected.graph.items():
        for ref in node.inputs:
            if ref and ref.key in flows and key not in flows:
                return ref
    for ref in flows.values():
        return ref
    raise TreeError("", "there is no flow to preview")


def _coarse(node: GraphNode) -> GraphNode:
    if node.action != "mesh2ls":
        return node
    options = {name: text for name, text in node.options.items() if name not in ("dim", "voxel")}
    return replace(node, options={**options, "dim": str(COARSE)})


def _program(tree: bpy.types.NodeTree, scene: bpy.types.Scene) -> Tuple[Program, Sampled, Wanted]:
    """What leads to the flow, and what shows it."""
    collected = trees.collect(tree)
    flow = _flow(collected, tree)
    sampled, _ = in_frames(collected, scene, None)
    graph: Dict[str, GraphNode] = {}
    waiting = [flow.key]
    while waiting:
        node = collected.graph[waiting.pop()]
        if node.key not in graph:
            graph[node.key] = _coarse(node)
            waiting += [ref.key for ref in node.inputs if ref]
    if tree.preview == "SLICE":
        graph["@"] = GraphNode("@", "slice", [], {"width": str(PIXELS)}, [flow])
        wanted = Wanted("@@", "image", Ref("@", 0))
    else:
        graph["@"] = GraphNode("@", "scatter", [], {"count": str(PARTICLES)}, [flow])
        short = {"time": "0.3", "steps": "2", "scheme": "midpoint"}
        graph["@move"] = GraphNode("@move", "advect", [], short, [flow, Ref("@", 0)])
        wanted = Wanted("@@", "points", Ref("@move", 0))
    return program_of(graph, library.actions(), None, [wanted]), sampled, wanted


class _Warm:
    """A session that has the level sets already: what comes after them is run again and again."""

    def __init__(self) -> None:
        self._session: Any = None
        self._lines: List[str] = []
        self._meshes: Dict[str, MeshArrays] = {}
        self._runs = 0

    def close(self) -> None:
        """Gives the session back."""
        if self._session is not None:
            self._session.close()
        self._session = None

    def run(self, program: Program, meshes: Dict[str, MeshArrays]) -> Any:
        """The session, after it has run the program."""
        actions = [line.split(" ")[0] for line in program.lines]
        heavy = [k for k, name in enumerate(actions) if name in ("read", "mesh2ls")]
        begin = heavy[-1] + 1 if heavy else 0
        if begin == 0 or not all(_leaves_nothing(name) for name in actions[begin:]):
            begin = 0
        lines = program.lines[:begin]
        known = self._session is not None and lines == self._lines and begin > 0 and self._runs < _MOST_RUNS
        if not known or not _same(meshes, self._meshes):
            self.close()
            self._session = library.curlew().Session()
            provide(self._session, meshes.items())
            self._lines, self._meshes, self._runs = lines, meshes, 0
            self._part(program, 0, begin)
        self._runs += 1
        self._part(program, begin, len(program.lines))
        return self._session

    def _part(self, program: Program, begin: int, end: int) -> None:
        curlew = library.curlew()
        try:
            self._session.run("".join(line + "\n" for line in program.lines[begin:end]), name="preview")
        except curlew.Error as error:
            self.close()
            key = program.key_of(begin + error.line) if error.line else None
            raise TreeError(key or "", str(error)) from error


def _leaves_nothing(name: str) -> bool:
    """Whether a second run of an action cannot find what a first one has left, and take it for a wall."""
    return all(made.kind in ("noise", "flow", "points", "curves", "image") for made in made_of(library.actions()[name]))


def _same(a: Dict[str, MeshArrays], b: Dict[str, MeshArrays]) -> bool:
    return a.keys() == b.keys() and all(
        np.array_equal(a[k].points, b[k].points) and np.array_equal(a[k].indices, b[k].indices) for k in a)


_warm = _Warm()
atexit.register(_warm.close)


def show(tree: bpy.types.NodeTree, scene: bpy.types.Scene) -> bpy.types.Object:
    """Makes or renews the preview object. Throws TreeError."""
    global last_seconds
    began = time.perf_counter()
    program, sampled, wanted = _program(tree, scene)
    session = _warm.run(program, sampled.meshes)
    age = program.ages[wanted.key]
    if wanted.kind == "points":
        obj = _points(results.points_arrays(session.points(age)), scene)
    else:
        flow = session.flow()
        obj = _slice(session.image(age).pixels[:, :, 0], flow.lower, flow.upper, scene)
    last_seconds = time.perf_counter() - began
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
    """An image of the plane in the middle, white where the flow is fastest."""
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
    """Takes the preview away."""
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


def schedule(tree: bpy.types.NodeTree) -> None:
    """Something in the tree has changed: its preview will follow."""
    if tree.bl_idname != nodes.TREE or (tree.preview == "NONE" and NAME not in bpy.data.objects):
        return
    if tree.name not in _pending:
        _pending.append(tree.name)
    if not bpy.app.timers.is_registered(_later):
        bpy.app.timers.register(_later, first_interval=_DELAY)


def register() -> None:
    """Listens to the trees."""
    nodes.changed.append(schedule)


def unregister() -> None:
    """No longer."""
    nodes.changed.remove(schedule)
    if bpy.app.timers.is_registered(_later):
        bpy.app.timers.unregister(_later)
    _pending.clear()
    _warm.close()
