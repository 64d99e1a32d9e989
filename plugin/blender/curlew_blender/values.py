# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes that give values to the sockets of options: a number, a vector, an object, the arrow that an object is."""

from dataclasses import dataclass
from typing import Any, Callable, List, Optional, Tuple, Type

import bpy

from .actions import number_text

TREE = "CurlewTree"
# Called with a tree when the user has changed something in it.
changed: List[Callable[[bpy.types.NodeTree], None]] = []


def tell(self: bpy.types.bpy_struct, context: Optional[bpy.types.Context] = None) -> None:
    """Calls the listeners: the update function of properties."""
    for listener in changed:
        listener(self.id_data)  # for a tree, this is the tree itself


@dataclass(frozen=True)
class Arrow:
    """The z axis of an object with its length: as a vector, or its length alone."""

    object: bpy.types.Object
    is_length: bool


Resolve = Callable[[bpy.types.NodeSocket], Any]  # returns the value of an input


class ValueNode:
    """Base class of these nodes. They are not nodes of the graph."""

    bl_width_default = 160
    gives: Tuple[Tuple[str, str], ...] = ()  # types and names of the outputs
    shown: Tuple[str, ...] = ()

    @classmethod
    def poll(cls, tree: bpy.types.NodeTree) -> bool:
        """Returns whether the tree is a Curlew tree."""
        return tree.bl_idname == TREE

    def init(self, context: Optional[bpy.types.Context]) -> None:
        """Creates the sockets."""
        for kind, name in self.gives:
            self.outputs.new(kind, name)

    def draw_buttons(self, context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
        """In the node."""
        for name in self.shown:
            layout.prop(self, name, text="")

    def give(self, output: int, resolve: Resolve) -> Any:
        """Returns the value of an output: a text, an object, an Arrow, or None."""
        raise NotImplementedError


class CurlewValue(ValueNode, bpy.types.Node):
    """A number for any number of options, or an expression of the frame F and its time T."""

    bl_idname = "CurlewValue"
    bl_label = "Value"
    gives = (("NodeSocketFloat", "Value"),)
    __annotations__ = {
        "value": bpy.props.FloatProperty(name="Value", precision=4, step=1, update=tell),
        "text": bpy.props.StringProperty(name="Expression", description="Such as {0.5*T}; empty for the number", update=tell),
    }

    def draw_buttons(self, context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
        """In the node."""
        if not self.text:
            layout.prop(self, "value", text="")
        layout.prop(self, "text", text="", icon="DRIVER_TRANSFORM")

    def give(self, output: int, resolve: Resolve) -> Any:
        """Returns the number or the expression."""
        return self.text or number_text(self.value)


class CurlewVector(ValueNode, bpy.types.Node):
    """Three numbers."""

    bl_idname = "CurlewVector"
    bl_label = "Vector"
    gives = (("NodeSocketVector", "Vector"),)
    shown = ("vector",)
    __annotations__ = {"vector": bpy.props.FloatVectorProperty(name="Vector", precision=4, step=1, update=tell)}

    def draw_buttons(self, context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
        """In the node, one below the other."""
        layout.column(align=True).prop(self, "vector", text="")

    def give(self, output: int, resolve: Resolve) -> Any:
        """Returns the numbers."""
        return ",".join(number_text(v) for v in self.vector)


class CurlewObject(ValueNode, bpy.types.Node):
    """An object for any number of nodes."""

    bl_idname = "CurlewObject"
    bl_label = "Object"
    gives = (("NodeSocketObject", "Object"),)
    shown = ("object",)
    __annotations__ = {"object": bpy.props.PointerProperty(type=bpy.types.Object, name="Object", update=tell)}

    def give(self, output: int, resolve: Resolve) -> Any:
        """Returns the object."""
        return self.object


class CurlewArrow(ValueNode, bpy.types.Node):
    """The z axis of an object, such as an empty shown as an arrow: a longer one gives a longer vector."""

    bl_idname = "CurlewArrow"
    bl_label = "Arrow"
    gives = (("NodeSocketVector", "Vector"), ("NodeSocketFloat", "Length"))

    def init(self, context: Optional[bpy.types.Context]) -> None:
        """Creates the sockets."""
        self.inputs.new("NodeSocketObject", "Object")
        super().init(context)

    def give(self, output: int, resolve: Resolve) -> Any:
        """Returns the arrow that the object is; None without an object."""
        obj = resolve(self.inputs[0])
        return Arrow(obj, output == 1) if obj else None


CLASSES: Tuple[Type[bpy.types.Node], ...] = (CurlewValue, CurlewVector, CurlewObject, CurlewArrow)
register, unregister = bpy.utils.register_classes_factory(CLASSES)
