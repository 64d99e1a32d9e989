"""From a node tree to a graph: reroutes, groups and muted nodes are followed, objects of the scene become files."""

import re
from dataclasses import dataclass, field
from typing import Callable, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple

import bpy

from . import library, nodes
from .actions import split_words
from .moment import Moment
from .program import GraphNode, Program, TreeError, Wanted, program_of
from .slots import STACKS, Slot
from .sources import MeshSource, Place
from .stacks import Ref

_DEEPEST = 32  # groups within groups
_STILL = (nodes.CurlewMeshObject.bl_idname, nodes.CurlewVolumeObject.bl_idname)

# The file that a volume result is written into, by the key and the label of its node.
FileNamer = Callable[[str, str], str]


@dataclass
class Collected:
    """What a tree says."""

    graph: Dict[str, GraphNode] = field(default_factory=dict)
    wanted: List[Wanted] = field(default_factory=list)
    nodes: Dict[str, bpy.types.Node] = field(default_factory=dict)
    meshes: Dict[str, MeshSource] = field(default_factory=dict)  # by the name that the program reads
    places: Dict[str, Place] = field(default_factory=dict)  # by the key of the node that takes it
    files: Dict[str, str] = field(default_factory=dict)  # of volume results, by key

    def program(self, frames: Optional[str] = None) -> Program:
        """The scene. Throws TreeError."""
        return program_of(self.graph, library.actions(), frames, self.wanted)


def collect(tree: bpy.types.NodeTree, namer: Optional[FileNamer] = None) -> Collected:
    """The graph of a tree. `namer`: into which files volumes go; without one they are left out. Throws TreeError."""
    return _Collector(tree, namer).collected


@dataclass(frozen=True)
class _Level:
    """A tree within the groups that lead to it."""

    tree: bpy.types.NodeTree
    path: Tuple[bpy.types.Node, ...] = ()

    def key(self, node: bpy.types.Node) -> str:
        return "/".join([n.name for n in self.path] + [node.name])

    def inside(self, group: bpy.types.Node) -> "_Level":
        return _Level(group.node_tree, self.path + (group,))


def _is_group(node: bpy.types.Node) -> bool:
    return node.bl_idname == nodes.CurlewGroup.bl_idname


def _walk(level: _Level) -> Iterator[Tuple[_Level, bpy.types.Node]]:
    """The nodes that count, within groups too: no muted ones, frames, reroutes or ends of groups."""
    if len(level.path) > _DEEPEST:
        raise TreeError(level.path[0].name, "the group contains itself")
    for node in level.tree.nodes:
        if node.mute:
            continue
        if _is_group(node):
            if node.node_tree:
                yield level, node
                yield from _walk(level.inside(node))
        elif hasattr(node, "makes"):
            yield level, node


def nodes_of(tree: bpy.types.NodeTree) -> Dict[str, bpy.types.Node]:
    """The nodes by their keys. Undo replaces nodes, so a bake that has ended asks anew."""
    found: Dict[str, bpy.types.Node] = {}
    try:
        for level, node in _walk(_Level(tree)):
            found[level.key(node)] = node
    except TreeError:
        pass  # groups within themselves, which collect() tells of
    return found


def _file_name(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9_-]+", "_", text).strip("_") or "object"


class _Collector:
    def __init__(self, tree: bpy.types.NodeTree, namer: Optional[FileNamer]) -> None:
        self.collected = Collected()
        self._namer = namer
        for level, node in _walk(_Level(tree)):
            self.collected.nodes[level.key(node)] = node
            if not _is_group(node):
                self._node(level, node)

    # --- links

    def _source(self, level: _Level, socket: bpy.types.NodeSocket, depth: int = 0) -> Optional[Ref]:
        """The output that feeds an input socket; None where nothing does."""
        if depth > 150:
            raise TreeError(level.key(socket.node), "the links go in a circle")
        for link in socket.links:
            if getattr(link, "is_muted", False):
                continue
            return self._output(level, link.from_node, link.from_socket, depth + 1)
        return None

    def _output(self, level: _Level, node: bpy.types.Node, socket: bpy.types.NodeSocket, depth: int) -> Optional[Ref]:
        if node.bl_idname == "NodeReroute":
            return self._source(level, node.inputs[0], depth)
        if node.bl_idname == "NodeGroupInput":
            if not level.path:
                return None
            outer = _Level(level.path[-2].node_tree if len(level.path) > 1 else level.path[-1].id_data, level.path[:-1])
            return self._source(outer, level.path[-1].inputs[_index(node.outputs, socket)], depth)
        if node.mute:
            return self._through(level, node, socket, depth)
        if _is_group(node):
            return self._of_group(level, node, _index(node.outputs, socket), depth)
        if not hasattr(node, "makes"):
            raise TreeError(level.key(node), "is not a node of Curlew")
        return Ref(level.key(node), _index(node.outputs, socket))

    def _of_group(self, level: _Level, group: bpy.types.Node, index: int, depth: int) -> Optional[Ref]:
        if not group.node_tree:
            raise TreeError(level.key(group), "the group has no tree")
        ends = sorted((n for n in group.node_tree.nodes if n.bl_idname == "NodeGroupOutput"),
                      key=lambda n: not n.is_active_output)
        if not ends:
            raise TreeError(level.key(group), "the group has no Group Output node")
        return self._source(level.inside(group), ends[0].inputs[index], depth)

    def _through(self, level: _Level, node: bpy.types.Node, socket: bpy.types.NodeSocket, depth: int) -> Optional[Ref]:
        """A muted node hands on the first input that has what the output has."""
        for given in node.inputs:
            alike = {given.bl_idname, socket.bl_idname} <= {"CurlewFieldSocket", "CurlewShapeSocket"}
            if given.bl_idname == socket.bl_idname or alike:
                return self._source(level, given, depth)
        raise TreeError(level.key(node), f"is muted, and has nothing to hand on as '{socket.name}'")

    def _inputs(self, level: _Level, node: bpy.types.Node) -> List[Optional[Ref]]:
        refs: List[Optional[Ref]] = []
        for slot, socket in zip(node.takes, node.inputs):
            ref = self._source(level, socket)
            if ref:
                self._check_link(level, node, slot, socket)
            refs.append(ref)
        return refs

    def _check_link(self, level: _Level, node: bpy.types.Node, slot: Slot, socket: bpy.types.NodeSocket) -> None:
        """What no object of that socket could ever be, before anything runs."""
        source = next(link.from_socket for link in socket.links)
        kind = source.bl_idname.replace("Curlew", "").replace("Socket", "")
        able = {"Field": {"fields"}, "Shape": {"fields"}, "Flow": {"flows"}, "Grid": {"grids"}, "Image": {"images"},
                "Geometry": {"geometry"}, "Points": {"geometry"}, "Curves": {"geometry"}}.get(kind)
        if able is not None and not able & {STACKS[k] for k in slot.kinds}:
            raise TreeError(level.key(node), f"'{slot.name}' cannot take a link from {kind} ({source.node.name})")

    # --- nodes

    def _node(self, level: _Level, node: bpy.types.Node) -> None:
        key = level.key(node)
        when = {"auto": "", "once": "once", "frame": "frame"}[node.when]
        if node.bl_idname == nodes.CurlewMeshObject.bl_idname:
            self._mesh_object(key, node)
        elif node.bl_idname == nodes.CurlewVolumeObject.bl_idname:
            self._volume_object(key, node)
        elif hasattr(node, "kind"):
            self._result(key, node, self._inputs(level, node))
        else:
            words = self._words(key, node)
            made = GraphNode(key, node.action.name, words, node.given(), self._inputs(level, node), when,
                             node.order + 1e-6 * node.location.x - 1e-9 * node.location.y)
            self.collected.graph[key] = made
            if node.places() and node.place:
                self.collected.places[key] = Place(node.place, node.action)

    def _words(self, key: str, node: bpy.types.Node) -> List[str]:
        try:
            words = split_words(node.words)
        except ValueError as error:
            raise TreeError(key, str(error)) from None
        if len(words) < node.action.fewest_words and node.action.name != "frames":
            raise TreeError(key, f"needs {node.action.words}")
        return [bpy.path.abspath(word) if word.startswith("//") else word for word in words]

    def _mesh_object(self, key: str, node: bpy.types.Node) -> None:
        if node.object is None:
            if self._is_used(node):
                raise TreeError(key, "choose a mesh object")
            return
        same = next((name for name, mesh in self.collected.meshes.items()
                     if mesh.object == node.object and mesh.animated == node.animated), None)
        name = same or self._unused(_file_name(node.object.name), node.animated)
        self.collected.meshes[name] = MeshSource(node.object, node.animated, key)
        self.collected.graph[key] = GraphNode(key, "read", [name], reads=[(0, "mesh")])

    def _unused(self, name: str, animated: bool) -> str:
        ending = ".$F4.ply" if animated else ".ply"
        k, result = 1, name + ending
        while result in self.collected.meshes:
            k += 1
            result = f"{name}_{k}{ending}"
        return result

    def _is_used(self, node: bpy.types.Node) -> bool:
        return any(socket.is_linked for socket in node.outputs)

    def _volume_object(self, key: str, node: bpy.types.Node) -> None:
        if node.object is None or node.object.type != "VOLUME":
            if self._is_used(node):
                raise TreeError(key, "choose a volume object")
            return
        volume = node.object.data
        file = bpy.path.abspath(volume.filepath)
        if volume.is_sequence:
            file = re.sub(r"(\d+)(?=\.vdb$)", lambda m: f"$F{len(m[1])}", file)
        volume.grids.load()
        if volume.grids.error_message:
            raise TreeError(key, f"'{file}': {volume.grids.error_message}")
        chosen = [g for g in volume.grids if not node.grids or g.name in node.grids.split(",")]
        options = {"grids": ",".join(g.name for g in chosen)} if node.grids else {}
        reads = [(min(k, 3), "velocity" if g.data_type.startswith("VECTOR") else "grid") for k, g in enumerate(chosen)]
        self.collected.graph[key] = GraphNode(key, "read", [file], options, reads=reads)

    def _result(self, key: str, node: bpy.types.Node, inputs: List[Optional[Ref]]) -> None:
        if node.kind != "grid":
            self.collected.wanted.append(Wanted(key, node.kind, inputs[0]))
        elif self._namer:
            file = self._namer(key, _file_name(node.label or node.name))
            self.collected.files[key] = file
            self.collected.graph[key] = GraphNode(key, "write", [file], {}, inputs, order=1e6)


def _index(sockets: Sequence[bpy.types.NodeSocket], socket: bpy.types.NodeSocket) -> int:
    return next(k for k, other in enumerate(sockets) if other == socket)


def staggered(collected: Collected) -> None:
    """Throws TreeError where a volume result would show staggered velocities, which Blender takes for centred ones."""
    for key in collected.files:
        for ref in collected.graph[key].inputs:
            made = collected.graph.get(ref.key) if ref else None
            if made and made.options.get("staggered") == "1":
                raise TreeError(made.key, "Blender ignores staggering and would show this half a voxel off: use "
                                          "staggered=0 for a volume result, or write the grid with a Write node")


def is_sequence(tree: bpy.types.NodeTree) -> bool:
    """Whether its bake is one of frames."""
    return tree.sequence or any(n.bl_idname == nodes.action_id("frames") and not n.mute for n in tree.nodes)


def hold(collected: Collected, scene: bpy.types.Scene) -> None:
    """Makes it a still of the scene's frame: expressions of time have its numbers."""
    fps = scene.render.fps / scene.render.fps_base
    moment = Moment(scene.frame_current, (scene.frame_current - scene.frame_start) / fps, fps)
    if moment == Moment():
        return
    for node in collected.graph.values():
        node.words = [moment.at(word) for word in node.words]
        node.options = {name: moment.at(text) for name, text in node.options.items()}


def frames_words(tree: bpy.types.NodeTree, scene: bpy.types.Scene, collected: Collected) -> Optional[str]:
    """The words of -frames: the scene's, unless a Frames node says more. None for a still."""
    node = next((n for n in collected.graph.values() if n.action == "frames"), None)
    if not tree.sequence and not node:
        return None
    options: Dict[str, str] = {"fps": f"{scene.render.fps / scene.render.fps_base:.9g}"}
    if tree.substeps != 1:
        options["substeps"] = str(tree.substeps)
    words = [f"{scene.frame_start}-{scene.frame_end}"]
    if node:
        words = node.words or words
        options.update(node.options)
    return " ".join(words + [f"{name}={value}" for name, value in options.items()])


def clear_errors(tree: bpy.types.NodeTree) -> None:
    """Nodes are no longer red."""
    tree.message = ""
    for each in [tree] + [n.node_tree for n in tree.nodes if _is_group(n) and n.node_tree]:
        for node in each.nodes:
            if getattr(node, "error", ""):
                node.show_error("")


def show_error(tree: bpy.types.NodeTree, error: TreeError) -> None:
    """What is wrong now: on its node and on the groups that it is in, and on the tree."""
    clear_errors(tree)
    tree.message = str(error)
    found = nodes_of(tree)
    parts = error.key.split("/")
    for k in range(len(parts)):
        name = "/".join(parts[: k + 1])
        node = found.get(name) or (tree.nodes.get(name) if k == 0 else None)
        if node is not None and hasattr(node, "show_error"):
            node.show_error(str(error))
