# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts scenes to trees and back. The library translates between texts and graphs."""

import json
import shlex
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Set, Tuple

import bpy
from bpy_extras.io_utils import ExportHelper, ImportHelper

from . import library, nodes, writing
from . import tree as trees
from .actions import NO_NODE, Socket, TreeError
from .bake import active_tree
from .job import finished, planned
from .layout import placed
from .texts import plain
from .tree import Graph, graph_node

Entry = Dict[str, Any]  # a node of a graph
# Returns a replacement for the node of an action; None: no replacement.
Replace = Callable[[bpy.types.NodeTree, Entry], Optional[bpy.types.Node]]
_GRIDS = frozenset({"grid", "velocity", "levelSet"})


def tree_of(text: str, name: str, replace: Optional[Replace] = None) -> bpy.types.NodeTree:
    """Creates a tree from a scene or a JSON graph. Raises TreeError if the text is invalid."""
    with library.said_of_nodes():
        graph = json.loads(library.curlew().translate(text, "json", name))
    entries, links = _entries(graph), _links(graph)
    tree = bpy.data.node_groups.new(name, nodes.TREE)
    tree.use_fake_user = True
    made: Dict[str, bpy.types.Node] = {}
    with writing.imported():
        for number, entry in enumerate(entries):
            made[entry["name"]] = (replace and replace(tree, entry)) or _node(tree, entry, number)
    feeds: Dict[str, List[str]] = {key: [] for key in made}
    for entry in entries:
        for name, link in ((name, links(text)) for name, texts in entry.get("inputs", {}).items() for text in texts):
            if link:
                _link(tree, made[link[0]], link[1], made[entry["name"]], name)
                feeds[entry["name"]].append(link[0])
    for key, place in placed(feeds, {key: _height(node) for key, node in made.items()}).items():
        made[key].location = place
    tree.sequence = "frames" in graph
    return tree


def _entries(graph: Graph) -> List[Entry]:
    """Returns the nodes of a graph that become nodes of a tree. A node that reads several files with one object each
    becomes one node per file."""
    entries: List[Entry] = []
    for entry in graph["nodes"]:
        words = entry.get("words", [])
        if entry["action"] == "read" and not any(word.lower().endswith(".vdb") for word in words) and len(words) > 1:
            entries += [{**entry, "name": f"{entry['name']}.{k}", "words": [word]} for k, word in enumerate(words)]
        elif entry["action"] not in NO_NODE:
            entries.append(entry)
    if "frames" in graph:
        entries.append({"name": "frames", "action": "frames", **graph["frames"]})
    if graph.get("resume"):
        entries.append({"name": "resume", "action": "resume"})
    return entries


def _links(graph: Graph) -> Callable[[str], Optional[Tuple[str, str]]]:
    """Returns a function that maps the text of a link to the name of a node and the rest of the link. Points that are
    carried from frame to frame map to those before the frames, since nodes of a tree carry them by themselves."""
    keys = {entry["name"] for entry in _entries(graph)}
    last = {entry["name"]: f"{entry['name']}.{len(entry.get('words', [])) - 1}" for entry in graph["nodes"]}
    before = {state["name"]: state.get("initial") for state in graph.get("states", ())}

    def resolve(text: str) -> Optional[Tuple[str, str]]:
        if text in before:
            return resolve(before[text]) if before[text] else None
        if text in keys:
            return text, ""
        key, _, output = text.rpartition(".")
        return (key, output) if key in keys else (last[text], "")

    return resolve


def _node(tree: bpy.types.NodeTree, entry: Entry, number: int) -> bpy.types.Node:
    node = tree.nodes.new(nodes.action_id(entry["action"]))
    node.words = shlex.join(entry.get("words", []))
    node.when = entry.get("when", "auto")
    node.order = 0 if node.makes else number
    for option, text in entry.get("options", {}).items():
        node.set_option(option, text)
    return node


def _link(tree: bpy.types.NodeTree, source: bpy.types.Node, output: str, target: bpy.types.Node, name: str) -> None:
    """Links an output to the next free socket of an input."""
    for declared, socket in zip(target.takes, target.inputs):
        if declared.name == name and not socket.is_linked:
            tree.links.new(source.outputs[_output(source, output, declared)], socket)
            return


def _output(source: bpy.types.Node, output: str, wanted: Socket) -> int:
    fitting = [k for k, made in enumerate(source.makes) if made.kinds & wanted.kinds or (
        "grid" in made.kinds and wanted.kinds & _GRIDS)] or [0]
    if getattr(source, "action", None) and source.action.name == "read":
        names = [name for name in source.given().get("grids", "").split(",") if name]
        if output and not output.isdigit() and output not in names:
            names.append(output)
            source.set_option("grids", ",".join(names))
        number = names.index(output) if output in names else int(output or 0)
        return fitting[min(number, len(fitting) - 1)]
    return next((k for k, made in enumerate(source.makes) if made.name == output or (made.primary and not output)), 0)


def _height(node: bpy.types.Node) -> float:
    rows = len(node.inputs) + len(node.outputs)
    if isinstance(node, nodes.ActionNode):
        options = [o for k, o in enumerate(node.action.options) if k < 5 or node.is_property_set("o_" + o.name)]
        rows += sum({"vector": 4, "interval": 3, "box": 7}.get(o.type, 1) if node.is_property_set("o_" + o.name) else 1
                    for o in options) + 1
        rows += bool(node.action.most_words) + node.places()
    else:
        rows += 2
    return 40 + 22 * rows


def export(tree: bpy.types.NodeTree, path: Path, scene: bpy.types.Scene) -> None:
    """Writes a tree as a scene with its meshes in the same folder, so that `curlew -config` in that folder makes the
    same files. Results are also written there. Raises TreeError or OSError on failure."""
    trees.clear_errors(tree)
    stem, frame = plain(path.stem), ".$F4" if trees.is_sequence(tree) else ""
    names: Dict[str, str] = {}  # of the results, by key; all differ, also from the names of meshes

    meshes: Sequence[str] = ()

    def named(key: str, wanted: str) -> str:
        if key not in names:
            taken = {*names.values(), *(Path(mesh).stem for mesh in meshes)}
            numbered = [wanted] + [f"{wanted}_{k}" for k in range(2, len(taken) + 3)]
            names[key] = next(name for name in numbered if name not in taken)
        return names[key]

    try:
        collected = trees.collect(tree, lambda key, name: f"{stem}_{named(key, name)}{frame}.vdb")
        plan = finished(planned(tree, scene, collected))
        graph = plan.graph
        for node in graph["nodes"]:
            if node["action"] == "read" and node["words"][0] in collected.meshes:
                node["words"] = [f"{stem}_{node['words'][0]}"]
        meshes = list(collected.meshes)
        for key, (kind, link) in collected.wanted.items():
            ending = {"points": ".ply", "curves": ".obj", "mesh": ".ply"}[kind]
            label = collected.nodes[key].label or collected.nodes[key].bl_label.split(" ")[0]
            file = f"{stem}_{named(key, trees.file_name(label).lower())}{frame}{ending}"
            graph["nodes"].append(graph_node(key, "write", [file], {}, {"what": [link]}))
        graph.pop("wanted", None)
        with library.said_of_nodes():
            text = library.curlew().translate(graph, "scene")
    except TreeError as error:
        trees.show_error(tree, error)
        raise
    files = [plain(str(path.parent / f"{path.stem}_{name}")) for name in plan.meshes]
    copies = [[graph_node(name, "read", [name], {}, {}), graph_node(file, "write", [file], {}, {"what": [name]})]
              for name, file in zip(plan.meshes, files)]
    with library.said_of_nodes(), library.Sessions().of("", plan.meshes) as session:
        session.run_graph({"nodes": sum(copies, [])})
    path.write_text(f"# {tree.name}\n# Run it in its folder: curlew -config {shlex.quote(plain(path.name))}\n\n{text}")


class CURLEW_OT_export_scene(bpy.types.Operator, ExportHelper):
    """Write the tree as a scene file that `curlew -config` can run, with its meshes beside it"""

    bl_idname = "curlew.export_scene"
    bl_label = "Export Curlew Scene"
    filename_ext = ".txt"
    __annotations__ = {"filter_glob": bpy.props.StringProperty(default="*.txt", options={"HIDDEN"})}

    def execute(self, context: bpy.types.Context) -> Set[str]:
        """Exports the active tree."""
        tree = active_tree(context)
        try:
            if tree is None:
                raise TreeError("", "no Curlew tree to export: choose one, or open one in the node editor")
            export(tree, Path(self.filepath), context.scene)
        except (TreeError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class CURLEW_OT_import_scene(bpy.types.Operator, ImportHelper):
    """Read a Curlew scene file as a new node tree"""

    bl_idname = "curlew.import_scene"
    bl_label = "Import Curlew Scene"
    bl_options = {"REGISTER", "UNDO"}
    filename_ext = ".txt"
    __annotations__ = {"filter_glob": bpy.props.StringProperty(default="*.txt", options={"HIDDEN"})}

    def execute(self, context: bpy.types.Context) -> Set[str]:
        """Shows the imported tree in the node editor that called the operator."""
        try:
            path = Path(self.filepath)
            tree = tree_of(path.read_text(), path.stem)
        except (TreeError, OSError, UnicodeDecodeError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        context.scene.curlew_tree = tree.name
        if context.space_data and context.space_data.type == "NODE_EDITOR":
            context.space_data.node_tree = tree
        return {"FINISHED"}


def as_results(tree: bpy.types.NodeTree, entry: Entry) -> Optional[bpy.types.Node]:
    """Returns a result node in place of a node that writes a file."""
    if entry["action"] != "write" or len(entry["words"]) != 1:
        return None
    kind = {".vdb": "grid", ".ply": "points", ".obj": "curves", ".stl": "mesh"}.get(Path(entry["words"][0]).suffix)
    result = next((cls for cls in nodes.RESULTS if cls.kind == kind), None)
    return tree.nodes.new(result.bl_idname) if result else None


CLASSES = (CURLEW_OT_export_scene, CURLEW_OT_import_scene)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
