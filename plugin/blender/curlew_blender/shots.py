# SPDX-License-Identifier: GPL-3.0-or-later
"""The parts of a shot as ready groups: emitter, collider, wind, turbulence. They are made of the other nodes, so they can be
opened and changed, and scenes contain what is in them."""

import math
from dataclasses import dataclass
from typing import Any, Callable, Dict, List, Optional, Set, Tuple

import bpy
import numpy as np
from mathutils import Vector

from . import nodes
from .layout import placed

_KEY = "curlew_shot"  # custom property of a group's tree: the part that it is


class _Builder:
    """Builds the tree of a group."""

    def __init__(self, name: str, is_group: bool = True) -> None:
        self.tree = bpy.data.node_groups.new(name, nodes.TREE)
        if is_group:
            self._start, self._end = self.tree.nodes.new("NodeGroupInput"), self.tree.nodes.new("NodeGroupOutput")

    def add(self, kind: str, *inputs: Optional[bpy.types.Node], **options: str) -> bpy.types.Node:
        """Adds a node of an action, or of a bl_idname, and links its first inputs to these nodes; None: stays free."""
        node = self.tree.nodes.new(kind if kind.startswith("Curlew") else nodes.action_id(kind))
        for name, text in options.items():
            node.set_option(name, text)
        for source, socket in zip(inputs, node.inputs):
            if source:
                self.tree.links.new(source.outputs[0], socket)
        return node

    def input(self, name: str, *sockets: bpy.types.NodeSocket, at_least: Optional[float] = None) -> None:
        """Adds an input of the group that feeds these sockets. Its default is the value of the first."""
        like = sockets[0]
        if hasattr(self.tree, "interface"):
            made = self.tree.interface.new_socket(name, in_out="INPUT", socket_type=like.bl_idname)
        else:
            made = self.tree.inputs.new(like.bl_idname, name)
        if hasattr(like, "default_value"):
            made.default_value = like.default_value
        if at_least is not None:
            made.min_value = at_least
        for socket in sockets:
            self.tree.links.new(next(s for s in self._start.outputs if s.name == name), socket)

    def output(self, name: str, node: bpy.types.Node) -> bpy.types.NodeTree:
        """Adds the output of the group. Returns the tree."""
        socket = node.outputs[0]
        if hasattr(self.tree, "interface"):
            self.tree.interface.new_socket(name, in_out="OUTPUT", socket_type=socket.bl_idname)
        else:
            self.tree.outputs.new(socket.bl_idname, name)
        self.tree.links.new(socket, self._end.inputs[0])
        self.lay_out()
        return self.tree

    def lay_out(self) -> None:
        """Places the nodes in columns."""
        feeds: Dict[str, List[str]] = {n.name: [] for n in self.tree.nodes}
        for link in self.tree.links:
            feeds[link.to_node.name].append(link.from_node.name)
        for key, place in placed(feeds, {n.name: 260.0 for n in self.tree.nodes}).items():
            self.tree.nodes[key].location = place


def _level_set(build: _Builder, resolution: int) -> bpy.types.Node:
    """Adds an object or collection as a level set."""
    mesh = build.add("CurlewMeshObject")
    for name in ("Object", "Collection"):
        build.input(name, mesh.add_value(name.lower()))
    level = build.add("mesh2ls", mesh, dim=str(resolution))
    build.input("Resolution", level.add_value("o_dim"), at_least=8)
    return level


def _collider(build: _Builder) -> bpy.types.NodeTree:
    return build.output("Level Set", _level_set(build, 80))


def _emitter(build: _Builder, on: str) -> bpy.types.NodeTree:
    emit = build.add("emit", _level_set(build, 80), on=on, rate="5000", life="2", spread="0.4")
    if on == "surface":
        emit.set_option("offset", "1%")  # nearer to the wall the flow is slow
    for name, option in (("Points per Second", "rate"), ("Lifetime", "life"), ("Lifetime Randomness", "spread")):
        build.input(name, emit.add_value("o_" + option), at_least=0)
    build.input("Random Seed", emit.add_value("o_seed"))
    build.input("Flow", emit.inputs["Flow"])
    build.input("Density", emit.inputs["Density"])
    return build.output("Points", emit)


def _wind(build: _Builder) -> bpy.types.NodeTree:
    arrow = build.add("CurlewArrow")
    wind = build.add("wind", layer="9%", padding="100%")
    build.input("Collider", wind.inputs["Wall"])
    build.input("Arrow", arrow.inputs[0])
    for name, output in (("direction", 0), ("speed", 1)):
        build.tree.links.new(arrow.outputs[output], wind.add_value("o_" + name))
    return build.output("Flow", wind)


def _turbulence(build: _Builder) -> bpy.types.NodeTree:
    f, free = (build.add("noise", octaves="2", gain="0.6", seed=seed, frequency="1") for seed in ("1", "2"))
    free.set_option("alpha", "{0.6*T}")
    bound = build.add("bound", free, side="outside", layer="4%")
    flow = build.add("dfvn", f, bound, speed="0.5", padding="100%")
    build.input("Collider", bound.inputs["Wall"])
    build.input("Speed", flow.add_value("o_speed"), at_least=0)
    build.input("Frequency", *(noise.add_value("o_frequency") for noise in (f, free)), at_least=0)
    return build.output("Flow", flow)


@dataclass(frozen=True)
class Shot:
    """A part of a shot."""

    name: str
    help: str
    build: Callable[[_Builder], bpy.types.NodeTree]


SHOTS: Dict[str, Shot] = {
    "SURFACE_EMITTER": Shot("Surface Emitter", "Particles that are born on an object or collection, with a lifetime",
                            lambda build: _emitter(build, "surface")),
    "INSIDE_EMITTER": Shot("Inside Emitter", "Particles that are born inside an object or collection, with a lifetime",
                           lambda build: _emitter(build, "volume")),
    "COLLIDER": Shot("Collider", "An object, or all meshes of a collection as one, as an obstacle", _collider),
    "WIND": Shot("Wind", "Wind around a collider, along an arrow object; a longer arrow gives a faster wind", _wind),
    "TURBULENCE": Shot("Turbulence", "Swirls around a collider, with a speed and a frequency", _turbulence),
}


def tree_of(kind: str) -> bpy.types.NodeTree:
    """Returns the tree of a part: that of the file if there is one, so that all its groups share it."""
    found = next((tree for tree in bpy.data.node_groups if tree.bl_idname == nodes.TREE and tree.get(_KEY) == kind), None)
    if found:
        return found
    tree = SHOTS[kind].build(_Builder(SHOTS[kind].name))
    tree[_KEY] = kind
    return tree


def add(tree: bpy.types.NodeTree, kind: str, **values: Any) -> bpy.types.Node:
    """Adds a part to a tree. Its inputs get these values, or are linked if they are nodes."""
    group = tree.nodes.new(nodes.CurlewGroup.bl_idname)
    group.node_tree = tree_of(kind)
    group.renew_sockets()
    group.label = SHOTS[kind].name
    for name, value in values.items():
        socket = group.inputs[name.replace("_", " ")]
        if isinstance(value, bpy.types.Node):
            tree.links.new(value.outputs[0], socket)
        else:
            socket.default_value = value
    return group


def _arrow(name: str, obj: bpy.types.Object, size: float, scene: bpy.types.Scene) -> bpy.types.Object:
    """Adds an arrow along x beside an object."""
    arrow = bpy.data.objects.new(name, None)
    arrow.empty_display_type, arrow.scale = "SINGLE_ARROW", (size,) * 3
    arrow.rotation_euler.y = math.pi / 2
    box = np.array([obj.matrix_world @ Vector(corner) for corner in obj.bound_box])
    arrow.location = (box[:, 0].min() - 1.5 * size, *box[:, 1:].mean(axis=0))
    scene.collection.objects.link(arrow)
    return arrow


def example(name: str, obj: bpy.types.Object, size: float, scene: bpy.types.Scene) -> Tuple[bpy.types.NodeTree, bpy.types.Node]:
    """Returns a tree with all parts around an object of this size, and its node for the particles."""
    build = _Builder(name, is_group=False)
    tree = build.tree
    body = tree.nodes.new("CurlewObject")
    body.object = obj
    collider = add(tree, "COLLIDER", Object=body)
    wind = add(tree, "WIND", Collider=collider, Arrow=_arrow(f"Wind: {obj.name}", obj, 0.7 * size, scene))
    turbulence = add(tree, "TURBULENCE", Collider=collider, Speed=0.3 * size, Frequency=2.2 / size)
    air = build.add("superpose", wind, turbulence)
    emitter = add(tree, "SURFACE_EMITTER", Object=body, Flow=air, Points_per_Second=20000, Lifetime=1.5)
    result = build.add("CurlewParticlesResult", build.add("advect", air, emitter, scheme="midpoint", steps="1"))
    build.lay_out()
    return tree, result


class CURLEW_OT_add_shot(bpy.types.Operator):
    """Add this part of a shot"""

    bl_idname = "curlew.add_shot"
    bl_label = "Add Part of a Shot"
    bl_options = {"REGISTER", "UNDO"}
    __annotations__ = {"kind": bpy.props.EnumProperty(name="Part", items=[(key, shot.name, shot.help) for key, shot in SHOTS.items()])}

    @classmethod
    def description(cls, context: bpy.types.Context, properties: Any) -> str:
        """Returns what the part does."""
        return SHOTS[properties.kind].help

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Returns whether a Curlew tree is shown."""
        space = context.space_data
        return bool(space and space.type == "NODE_EDITOR" and space.tree_type == nodes.TREE and space.edit_tree)

    def execute(self, context: bpy.types.Context) -> Set[str]:
        """Adds it at the cursor, selected."""
        space = context.space_data
        for node in space.edit_tree.nodes:
            node.select = False
        node = add(space.edit_tree, self.kind)
        node.location, node.select = space.cursor_location, True
        space.edit_tree.nodes.active = node
        return {"FINISHED"}

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Set[str]:
        """Adds it at the mouse, to be moved."""
        context.space_data.cursor_location_from_region(event.mouse_region_x, event.mouse_region_y)
        result = self.execute(context)
        bpy.ops.node.translate_attach_remove_on_cancel("INVOKE_DEFAULT")
        return result


register, unregister = bpy.utils.register_classes_factory((CURLEW_OT_add_shot,))
