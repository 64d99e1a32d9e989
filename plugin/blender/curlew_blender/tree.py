# SPDX-License-Identifier: GPL-3.0-or-later
# Longer than 400 lines: nodes, groups, sockets and objects are resolved in one walk of the tree.
"""Converts a node tree to a graph. Resolves reroutes, groups and muted nodes; objects of the scene become files.

The library determines everything else: the order of the nodes, what is evaluated in each frame, and whether links fit.
"""

import re
from dataclasses import dataclass, field
from typing import Any, Callable, Dict, Iterator, List, Mapping, Optional, Sequence, Set, Tuple, Type

import bpy

from . import cache, former, library, nodes
from .actions import TreeError, fitting_text, number_text, split_words
from .sources import CurveSource, MeshSource, Place, has_edges, may_change, members
from .texts import plain, varies
from .values import Arrow

_DEEPEST = 32  # maximum nesting depth of groups
_MODEL = re.compile(r"\.(gltf|glb|fbx|dae)(\.gz)?$", re.IGNORECASE)  # files that may have an animation

# Returns the file for a volume result, given the key and the label of its node.
FileNamer = Callable[[str, str], str]
Graph = Dict[str, Any]  # in the library's format (docs/graph.md)


@dataclass
class Collected:
    """The content of a tree."""

    graph: Dict[str, Dict[str, Any]] = field(default_factory=dict)  # nodes of the graph, by name
    frames: Optional[Dict[str, Any]] = None  # words and options of the Frames node
    resume: bool = False
    wanted: Dict[str, Tuple[str, Optional[str]]] = field(default_factory=dict)  # kinds and links of the other results,
                                                                                # by key
    nodes: Dict[str, bpy.types.Node] = field(default_factory=dict)
    reached: Dict[str, bpy.types.Node] = field(default_factory=dict)  # those that are evaluated, in their order
    meshes: Dict[str, MeshSource] = field(default_factory=dict)  # by the file name that the graph reads
    places: Dict[Tuple[str, str], Place] = field(default_factory=dict)  # by the key of the node that uses it, and its option
    given: Dict[str, Callable[[], Dict[str, str]]] = field(default_factory=dict)  # return the options of nodes in this frame, by key
    values: Dict[str, bpy.types.Node] = field(default_factory=dict)  # nodes that are not in the graph, but give values, by key
    files: Dict[str, str] = field(default_factory=dict)  # files of volume results, by key

    def document(self, scene: bpy.types.Scene, frames: Optional[Mapping[str, Any]]) -> Graph:
        """Returns the graph for the library: for a range of frames, or for the scene's current frame. Raises TreeError
        if it is invalid."""
        graph: Graph = {"curlew": 1, "nodes": list(self.graph.values())}
        if frames:
            graph["frames"] = frames
        else:
            graph["nodes"] = [_in_pose(node) for node in graph["nodes"]]
            if any(_changes(node) for node in graph["nodes"]):
                fps = _fps(scene)
                graph["moment"] = {"frame": scene.frame_current, "fps": fps,
                                   "time": (scene.frame_current - scene.frame_start) / fps}
        for key, (kind, link) in self.wanted.items():
            if link is None:
                raise TreeError(key, f"nothing is connected: it needs {kind}")
            graph.setdefault("wanted", []).append(link)
        if self.resume:
            graph["resume"] = True
        return graph


def _texts(node: Mapping[str, Any]) -> Iterator[str]:
    """Yields all texts that may contain expressions."""
    yield from node["words"]
    yield from node["options"].values()
    yield from library.actions()[node["action"]].implied(node["options"]).values()


def _changes(node: Mapping[str, Any]) -> bool:
    """Returns whether a node may have another result in another frame."""
    return library.actions()[node["action"]].varies or any(varies(text) for text in _texts(node))


def _in_pose(node: Dict[str, Any]) -> Dict[str, Any]:
    """Returns a node for a still. One that reads a model with an animation does so at the time of the moment, as it does by
    itself in a sequence."""
    if node["action"] != "read" or "time" in node["options"] or not any(_MODEL.search(word) for word in node["words"]):
        return node
    return {**node, "options": {**node["options"], "time": "{max(T,0)}"}} if library.changes(node) else node


def graph_node(key: str, action: str, words: Sequence[str], options: Mapping[str, str],
               inputs: Mapping[str, Sequence[str]]) -> Dict[str, Any]:
    """Returns a node in the library's format; links are "KEY" or "KEY.OUTPUT"."""
    return {"name": key, "action": action, "words": words, "options": dict(options), "inputs": inputs}


def collect(tree: bpy.types.NodeTree, namer: Optional[FileNamer] = None,
            roots: Optional[Sequence[str]] = None) -> Collected:
    """Collects the graph for all results and nodes without outputs, or for the nodes with these keys. `namer` returns
    the files for volumes; without it, volumes are skipped. Raises TreeError if the tree is invalid."""
    former.rename_all()  # trees appended from the file of an earlier release
    nodes.renew_groups()
    return _Collector(tree, namer, roots).collected


@dataclass(frozen=True)
class _Level:
    """A tree, and the groups that contain it."""

    tree: bpy.types.NodeTree
    path: Tuple[bpy.types.Node, ...] = ()

    def key(self, node: bpy.types.Node) -> str:
        return "/".join([n.name for n in self.path] + [node.name])

    def inside(self, group: bpy.types.Node) -> "_Level":
        return _Level(group.node_tree, self.path + (group,))

    def outer(self) -> "_Level":
        return _Level(self.path[-2].node_tree if len(self.path) > 1 else self.path[-1].id_data, self.path[:-1])


def _is_group(node: bpy.types.Node) -> bool:
    return node.bl_idname == nodes.CurlewGroup.bl_idname


def _walk(level: _Level) -> Iterator[Tuple[_Level, bpy.types.Node]]:
    """Yields the effective nodes, including those in groups: no muted nodes, frames, reroutes, or group inputs and
    outputs."""
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
    """Returns the nodes by key. Undo replaces nodes, so look them up again after a bake."""
    found: Dict[str, bpy.types.Node] = {}
    try:
        for level, node in _walk(_Level(tree)):
            found[level.key(node)] = node
    except TreeError:
        pass  # a group contains itself; collect() reports this
    return found


def file_name(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9_-]+", "_", text).strip("_") or "object"


class _Collector:
    def __init__(self, tree: bpy.types.NodeTree, namer: Optional[FileNamer], roots: Optional[Sequence[str]]) -> None:
        self.collected = Collected()
        self._namer = namer
        self._sequence = is_sequence(tree)
        self._levels: Dict[str, _Level] = {}
        ends: List[Tuple[float, str]] = []
        for level, node in _walk(_Level(tree)):
            key = level.key(node)
            self.collected.nodes[key], self._levels[key] = node, level
            if not _is_group(node) and not node.makes:
                order = 1e6 if hasattr(node, "kind") else node.order
                ends.append((order + 1e-6 * node.location.x - 1e-9 * node.location.y, key))
        self._waiting = [key for _, key in sorted(ends)] if roots is None else list(roots)
        self._flags: Dict[str, Set[str]] = {}  # options that linked outputs turn on, by the keys of their nodes
        while self._waiting:
            key = self._waiting.pop(0)
            if key not in self.collected.reached:
                self.collected.reached[key] = self.collected.nodes[key]
                self._node(self._levels[key], key, self.collected.nodes[key])
        for key, flags in self._flags.items():
            self.collected.graph[key]["options"].update(dict.fromkeys(flags, "1"))

    # --- links

    def _source(self, level: _Level, socket: bpy.types.NodeSocket, depth: int = 0) -> Optional[str]:
        """Returns the link to the output that feeds an input socket; None if it is not connected."""
        if depth > 150:
            raise TreeError(level.key(socket.node), "the links form a cycle")
        for link in socket.links:
            if getattr(link, "is_muted", False):
                continue
            return self._output(level, link.from_node, link.from_socket, depth + 1)
        return None

    def _output(self, level: _Level, node: bpy.types.Node, socket: bpy.types.NodeSocket, depth: int) -> Optional[str]:
        if node.bl_idname == "NodeReroute":
            return self._source(level, node.inputs[0], depth)
        if node.bl_idname == "NodeGroupInput":
            if not level.path:
                return None
            return self._source(level.outer(), level.path[-1].inputs[_index(node.outputs, socket)], depth)
        if node.mute:
            return self._through(level, node, socket, depth)
        if _is_group(node):
            return self._of_group(level, node, _index(node.outputs, socket), depth)
        if not hasattr(node, "makes"):
            raise TreeError(level.key(node), "this is not a Curlew node")
        key, index = level.key(node), _index(node.outputs, socket)
        self._waiting.append(key)
        flag = node.makes[index].flag
        if flag and node.given().get(flag, "0") == "0":  # a link turns on what it needs
            self._flags.setdefault(key, set()).add(flag)
        output = node.output_name(index)
        return f"{key}.{output}" if output else key

    def _of_group(self, level: _Level, group: bpy.types.Node, index: int, depth: int) -> Optional[str]:
        return self._source(level.inside(group), self._end(level, group).inputs[index], depth)

    @staticmethod
    def _end(level: _Level, group: bpy.types.Node) -> bpy.types.Node:
        """Returns the Group Output node of a group."""
        if not group.node_tree:
            raise TreeError(level.key(group), "the group has no node tree; choose one")
        ends = sorted((n for n in group.node_tree.nodes if n.bl_idname == "NodeGroupOutput"),
                      key=lambda n: not n.is_active_output)
        if not ends:
            raise TreeError(level.key(group), "the group has no Group Output node")
        return ends[0]

    def _through(self, level: _Level, node: bpy.types.Node, socket: bpy.types.NodeSocket, depth: int) -> Optional[str]:
        """A muted node passes on the first input of the output's type."""
        for given in node.inputs:
            alike = {given.bl_idname, socket.bl_idname} <= {"CurlewFieldSocket", "CurlewShapeSocket"}
            if given.bl_idname == socket.bl_idname or alike:
                return self._source(level, given, depth)
        raise TreeError(level.key(node), f"this node is muted and has no input to pass on as '{socket.name}'")

    def _inputs(self, level: _Level, node: bpy.types.Node) -> Dict[str, List[str]]:
        inputs: Dict[str, List[str]] = {}
        for declared, socket in zip(node.takes, node.inputs):
            link = self._source(level, socket)
            if link:
                inputs.setdefault(declared.name, []).append(link)
        return inputs

    # --- values

    def _value(self, level: _Level, socket: bpy.types.NodeSocket, depth: int = 0) -> Any:
        """Returns the value of an input socket: the text of numbers, an object or collection, or an Arrow. Its own value if
        it is not connected; None if it has none."""
        if depth > 150:
            raise TreeError(level.key(socket.node), "the links form a cycle")
        for link in socket.links:
            if not getattr(link, "is_muted", False):
                return self._given_by(level, link, depth + 1)
        value = getattr(socket, "default_value", None)
        if isinstance(value, (bool, int, float)):
            return number_text(value)
        return value if value is None or isinstance(value, bpy.types.ID) else ",".join(number_text(v) for v in value)

    def _given_by(self, level: _Level, link: bpy.types.NodeLink, depth: int) -> Any:
        node, socket = link.from_node, link.from_socket
        if node.bl_idname == "NodeReroute":
            return self._value(level, node.inputs[0], depth)
        if node.bl_idname == "NodeGroupInput":
            if not level.path:
                return None
            self.collected.values[level.outer().key(level.path[-1])] = level.path[-1]
            return self._value(level.outer(), level.path[-1].inputs[_index(node.outputs, socket)], depth)
        if _is_group(node):
            inside = level.inside(node)
            return self._value(inside, self._end(level, node).inputs[_index(node.outputs, socket)], depth)
        if not hasattr(node, "give"):
            raise TreeError(level.key(link.to_node), f"'{link.to_socket.name}' needs a value, not the output of '{node.name}'")
        self.collected.values[level.key(node)] = node
        return None if node.mute else node.give(_index(node.outputs, socket), lambda other: self._value(level, other, depth))

    def _chosen(self, level: _Level, node: bpy.types.Node, name: str) -> Any:
        """Returns the object or collection of a property, or of the socket that replaces it."""
        socket = node.value_sockets().get(name)
        found = self._value(level, socket) if socket else getattr(node, name)
        if found is not None and not isinstance(found, bpy.types.ID):
            raise TreeError(level.key(node), f"'{socket.name}' needs an object, not a number")
        return found

    def _options(self, level: _Level, key: str, node: bpy.types.Node) -> Dict[str, str]:
        """Returns the options of a node in the current frame."""
        options = node.given()
        for name, socket in node.value_sockets().items():
            if not name.startswith("o_") or not socket.is_linked:
                continue
            option, value = node.action.option(name[2:]), self._value(level, socket)
            if isinstance(value, Arrow):
                self.collected.places[key, option.name] = Place(value.object, node.action, option.name, value.is_length)
            elif isinstance(value, bpy.types.ID):
                raise TreeError(key, f"'{option.label}' needs a number, not an object")
            if isinstance(value, str):
                options[option.name] = fitting_text(option, value)
            else:
                options.pop(option.name, None)
        return options

    # --- nodes

    def _node(self, level: _Level, key: str, node: bpy.types.Node) -> None:
        if node.bl_idname == nodes.CurlewMeshObject.bl_idname:
            self._mesh_object(level, key, node)
        elif node.bl_idname == nodes.CurlewCurveObject.bl_idname:
            self._curve_object(level, key, node)
        elif node.bl_idname == nodes.CurlewVolumeObject.bl_idname:
            self._volume_object(key, node)
        elif hasattr(node, "kind"):
            self._result(key, node, self._inputs(level, node))
        elif node.action.name == "frames":
            self.collected.frames = {"words": self._words(key, node), "options": node.given()}
        elif node.action.name == "resume":
            self.collected.resume = True
        else:
            self.collected.given[key] = lambda: self._options(level, key, node)
            made = graph_node(key, node.action.name, self._words(key, node), self._options(level, key, node), self._inputs(level, node))
            self.collected.graph[key] = made
            if node.when != "auto":
                made["when"] = node.when
            place = self._chosen(level, node, "place") if node.places() else None
            if place:
                self.collected.places[key, ""] = Place(place, node.action)

    def _words(self, key: str, node: bpy.types.Node) -> List[str]:
        try:
            words = split_words(node.words)
        except ValueError as error:
            raise TreeError(key, str(error)) from None
        return [plain(bpy.path.abspath("//")) + word[2:] if word.startswith("//") else word for word in words]

    def _mesh_object(self, level: _Level, key: str, node: bpy.types.Node) -> None:
        obj, collection = (self._chosen(level, node, name) for name in ("object", "collection"))
        objects = tuple(dict.fromkeys([*([obj] if obj else []), *members(collection)]))
        if not objects:
            raise TreeError(key, f"'{collection.name}' has no meshes" if collection else "choose a mesh object or a collection")
        self._read(MeshSource, objects, key, node)

    def _curve_object(self, level: _Level, key: str, node: bpy.types.Node) -> None:
        obj = self._chosen(level, node, "object")
        if obj is None or not has_edges(obj):
            raise TreeError(key, "choose a curve, or a mesh of edges")
        self._read(CurveSource, (obj,), key, node)

    def _read(self, kind: Type[MeshSource], objects: Tuple[bpy.types.Object, ...], key: str, node: bpy.types.Node) -> None:
        """Adds a node that reads objects."""
        animated = node.motion == "ON" or (node.motion == "AUTO" and self._sequence and any(map(may_change, objects)))
        same = next((name for name, source in self.collected.meshes.items()
                     if type(source) is kind and source.objects == objects and source.animated == animated), None)
        name = same or self._unused(file_name(objects[0].name), animated)
        self.collected.meshes[name] = kind(objects, animated, key, node.motion == "AUTO")
        self.collected.graph[key] = graph_node(key, "read", [name], {}, {})

    def _unused(self, name: str, animated: bool) -> str:
        ending = ".$F4.ply" if animated else ".ply"
        k, result = 1, name + ending
        while result in self.collected.meshes:
            k += 1
            result = f"{name}_{k}{ending}"
        return result

    def _volume_object(self, key: str, node: bpy.types.Node) -> None:
        if node.object is None or node.object.type != "VOLUME":
            raise TreeError(key, "choose a volume object")
        volume = node.object.data
        if node.object.modifiers or not volume.filepath:
            self.collected.graph[key] = graph_node(key, "read", [self._evaluated(key, node.object)], self._grids(node), {})
            return
        file = plain(bpy.path.abspath(volume.filepath))
        if volume.is_sequence:
            file = re.sub(r"(\d+)(?=\.vdb$)", lambda m: f"$F{len(m[1])}", file)
        if not cache.load_grids(volume):
            raise TreeError(key, f"'{file}': {volume.grids.error_message}")
        self.collected.graph[key] = graph_node(key, "read", [file], self._grids(node), {})

    @staticmethod
    def _grids(node: bpy.types.Node) -> Dict[str, str]:
        return {"grids": node.grids} if node.grids else {}

    @staticmethod
    def _evaluated(key: str, obj: bpy.types.Object) -> str:
        """Writes the grids that modifiers such as Mesh to Volume make in the current frame. Returns the file."""
        volume = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        volume.grids.load()
        file = cache.temporary() / "sources" / f"{file_name(obj.name)}.vdb"
        file.parent.mkdir(parents=True, exist_ok=True)
        if not len(volume.grids) or not volume.grids.save(filepath=str(file)):
            raise TreeError(key, f"'{obj.name}' has no grids")
        return plain(str(file))

    def _result(self, key: str, node: bpy.types.Node, inputs: Dict[str, List[str]]) -> None:
        if node.kind == "grid":
            if self._namer:
                file = self._namer(key, file_name(node.label or node.name))
                self.collected.files[key] = file
                self.collected.graph[key] = graph_node(key, "write", [file], {}, inputs)
        else:
            self.collected.wanted[key] = (node.kind, inputs.get("what", [None])[0])


def _index(sockets: Sequence[bpy.types.NodeSocket], socket: bpy.types.NodeSocket) -> int:
    return next(k for k, other in enumerate(sockets) if other == socket)


def staggered(collected: Collected) -> None:
    """Raises TreeError if a volume result would show staggered velocities, which Blender would interpret as
    cell-centred."""
    for key in collected.files:
        for name in collected.graph[key]["inputs"].get("what", ()):
            if collected.graph.get(name, {"options": {}})["options"].get("staggered") == "1":
                raise TreeError(name, "Blender ignores staggering and would show this half a voxel off: use staggered=0 "
                                      "for a volume result, or write the grid with a Write node")


def is_sequence(tree: bpy.types.NodeTree) -> bool:
    """Returns whether the tree is baked as a sequence of frames."""
    return tree.sequence or any(n.bl_idname == nodes.action_id("frames") and not n.mute for n in tree.nodes)


def _fps(scene: bpy.types.Scene) -> float:
    return scene.render.fps / scene.render.fps_base


def frames_of(tree: bpy.types.NodeTree, scene: bpy.types.Scene, collected: Collected) -> Optional[Dict[str, Any]]:
    """Returns the frames of a sequence: the scene's, unless a Frames node overrides them. Returns None if the tree is
    not a sequence."""
    said = collected.frames or {"words": [], "options": {}}
    if not tree.sequence and not collected.frames:
        return None
    options = {"fps": f"{_fps(scene):.9g}"}
    if tree.substeps != 1:
        options["substeps"] = str(tree.substeps)
    shift = shift_of(tree, scene, collected)
    words = said["words"] or [f"{scene.frame_start - tree.run_up + shift}-{scene.frame_end + shift}"]
    return {"words": words, "options": {**options, **said["options"]}}


def shift_of(tree: bpy.types.NodeTree, scene: bpy.types.Scene, collected: Collected) -> int:
    """Returns the difference between a frame's number in the library, which counts from 0, and in the scene."""
    return 0 if collected.frames and collected.frames["words"] else max(0, tree.run_up - scene.frame_start)


def clear_errors(tree: bpy.types.NodeTree) -> None:
    """Clears the errors of all nodes."""
    tree.message = ""
    for each in [tree] + [n.node_tree for n in tree.nodes if _is_group(n) and n.node_tree]:
        for node in each.nodes:
            if getattr(node, "error", ""):
                node.show_error("")


def show_error(tree: bpy.types.NodeTree, error: TreeError) -> None:
    """Shows an error on its node, on the groups that contain it, and on the tree."""
    clear_errors(tree)
    tree.message = str(error)
    found = nodes_of(tree)
    parts = error.key.split("/")
    for k in range(len(parts)):
        name = "/".join(parts[: k + 1])
        node = found.get(name) or (tree.nodes.get(name) if k == 0 else None)
        if node is not None and hasattr(node, "show_error"):
            node.show_error(str(error))
