# SPDX-License-Identifier: GPL-3.0-or-later
"""A node class for each action of the registry, and those for what is Blender's: objects in and out, groups."""

import re
import textwrap
from typing import Any, Callable, Dict, List, Optional, Tuple, Type

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from .actions import MOST_INT, NO_NODE, Action, Option, Socket, numbers, option_range, property_value, value_text
from .results import lock_interface
from .sockets import socket_type

TREE = "CurlewTree"
_RED = (0.45, 0.08, 0.08)
_FEW = 5  # options that a node shows before it is told to show all

# Called with a tree when something in it has been changed by hand: the preview listens.
changed: List[Callable[[bpy.types.NodeTree], None]] = []


def _update(self: bpy.types.bpy_struct, context: Optional[bpy.types.Context]) -> None:
    for listener in changed:
        listener(self.id_data)  # a tree's is itself


def title_of(name: str) -> str:
    """advectLevelSet -> Advect Level Set."""
    known = {"dfvn": "Flow (∇f × ∇g)", "mesh2ls": "Mesh to Level Set", "ls2mesh": "Level Set to Mesh", "lic": "LIC"}
    return known.get(name) or re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).capitalize().replace("level set", "Level Set")


def _property_of(option: Option) -> Any:
    lower, upper = option_range(option)
    common = {"name": option.name, "description": option.description, "update": _update}
    default = property_value(option, option.default) if option.default else None
    if option.type == "flag":
        return BoolProperty(default=bool(default), **common)
    if option.type == "choice":
        items = [(choice, choice, option.description) for choice in option.choices]
        return EnumProperty(items=items, default=default or option.choices[0], **common)
    if option.type == "integer":
        low, high = int(max(lower, -MOST_INT)), int(min(upper, MOST_INT))
        return IntProperty(default=default if default is not None else max(low, min(high, 0)), min=low, max=high, **common)
    if option.type == "real":
        start = numbers(option.default)[0] if option.default else 1.0
        return FloatProperty(default=min(max(start, lower), upper), min=lower, max=upper, precision=4, step=1, **common)
    if option.type in ("vector", "interval", "box"):
        size = {"vector": 3, "interval": 2, "box": 6}[option.type]
        plain = {"vector": (0.0,) * 3, "interval": (0.0, 1.0), "box": (-1.0,) * 3 + (1.0,) * 3}[option.type]
        # Box and interval have ranges of their own: that of an option is for one number.
        return FloatVectorProperty(size=size, default=default or plain, precision=4, step=1, **common)
    return StringProperty(default=option.default, **common)


class CurlewNode:
    """What all nodes of a Curlew tree share."""

    bl_width_default = 190
    takes: Tuple[Socket, ...] = ()
    makes: Tuple[Socket, ...] = ()
    shown: Tuple[str, ...] = ()  # properties; the first, an object, without its name

    @classmethod
    def poll(cls, tree: bpy.types.NodeTree) -> bool:
        """Only in our trees."""
        return tree.bl_idname == TREE

    def init(self, context: Optional[bpy.types.Context]) -> None:
        """Makes the sockets."""
        for sockets, declared in ((self.inputs, self.takes), (self.outputs, self.makes)):
            for socket in declared:
                sockets.new(socket_type(socket.kinds), socket.label)

    def output_name(self, index: int) -> str:
        """What a link to an output socket has after the node's name; "" if that is enough."""
        return ""

    def copy(self, node: bpy.types.Node) -> None:
        """A copy has no error yet."""
        self.show_error("")

    def show_error(self, message: str) -> None:
        """Makes the node red, with a message; or clears that."""
        if bool(message) != bool(self.error):
            self.use_custom_color = bool(message)
            if message:
                self.color = _RED
        self.error = message

    def draw_error(self, layout: bpy.types.UILayout) -> None:
        """The message in lines as wide as the node."""
        if not self.error:
            return
        column = layout.column(align=True)
        column.alert = True
        for k, line in enumerate(textwrap.wrap(self.error, max(16, int(self.width / 6.5)))):
            column.label(text=line, icon="ERROR" if k == 0 else "BLANK1")

    def draw_buttons(self, context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
        """In the node."""
        self.draw_error(layout)
        for k, name in enumerate(self.shown):
            layout.prop(self, name, **({"text": ""} if k == 0 else {}))

    def draw_label(self) -> str:
        """The header."""
        return ("Error: " if self.error else "") + self.bl_label


class ActionNode(CurlewNode):
    """A node that stands for an action."""

    action: Action

    def output_name(self, index: int) -> str:
        """The output's name; of a file the grids that were chosen by their names, or else what is its last."""
        made = self.makes[index]
        if self.action.name == "read":
            names = [name for name in self.given().get("grids", "").split(",") if name]
            return names[made.number] if made.name == "grids" and made.number < len(names) else ""
        return "" if made.primary else made.name

    def given(self) -> Dict[str, str]:
        """The options that have been set, as texts."""
        options: Dict[str, str] = {}
        for option in self.action.options:
            written = getattr(self, "t_" + option.name)
            if written:
                options[option.name] = written
            elif self.is_property_set("o_" + option.name):
                text = value_text(option, getattr(self, "o_" + option.name))
                if text:
                    options[option.name] = text
        return options

    def set_option(self, name: str, text: str) -> None:
        """Sets an option from a text: its property, or where that cannot hold it exactly the text itself."""
        option = self.action.option(name)
        value = property_value(option, text)
        lower, upper = option_range(option)
        if isinstance(value, (int, float)) and not isinstance(value, bool) and not lower <= value <= upper:
            value = None
        if value is None:
            setattr(self, "t_" + option.name, text)
        else:
            setattr(self, "t_" + option.name, "")
            setattr(self, "o_" + option.name, value)

    def reset_option(self, name: str) -> None:
        """Back to the default."""
        self.property_unset("o_" + name)
        self.property_unset("t_" + name)

    def _is_given(self, option: Option) -> bool:
        return self.is_property_set("o_" + option.name) or bool(getattr(self, "t_" + option.name))

    def _draw_option(self, layout: bpy.types.UILayout, option: Option) -> None:
        row = layout.row(align=True)
        body = row.row(align=True)
        body.active = given = self._is_given(option)
        written = bool(getattr(self, "t_" + option.name))
        many = option.type in ("vector", "interval", "box")

        def button(icon: str, to: str) -> None:
            change = row.operator("curlew.option", text="", icon=icon, emboss=False)
            change.node, change.option, change.to = self.name, option.name, to

        if not given and (many or not option.default) and option.type != "text":
            body.label(text=f"{option.name}: {option.default or 'as it comes'}")
            button("ADD", "VALUE")
            return
        (body.column(align=True) if many else body).prop(self, ("t_" if written else "o_") + option.name, text=option.name)
        if not written:
            button("DRIVER_TRANSFORM", "TEXT")
        if given:
            button("LOOP_BACK", "DEFAULT")

    def _draw_options(self, layout: bpy.types.UILayout, everything: bool) -> None:
        for k, option in enumerate(self.action.options):
            if everything or k < _FEW or self._is_given(option):
                self._draw_option(layout, option)

    def draw_buttons(self, context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
        """The first options and those that are set; the sidebar has all."""
        self.draw_error(layout)
        if self.action.most_words:
            layout.prop(self, "words", text="", placeholder=self.action.words) if bpy.app.version >= (4, 1, 0) else \
                layout.prop(self, "words", text=self.action.words.split(" ")[0].capitalize())
        if self.places():
            layout.prop(self, "place", text="")
        self._draw_options(layout, self.show_all)
        if len(self.action.options) > _FEW:
            layout.prop(self, "show_all", toggle=True, text="Fewer options" if self.show_all else "All options",
                        emboss=False, icon="TRIA_UP" if self.show_all else "TRIA_DOWN")

    def draw_buttons_ext(self, context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
        """In the sidebar."""
        for line in textwrap.wrap(self.action.summary, 40):
            layout.label(text=line)
        self._draw_options(layout, True)
        layout.prop(self, "when")
        if not self.makes:
            layout.prop(self, "order")

    @classmethod
    def places(cls) -> bool:
        """Whether an object can say where it is."""
        return all(cls.action.has(name) for name in ("offset", "rotate"))


def action_id(name: str) -> str:
    """The bl_idname of the node of an action."""
    return "CurlewNode_" + name


def _shared_properties() -> Dict[str, Any]:
    return {
        "error": StringProperty(options={"SKIP_SAVE"}),
        "when": EnumProperty(
            name="When",
            description="In a sequence",
            items=[("auto", "As needed", "In each frame if it depends on time, else once"),
                   ("once", "Once", "Before the first frame"), ("frame", "Each frame", "Anew in each frame")],
        ),
        "order": IntProperty(name="Order", description="Of those that make nothing, lower ones run earlier"),
    }


def _action_class(action: Action) -> Type[bpy.types.Node]:
    properties: Dict[str, Any] = {
        **_shared_properties(),
        "words": StringProperty(name=action.words or "Words", description=action.words, update=_update),
        "show_all": BoolProperty(name="All options"),
        "place": PointerProperty(type=bpy.types.Object, name="Place",
                                 description="An object, an empty for instance, whose place it takes", update=_update),
    }
    for option in action.options:
        properties["o_" + option.name] = _property_of(option)
        properties["t_" + option.name] = StringProperty(
            name=option.name, update=_update,
            description=option.description + ". As text: {expressions} of the frame F and its time T are possible")
    return type(action_id(action.name), (ActionNode, bpy.types.Node), {
        "__annotations__": properties,
        "__doc__": action.summary,
        "bl_idname": action_id(action.name),
        "bl_label": title_of(action.name),
        "bl_description": action.summary,
        "action": action,
        "takes": action.takes,
        "makes": action.makes,
    })


_FOUR_GRIDS = tuple(Socket(name, "what", frozenset({"grid"})) for name in ("Grid", "Grid 2", "Grid 3", "Grid 4"))


class CurlewMeshObject(CurlewNode, bpy.types.Node):
    """A mesh as it is in the scene: modifiers and transform applied."""

    bl_idname = "CurlewMeshObject"
    bl_label = "Mesh Object"
    makes = (Socket("Mesh", "mesh", frozenset({"mesh"})),)
    shown = ("object", "animated")
    __annotations__ = {
        **_shared_properties(),
        "object": PointerProperty(type=bpy.types.Object, name="Object", update=_update,
                                  poll=lambda self, o: o.type in {"MESH", "CURVE", "SURFACE", "META", "FONT"}),
        "animated": BoolProperty(name="In each frame", description="It moves or deforms in a sequence", update=_update),
    }


class CurlewVolumeObject(CurlewNode, bpy.types.Node):
    """The grids of a volume object's file, where they are in that file."""

    bl_idname = "CurlewVolumeObject"
    bl_label = "Volume Object"
    makes = _FOUR_GRIDS
    shown = ("object", "grids")
    __annotations__ = {
        **_shared_properties(),
        "object": PointerProperty(type=bpy.types.Object, name="Object", update=_update,
                                  poll=lambda self, o: o.type == "VOLUME"),
        "grids": StringProperty(name="Grids", description="Names, separated by commas; none: all", update=_update),
    }

    def output_name(self, index: int) -> str:
        """Its number among those that are read."""
        return str(index)


def _result_class(kind: str, label: str, takes: Tuple[Socket, ...], doc: str) -> Type[bpy.types.Node]:
    return type(f"Curlew{label.replace(' ', '')}Result", (CurlewNode, bpy.types.Node), {
        "__annotations__": {
            **_shared_properties(),
            "target": PointerProperty(type=bpy.types.Object, name="Object",
                                      description="The object that shows it; made by the first bake"),
            "thickness": FloatProperty(name="Size" if kind == "points" else "Thickness", default=0.006, min=0.0, precision=4, step=0.1,
                                       description="Radius, in world units"),
        },
        "__doc__": doc,
        "__module__": __name__,
        "bl_idname": f"Curlew{label.replace(' ', '')}Result",
        "bl_label": f"{label} Result",
        "takes": takes,
        "kind": kind,
        "shown": ("target", "thickness") if kind in ("points", "curves") else ("target",),
    })


def _one(label: str, kind: str) -> Tuple[Socket, ...]:
    return (Socket(label, "what", frozenset({kind})),)


RESULTS: Tuple[Type[bpy.types.Node], ...] = (
    _result_class("grid", "Volume", _FOUR_GRIDS, "Grids as a volume object, velocities with motion blur"),
    _result_class("points", "Particles", _one("Points", "points"),
                  "Points as a mesh of vertices with id, velocity and age, shown by Geometry Nodes"),
    _result_class("curves", "Curves", _one("Curves", "curves"), "Streamlines as a curve object"),
    _result_class("mesh", "Mesh", _one("Mesh", "mesh"), "A mesh object"),
)


class CurlewGroup(CurlewNode, bpy.types.NodeCustomGroup):
    """A tree within a tree."""

    bl_idname = "CurlewGroup"
    bl_label = "Group"
    __annotations__ = {"error": StringProperty(options={"SKIP_SAVE"})}

    def draw_buttons(self, context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
        """In the node."""
        self.draw_error(layout)
        layout.template_ID(self, "node_tree")


class CurlewTree(bpy.types.NodeTree):
    """Fields, flows and what follows them."""

    bl_idname = TREE
    bl_label = "Curlew"
    bl_icon = "FORCE_VORTEX"
    __annotations__ = {
        "sequence": BoolProperty(name="Sequence", description="Bake the frames of the scene instead of one still"),
        "substeps": IntProperty(name="Substeps", default=1, min=1, max=1000,
                                description="In how many steps points move from frame to frame"),
        "message": StringProperty(options={"SKIP_SAVE"}),
        "preview": EnumProperty(
            name="Preview", items=[("NONE", "Off", "No preview"),
                                   ("POINTS", "Particles", "2,000 particles in the 3D view"),
                                   ("SLICE", "Slice", "The speed on a coarse plane, as an image")],
            update=_update),
        "bake_on_frame": BoolProperty(
            name="Bake on Frame Change",
            description="Bake the tree anew for each frame that the scene comes to; renders wait for it. This turns on "
                        "Render > Lock Interface, without which renders do not follow. Nodes that write files of their "
                        "own run only in a bake that you start. Sequences and trees with a Frames node show the frames "
                        "that they have baked instead",
            update=lambda self, context: lock_interface(context.scene) if self.bake_on_frame else None),
        "keep_frames": IntProperty(name="Keep Frames", default=100, min=1, soft_max=1000,
                                   description="How many frames that were baked on frame change stay in the cache"),
        "bake_number": IntProperty(options={"HIDDEN"}),
    }


OWN: Tuple[type, ...] = (CurlewTree, CurlewMeshObject, CurlewVolumeObject, *RESULTS, CurlewGroup)
_actions: Dict[str, Type[bpy.types.Node]] = {}


def node_classes() -> Dict[str, Type[bpy.types.Node]]:
    """The node classes by their actions."""
    return _actions


def register(actions: Dict[str, Action]) -> None:
    """Makes and registers all classes."""
    for cls in OWN:
        bpy.utils.register_class(cls)
    for name, action in actions.items():
        if name not in NO_NODE:
            _actions[name] = _action_class(action)
            bpy.utils.register_class(_actions[name])


def unregister() -> None:
    """Takes them back."""
    for cls in reversed(list(_actions.values())):
        bpy.utils.unregister_class(cls)
    _actions.clear()
    for cls in reversed(OWN):
        bpy.utils.unregister_class(cls)
