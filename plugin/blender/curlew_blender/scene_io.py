"""Scenes as trees, and trees as scenes."""

from pathlib import Path
from typing import Callable, Dict, Mapping, Optional, Sequence, Set

import bpy
from bpy_extras.io_utils import ExportHelper, ImportHelper

from . import library, nodes
from . import tree as trees
from .actions import quoted
from .bake import active_tree
from .job import in_frames
from .layout import placed
from .program import GraphNode, TreeError
from .scene import SceneError, graph_of
from .sources import write_ply
from .stacks import extension

# What a node becomes instead of that of its action; None: that one.
Replace = Callable[[bpy.types.NodeTree, GraphNode], Optional[bpy.types.Node]]


def tree_of(text: str, name: str, replace: Optional[Replace] = None) -> bpy.types.NodeTree:
    """A new tree that does what a scene says. Throws SceneError."""
    graph = graph_of(text, library.actions())
    tree = bpy.data.node_groups.new(name, nodes.TREE)
    tree.use_fake_user = True
    made: Dict[str, bpy.types.Node] = {}
    try:
        for entry in graph:
            made[entry.key] = (replace and replace(tree, entry)) or _node(tree, entry)
    except (TypeError, ValueError) as error:
        bpy.data.node_groups.remove(tree)
        raise SceneError(str(error)) from None
    for entry in graph:
        _link(tree, made, entry)
    _lay_out(graph, made)
    tree.sequence = any(entry.action == "frames" for entry in graph)
    return tree


def _node(tree: bpy.types.NodeTree, entry: GraphNode) -> bpy.types.Node:
    node = tree.nodes.new(nodes.action_id(entry.action))
    node.words = " ".join(quoted(word) for word in entry.words)
    node.when = entry.when or "auto"
    node.order = int(entry.order) if not node.makes else 0
    for option, text in entry.options.items():
        node.set_option(option, text)
    return node


def _link(tree: bpy.types.NodeTree, made: Mapping[str, bpy.types.Node], entry: GraphNode) -> None:
    for k, ref in enumerate(entry.inputs):
        if ref and k < len(made[entry.key].inputs):
            source = made[ref.key]
            tree.links.new(source.outputs[min(ref.output, len(source.outputs) - 1)], made[entry.key].inputs[k])


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


def _lay_out(graph: Sequence[GraphNode], made: Mapping[str, bpy.types.Node]) -> None:
    feeds = {entry.key: list(dict.fromkeys(ref.key for ref in entry.inputs if ref)) for entry in graph}
    for key, place in placed(feeds, {key: _height(node) for key, node in made.items()}).items():
        made[key].location = place


def export(tree: bpy.types.NodeTree, path: Path, scene: bpy.types.Scene) -> None:
    """Writes the scene of a tree, with its meshes beside it, so that `curlew -config` run in that folder makes the same
    files; results are written beside it too. Throws TreeError, OSError."""
    trees.clear_errors(tree)
    try:
        stem = path.stem
        sequence = bool(trees.frames_words(tree, scene, trees.collect(tree)))
        frame = ".$F4" if sequence else ""
        collected = trees.collect(tree, lambda key, name: f"{stem}_{name}{frame}.vdb")
        for want in collected.wanted:
            ending = {"points": ".ply", "curves": ".obj", "mesh": ".ply"}[want.kind]
            label = collected.nodes[want.key].label or collected.nodes[want.key].bl_label.split(" ")[0]
            file = f"{stem}_{label.lower()}{frame}{ending}"
            collected.graph[want.key] = GraphNode(want.key, "write", [file], {}, [want.ref], order=2e6)
        collected.wanted.clear()
        words = trees.frames_words(tree, scene, collected)
        sampled, _ = in_frames(collected, scene, words)
        for node in collected.graph.values():
            if node.reads == [(0, "mesh")]:
                node.words = [f"{stem}_{node.words[0]}"]
        program = collected.program(words)
    except TreeError as error:
        trees.show_error(tree, error)
        raise
    for name, mesh in sampled.meshes.items():
        write_ply(path.parent / f"{stem}_{name}", mesh)
    path.write_text(f"# {tree.name}\n# Run it in its folder: curlew -config {quoted(path.name)}\n\n" + program.text)


class CURLEW_OT_export_scene(bpy.types.Operator, ExportHelper):
    """Write the tree as a scene that `curlew -config` runs, with its meshes beside it"""

    bl_idname = "curlew.export_scene"
    bl_label = "Export Curlew Scene"
    filename_ext = ".txt"
    __annotations__ = {"filter_glob": bpy.props.StringProperty(default="*.txt", options={"HIDDEN"})}

    def execute(self, context: bpy.types.Context) -> Set[str]:
        """Of the tree at hand."""
        tree = active_tree(context)
        try:
            if tree is None:
                raise TreeError("", "there is no Curlew tree to export")
            export(tree, Path(self.filepath), context.scene)
        except (TreeError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class CURLEW_OT_import_scene(bpy.types.Operator, ImportHelper):
    """Read a scene of Curlew as a new tree"""

    bl_idname = "curlew.import_scene"
    bl_label = "Import Curlew Scene"
    bl_options = {"REGISTER", "UNDO"}
    filename_ext = ".txt"
    __annotations__ = {"filter_glob": bpy.props.StringProperty(default="*.txt", options={"HIDDEN"})}

    def execute(self, context: bpy.types.Context) -> Set[str]:
        """Shows it in the node editor that it is called from."""
        try:
            path = Path(self.filepath)
            tree = tree_of(path.read_text(), path.stem)
        except (SceneError, OSError, UnicodeDecodeError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        context.scene.curlew_tree = tree.name
        if context.space_data and context.space_data.type == "NODE_EDITOR":
            context.space_data.node_tree = tree
        return {"FINISHED"}


def as_results(tree: bpy.types.NodeTree, entry: GraphNode) -> Optional[bpy.types.Node]:
    """Result nodes instead of files."""
    if entry.action != "write" or len(entry.words) != 1:
        return None
    kind = {".vdb": "grid", ".ply": "points", ".obj": "curves", ".stl": "mesh"}.get(extension(entry.words[0]))
    result = next((cls for cls in nodes.RESULTS if cls.kind == kind), None)
    return tree.nodes.new(result.bl_idname) if result else None


CLASSES = (CURLEW_OT_export_scene, CURLEW_OT_import_scene)


def register() -> None:
    """The operators."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Takes them back."""
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
