# SPDX-License-Identifier: GPL-3.0-or-later
"""Groups: Ctrl+G makes one of the selected nodes, Tab opens and closes it, as for Blender's own trees."""

from typing import Dict, List, Optional, Sequence, Set, Tuple

import bpy

from . import nodes

_SHARED = ("label", "location", "width", "mute", "use_custom_color", "color", "hide")


def _socket(tree: bpy.types.NodeTree, direction: str, like: bpy.types.NodeSocket) -> None:
    """Adds a socket to the interface of a tree."""
    if hasattr(tree, "interface"):
        tree.interface.new_socket(like.name, in_out=direction, socket_type=like.bl_idname)
    else:
        (tree.inputs if direction == "INPUT" else tree.outputs).new(like.bl_idname, like.name)


def _copy(node: bpy.types.Node, tree: bpy.types.NodeTree) -> bpy.types.Node:
    copy = tree.nodes.new(node.bl_idname)
    if node.bl_idname == nodes.CurlewGroup.bl_idname:
        copy.node_tree = node.node_tree
        copy.renew_sockets()
    elif hasattr(node, "takes"):
        for name in node.value_sockets():
            copy.add_value(name)
    for key in node.keys():
        copy[key] = node[key]
    for mine, socket in zip(copy.inputs, node.inputs):
        if hasattr(socket, "default_value"):
            mine.default_value = socket.default_value
    for name in _SHARED:
        setattr(copy, name, getattr(node, name))
    copy.name = node.name
    return copy


def _index(sockets: Sequence[bpy.types.NodeSocket], socket: bpy.types.NodeSocket) -> int:
    return next(k for k, other in enumerate(sockets) if other == socket)


def is_keyed(tree: bpy.types.NodeTree, node: bpy.types.Node) -> bool:
    """Returns whether a node has keyframes, which belong to its tree."""
    data = tree.animation_data
    start = node.path_from_id() + "."
    return bool(data and data.action) and any(curve.data_path.startswith(start) for curve in data.action.fcurves)


def group_of(tree: bpy.types.NodeTree, chosen: List[bpy.types.Node]) -> bpy.types.Node:
    """Moves nodes into a new tree, and puts a group node in their place. Links stay."""
    inner = bpy.data.node_groups.new("Group", nodes.TREE)
    names = {node.name for node in chosen}
    copies: Dict[str, bpy.types.Node] = {node.name: _copy(node, inner) for node in chosen}
    start, end = inner.nodes.new("NodeGroupInput"), inner.nodes.new("NodeGroupOutput")
    xs, ys = ([node.location[axis] for node in chosen] for axis in (0, 1))
    middle = sum(ys) / len(ys)
    start.location, end.location = (min(xs) - 260, middle), (max(xs) + 260, middle)
    before: List[bpy.types.NodeSocket] = []  # sockets outside that feed the group, in the order of its inputs
    after: List[Tuple[int, bpy.types.NodeSocket]] = []  # outputs of the group, and the sockets outside that they feed
    made: List[bpy.types.NodeSocket] = []  # sockets inside that feed others outside, in the order of its outputs
    for link in list(tree.links):
        inside = (link.from_node.name in names, link.to_node.name in names)
        if inside == (False, False):
            continue
        if inside[0]:
            source = copies[link.from_node.name].outputs[_index(link.from_node.outputs, link.from_socket)]
        if inside[1]:
            target = copies[link.to_node.name].inputs[_index(link.to_node.inputs, link.to_socket)]
        if inside == (True, True):
            inner.links.new(source, target)
        elif inside[1]:
            if link.from_socket not in before:
                before.append(link.from_socket)
                _socket(inner, "INPUT", link.to_socket)
            inner.links.new(start.outputs[before.index(link.from_socket)], target)
        else:
            if link.from_socket not in made:
                made.append(link.from_socket)
                _socket(inner, "OUTPUT", link.from_socket)
                inner.links.new(source, end.inputs[len(made) - 1])
            after.append((made.index(link.from_socket), link.to_socket))
    group = tree.nodes.new(nodes.CurlewGroup.bl_idname)
    group.node_tree = inner
    group.location = (sum(xs) / len(xs), middle)
    group.renew_sockets()
    for k, socket in enumerate(before):
        tree.links.new(socket, group.inputs[k])
    for k, socket in after:
        tree.links.new(group.outputs[k], socket)
    for node in chosen:
        tree.nodes.remove(node)
    return group


def _space(context: bpy.types.Context) -> Optional[bpy.types.Space]:
    """Returns the node editor if it shows a Curlew tree."""
    space = context.space_data
    shows = space and space.type == "NODE_EDITOR" and space.tree_type == nodes.TREE and space.edit_tree
    return space if shows else None


class CURLEW_OT_group(bpy.types.Operator):
    """Make a group of the selected nodes"""

    bl_idname = "curlew.group"
    bl_label = "Make Group"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Returns whether a Curlew tree is shown."""
        return _space(context) is not None

    def execute(self, context: bpy.types.Context) -> Set[str]:
        """Groups the nodes, and opens the group."""
        space = _space(context)
        tree = space.edit_tree
        chosen = [node for node in tree.nodes if node.select and not node.bl_idname.startswith(("NodeGroup", "NodeFrame"))]
        keyed = next((node.name for node in chosen if is_keyed(tree, node)), "")
        if not chosen or keyed:
            self.report({"ERROR"}, f"'{keyed}' has keyframes, which cannot move into a group" if keyed else "no node is selected")
            return {"CANCELLED"}
        group = group_of(tree, chosen)
        space.path.append(group.node_tree, node=group)
        return {"FINISHED"}


class CURLEW_OT_group_edit(bpy.types.Operator):
    """Open the active group, or go back to the tree that contains it"""

    bl_idname = "curlew.group_edit"
    bl_label = "Open or Close Group"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Returns whether a Curlew tree is shown."""
        return _space(context) is not None

    def execute(self, context: bpy.types.Context) -> Set[str]:
        """Opens or closes the group."""
        space = _space(context)
        node = space.edit_tree.nodes.active
        if node and node.select and node.bl_idname == nodes.CurlewGroup.bl_idname and node.node_tree:
            space.path.append(node.node_tree, node=node)
        elif len(space.path) > 1:
            space.path.pop()
        return {"FINISHED"}


_KEYS = ((CURLEW_OT_group, "G", True), (CURLEW_OT_group_edit, "TAB", False))
_keymap: List[Tuple[bpy.types.KeyMap, bpy.types.KeyMapItem]] = []
_register, _unregister = bpy.utils.register_classes_factory((CURLEW_OT_group, CURLEW_OT_group_edit))


def register() -> None:
    """Registers the operators and their keys."""
    _register()
    keys = bpy.context.window_manager.keyconfigs.addon if bpy.context.window_manager else None
    if keys:  # not without a user interface
        keymap = keys.keymaps.new("Node Editor", space_type="NODE_EDITOR")
        for operator, key, ctrl in _KEYS:
            _keymap.append((keymap, keymap.keymap_items.new(operator.bl_idname, key, "PRESS", ctrl=ctrl)))


def unregister() -> None:
    """Unregisters them."""
    for keymap, item in _keymap:
        keymap.keymap_items.remove(item)
    _keymap.clear()
    _unregister()
