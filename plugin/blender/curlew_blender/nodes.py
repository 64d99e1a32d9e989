# SPDX-License-Identifier: GPL-3.0-or-later
# Longer than 400 lines: the classes of all nodes share the drawing of options and sockets.
"""Node classes: one for each action of the registry, and those for Blender's own data (object inputs and results,
groups)."""

import re
import textwrap
from typing import Any, Dict, List, Optional, Tuple, Type

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, FloatVectorProperty, IntProperty
from bpy.props import PointerProperty, StringProperty

from . import library, writing
from .actions import MOST_INT, NO_NODE, Action, Option, Socket, numbers, option_range, property_value, value_text
from .results import lock_interface
from .sources import has_edges, is_mesh
from .sockets import SOCKETS, VALUES, color_of, socket_type
from .values import TREE, tell

_RED = (0.45, 0.08, 0.08)
UNITS = {"world units": "LENGTH", "s": "TIME", "world units / s": "VELOCITY"}  # Blender's units for those of options
_FEW = 5  # number of options that a node shows by default


def _rename(self: bpy.types.bpy_struct, context: Optional[bpy.types.Context]) -> None:
    """For properties that may name a file that is written: the user has chosen the name."""
    writing.allow(self)
    tell(self)


def title_of(name: str) -> str:
    """advectLevelSet -> Advect Level Set."""
    known = {"dfvn": "Flow (∇f × ∇g)", "mesh2ls": "Mesh to Level Set", "ls2mesh": "Level Set to Mesh", "lic": "LIC"}
    return known.get(name) or re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).capitalize().replace("level set", "Level Set")


def _property_of(option: Option) -> Any:
    lower, upper = option_range(option)
    common = {"name": option.label, "description": option.description, "update": tell}
    unit = {"unit": UNITS.get(option.unit, "NONE")}
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
        return FloatProperty(default=min(max(start, lower), upper), min=lower, max=upper, precision=4, step=1, **unit, **common)
    if option.type in ("vector", "interval", "box"):
        size = {"vector": 3, "interval": 2, "box": 6}[option.type]
        plain = {"vector": (0.0,) * 3, "interval": (0.0, 1.0), "box": (-1.0,) * 3 + (1.0,) * 3}[option.type]
        # The range of an option applies to a single number, not to a box or an interval.
        return FloatVectorProperty(size=size, default=default or plain, precision=4, step=1, **unit, **common)
    return StringProperty(default=option.default, **{**common, "update": _rename})


class CurlewNode:
    """Base class of all nodes of a Curlew tree."""

    bl_width_default = 190
    takes: Tuple[Socket, ...] = ()
    makes: Tuple[Socket, ...] = ()
    shown: Tuple[str, ...] = ()  # shown properties; the first one is an object and has no label

    @classmethod
    def poll(cls, tree: bpy.types.NodeTree) -> bool:
        """Returns whether the tree is a Curlew tree."""
        return tree.bl_idname == TREE

    def init(self, context: Optional[bpy.types.Context]) -> None:
        """Creates the sockets."""
        for sockets, declared in ((self.inputs, self.takes), (self.outputs, self.makes)):
            for socket in declared:
                sockets.new(socket_type(socket.kinds), socket.label)
        if self.makes or self.takes:
            self.use_custom_color = True
            self.color = [0.12 + 0.25 * part for part in color_of((self.makes or self.takes)[0].kinds)[:3]]

    def output_name(self, index: int) -> str:
        """Returns the part of a link to an output socket after the node's name; "" if the name alone suffices."""
        return ""

    def value_sockets(self) -> Dict[str, bpy.types.NodeSocket]:
        """Returns the sockets for values, by the names of the properties that they replace."""
        return {socket.identifier: socket for socket in self.inputs[len(self.takes):]}

    def add_value(self, name: str) -> bpy.types.NodeSocket:
        """Replaces a property by a socket with its value."""
        about = self.bl_rna.properties[name]
        if about.type == "POINTER":
            kind = about.fixed_type.identifier.lower()
        else:
            kind = "vector" if about.is_array else {"FLOAT": "real", "INT": "integer", "BOOLEAN": "flag"}[about.type]
        socket = self.inputs.new(VALUES[kind], about.name, identifier=name)
        socket.default_value = getattr(self, name)
        return socket

    def remove_value(self, name: str) -> None:
        """Replaces the socket by the property again."""
        self.inputs.remove(self.value_sockets()[name])

    def insert_link(self, link: bpy.types.NodeLink) -> None:
        """Turns on the output that a new link needs."""
        if link.from_node == self:
            self.turn_on(next((k for k, socket in enumerate(self.outputs) if socket == link.from_socket), -1))

    def turn_on(self, index: int) -> None:
        """Turns on the output with this index, if an option turns it off."""

    def copy(self, node: bpy.types.Node) -> None:
        """Clears the error of a copy."""
        self.show_error("")

    def show_error(self, message: str) -> None:
        """Marks the node red with a message, or clears both."""
        if message and not self.error:
            self["calm"] = [float(self.use_custom_color), *self.color]
            self.use_custom_color, self.color = True, _RED
        elif self.error and not message:
            custom, *color = self.get("calm", [0.0, 0.3, 0.3, 0.3])
            self.use_custom_color, self.color = bool(custom), color
        self.error = message

    def draw_error(self, layout: bpy.types.UILayout) -> None:
        """Draws the message, wrapped to the width of the node."""
        if not self.error:
            return
        column = layout.column(align=True)
        column.alert = True
        for k, line in enumerate(textwrap.wrap(self.error, max(16, int(self.width / 6.5)))):
            column.label(text=line, icon="ERROR" if k == 0 else "BLANK1")
        if writing.refused(self):
            allow = layout.operator("curlew.allow_writing", icon="FILE_TICK")
            allow.tree, allow.node = self.id_data.name, self.name

    def draw_buttons(self, context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
        """In the node."""
        self.draw_error(layout)
        if getattr(self, "outdated", False) and not self.error:
            layout.label(text="Older than its settings: bake again", icon="FILE_REFRESH")
        for k, name in enumerate(self.shown):
            if name not in self.value_sockets():
                layout.prop(self, name, **({"text": ""} if k == 0 else {}))

    def draw_label(self) -> str:
        """Returns the header's text."""
        return ("Error: " if self.error else "Outdated: " if getattr(self, "outdated", False) else "") + self.bl_label


class ActionNode(CurlewNode):
    """A node that represents an action."""

    action: Action

    def output_name(self, index: int) -> str:
        """Returns the output's name. For a file, this is the name of a selected grid; "" stands for the file's last
        object."""
        made = self.makes[index]
        if self.action.name == "read":
            names = [name for name in self.given().get("grids", "").split(",") if name]
            return names[made.number] if made.name == "grids" and made.number < len(names) else ""
        return "" if made.primary else made.name

    def turn_on(self, index: int) -> None:
        """Turns on the output with this index, if an option turns it off."""
        flag = self.makes[index].flag if 0 <= index < len(self.makes) else ""
        if flag and self.given().get(flag, "0") == "0":
            self.set_option(flag, "1")

    def given(self) -> Dict[str, str]:
        """Returns the options that have been set, as texts."""
        options: Dict[str, str] = {}
        sockets = self.value_sockets()
        for option in self.action.options:
            written = getattr(self, "t_" + option.name)
            socket = sockets.get("o_" + option.name)
            if socket:
                options[option.name] = value_text(option, socket.default_value)
            elif written:
                options[option.name] = written
            elif self.is_property_set("o_" + option.name):
                text = value_text(option, getattr(self, "o_" + option.name))
                if text:
                    options[option.name] = text
        return options

    def set_option(self, name: str, text: str) -> None:
        """Sets an option from a text: sets its property, or stores the text if the property cannot represent it
        exactly."""
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
        """Resets an option to its default."""
        self.property_unset("o_" + name)
        self.property_unset("t_" + name)

    def _is_given(self, option: Option) -> bool:
        return self.is_property_set("o_" + option.name) or bool(getattr(self, "t_" + option.name))

    def _draw_option(self, layout: bpy.types.UILayout, option: Option, everything: bool) -> None:
        row = layout.row(align=True)
        body = row.row(align=True)
        body.active = self.action.has_effect(option, self.given(), self.words) if option.only_with else True
        given = self._is_given(option)
        written = bool(getattr(self, "t_" + option.name))
        many = option.type in ("vector", "interval", "box")

        def button(icon: str, to: str) -> None:
            change = row.operator("curlew.option", text="", icon=icon, emboss=False)
            change.node, change.option, change.to = self.name, option.name, to

        if "o_" + option.name in self.value_sockets():
            if everything:
                body.label(text=option.label)
                button("NODE", "PROPERTY")
            return
        if everything and option.type in VALUES:
            button("NODE", "SOCKET")
        if not given and (many or not option.default) and option.type != "text":
            body.label(text=f"{option.label}: {option.default or 'automatic'}")
            button("ADD", "VALUE")
            return
        (body.column(align=True) if many else body).prop(self, ("t_" if written else "o_") + option.name, text=option.label)
        if not written:
            button("DRIVER_TRANSFORM", "TEXT")
        if given:
            button("LOOP_BACK", "DEFAULT")

    def _draw_options(self, layout: bpy.types.UILayout, everything: bool) -> None:
        for k, option in enumerate(self.action.options):
            if everything or k < _FEW or self._is_given(option):
                self._draw_option(layout, option, everything)

    def draw_buttons(self, context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
        """Draws the first options and those that are set. The sidebar shows all options."""
        self.draw_error(layout)
        if self.action.most_words:
            layout.prop(self, "words", text="", placeholder=self.action.words) if bpy.app.version >= (4, 1, 0) else \
                layout.prop(self, "words", text=self.action.words.split(" ")[0].capitalize())
        if self.places() and "place" not in self.value_sockets():
            layout.prop(self, "place", text="")
        self._draw_options(layout, self.show_all)
        if len(self.action.options) > _FEW:
            layout.prop(self, "show_all", toggle=True, text="Fewer Options" if self.show_all else "All Options",
                        emboss=False, icon="TRIA_UP" if self.show_all else "TRIA_DOWN")

    def draw_buttons_ext(self, context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
        """Draws all options in the sidebar."""
        for line in textwrap.wrap(self.action.summary, 40):
            layout.label(text=line)
        self._draw_options(layout, True)
        layout.prop(self, "when")
        if not self.makes:
            layout.prop(self, "order")

    @classmethod
    def places(cls) -> bool:
        """Returns whether an object can provide the position."""
        return all(cls.action.has(name) for name in ("translate", "rotate"))


def action_id(name: str) -> str:
    """Returns the bl_idname of an action's node."""
    return "CurlewNode_" + name


def _shared_properties() -> Dict[str, Any]:
    return {
        "error": StringProperty(options={"SKIP_SAVE"}),
        "when": EnumProperty(
            name="When",
            description="When this node is evaluated in a sequence",
            items=[("auto", "As Needed", "In each frame if it depends on time, otherwise once"),
                   ("once", "Once", "Once, before the first frame"), ("frame", "Each Frame", "Again in each frame")],
        ),
        "order": IntProperty(name="Order", description="Nodes without outputs run in this order, lowest first"),
    }


def _action_class(action: Action) -> Type[bpy.types.Node]:
    properties: Dict[str, Any] = {
        **_shared_properties(),
        "words": StringProperty(name=action.words or "Words", description=action.words, update=_rename),
        "show_all": BoolProperty(name="All Options"),
        "place": PointerProperty(type=bpy.types.Object, name="Place",
                                 description="Object whose transform this node takes, for instance an empty", update=tell),
    }
    for option in action.options:
        properties["o_" + option.name] = _property_of(option)
        properties["t_" + option.name] = StringProperty(
            name=option.label, update=_rename if option.type == "text" else tell,
            description=option.description + ". As text, which may contain {expressions} of the frame F and its time T")
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


def _motion() -> Any:
    return EnumProperty(
        name="In Each Frame", description="Whether to read the object again in each frame of a sequence", update=tell,
        items=[("AUTO", "Automatic", "In each frame if the object may move or deform: animation, parents, armatures, shape keys, "
                                     "constraints, modifiers"),
               ("ON", "Yes", "In each frame"), ("OFF", "No", "Only in the first frame")])


class CurlewMeshObject(CurlewNode, bpy.types.Node):
    """A mesh of the scene, the meshes of a collection, or both as one, with modifiers, instances and transforms applied."""

    bl_idname = "CurlewMeshObject"
    bl_label = "Mesh Object"
    makes = (Socket("Mesh", "mesh", frozenset({"mesh"})),)
    shown = ("object", "collection", "motion")
    __annotations__ = {
        **_shared_properties(),
        "object": PointerProperty(type=bpy.types.Object, name="Object", update=tell,
                                  poll=lambda self, o: is_mesh(o)),
        "collection": PointerProperty(type=bpy.types.Collection, name="Collection", update=tell,
                                      description="Collection whose meshes are read too"),
        "motion": _motion(),
    }

    @property
    def animated(self) -> bool:
        """The setting of the last release, for scripts: whether to read the object in each frame."""
        return self.motion == "ON"

    @animated.setter
    def animated(self, each: bool) -> None:
        self.motion = "ON" if each else "OFF"


class CurlewCurveObject(CurlewNode, bpy.types.Node):
    """The curves of an object, or the edges of a mesh without faces, for instance for a flow along them (Rail)."""

    bl_idname = "CurlewCurveObject"
    bl_label = "Curve Object"
    makes = (Socket("Curves", "curves", frozenset({"curves"})),)
    shown = ("object", "motion")
    __annotations__ = {
        **_shared_properties(),
        "object": PointerProperty(type=bpy.types.Object, name="Object", update=tell,
                                  poll=lambda self, o: has_edges(o)),
        "motion": _motion(),
    }


class CurlewVolumeObject(CurlewNode, bpy.types.Node):
    """The grids of a volume object's file, placed as in the file: the object's transform is ignored."""

    bl_idname = "CurlewVolumeObject"
    bl_label = "Volume Object"
    makes = _FOUR_GRIDS
    shown = ("object", "grids")
    __annotations__ = {
        **_shared_properties(),
        "object": PointerProperty(type=bpy.types.Object, name="Object", update=tell,
                                  poll=lambda self, o: o.type == "VOLUME"),
        "grids": StringProperty(name="Grids", description="Names of the grids, separated by commas; empty for all", update=tell),
    }

    def output_name(self, index: int) -> str:
        """Returns the index of the grid among those that are read."""
        return str(index)


_renewing = False


def renew_groups(*_: Any) -> None:
    """Gives all group nodes the sockets of their trees."""
    global _renewing
    if _renewing:
        return
    _renewing = True  # new sockets call this again
    try:
        for tree in bpy.data.node_groups:
            for node in tree.nodes if tree.bl_idname == TREE else ():
                if node.bl_idname == CurlewGroup.bl_idname:
                    node.renew_sockets()
    finally:
        _renewing = False


def _result_class(kind: str, label: str, takes: Tuple[Socket, ...], doc: str) -> Type[bpy.types.Node]:
    return type(f"Curlew{label.replace(' ', '')}Result", (CurlewNode, bpy.types.Node), {
        "__annotations__": {
            **_shared_properties(),
            "target": PointerProperty(type=bpy.types.Object, name="Object",
                                      description="Object that shows the result; the first bake creates it"),
            **({"look": EnumProperty(name="Look", items=[
                ("POINTS", "Points", "Round points"), ("STREAKS", "Streaks", "Streaks along the velocity"),
                ("SMOKE", "Smoke", "Puffs of a volume that grow with their age")])} if kind == "points" else {}),
            "baked": StringProperty(options={"HIDDEN"}),  # digest of the settings of what is shown
            "outdated": BoolProperty(options={"HIDDEN"}),
            "thickness": FloatProperty(name="Size" if kind == "points" else "Thickness", default=0.006, min=0.0, precision=4, step=0.1,
                                       description="Radius, in world units"),
        },
        "__doc__": doc,
        "__module__": __name__,
        "bl_idname": f"Curlew{label.replace(' ', '')}Result",
        "bl_label": f"{label} Result",
        "takes": takes,
        "kind": kind,
        "shown": {"points": ("target", "look", "thickness"), "curves": ("target", "thickness")}.get(kind, ("target",)),
    })


def _one(label: str, kind: str) -> Tuple[Socket, ...]:
    return (Socket(label, "what", frozenset({kind})),)


RESULTS: Tuple[Type[bpy.types.Node], ...] = (
    _result_class("grid", "Volume", _FOUR_GRIDS, "Shows grids as a volume object, with motion blur from velocities"),
    _result_class("points", "Particles", _one("Points", "points"),
                  "Shows points as mesh vertices with id, velocity and age, drawn by Geometry Nodes"),
    _result_class("curves", "Curves", _one("Curves", "curves"), "Shows curves, such as streamlines, as a curve object"),
    _result_class("mesh", "Mesh", _one("Mesh", "mesh"), "Shows a mesh as a mesh object"),
)


class CurlewGroup(CurlewNode, bpy.types.NodeCustomGroup):
    """A Curlew node tree inside another one. Until 3.6, Blender itself gives it the sockets of that tree."""

    bl_idname = "CurlewGroup"
    bl_label = "Group"
    __annotations__ = {"error": StringProperty(options={"SKIP_SAVE"})}

    def draw_buttons(self, context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
        """In the node."""
        self.draw_error(layout)
        layout.template_ID(self, "node_tree")

    def renew_sockets(self) -> None:
        """Gives the node the sockets of its tree. Those that stay keep their links."""
        if bpy.app.version < (4, 0, 0):
            return
        items = self.node_tree.interface.items_tree if self.node_tree else ()
        for sockets, direction in ((self.inputs, "INPUT"), (self.outputs, "OUTPUT")):
            wanted = [item for item in items if item.item_type == "SOCKET" and item.in_out == direction]
            kinds = {item.identifier: item.bl_socket_idname for item in wanted}
            for socket in [s for s in sockets if kinds.get(s.identifier) != s.bl_idname]:
                sockets.remove(socket)
            for place, item in enumerate(wanted):
                now = next((k for k, s in enumerate(sockets) if s.identifier == item.identifier), None)
                if now is None:
                    made = sockets.new(item.bl_socket_idname, item.name, identifier=item.identifier)
                    if hasattr(item, "default_value"):
                        made.default_value = item.default_value
                    now = len(sockets) - 1
                if now != place:
                    sockets.move(now, place)
                if sockets[place].name != item.name:
                    sockets[place].name = item.name


class CurlewTree(bpy.types.NodeTree):
    """Nodes for fields, flows, grids, particles and curves."""

    bl_idname = TREE
    bl_label = "Curlew"
    bl_icon = "FORCE_VORTEX"

    @classmethod
    def valid_socket_type(cls, idname: str) -> bool:
        """Returns whether the interface of a group may have sockets of this type."""
        return idname in SOCKETS

    def update(self) -> None:
        """Blender calls this when nodes, links, values of sockets or the interface of a tree have changed."""
        renew_groups()
        tell(self)
    __annotations__ = {
        "sequence": BoolProperty(name="Sequence", description="Bake all frames of the scene instead of only the current one"),
        "substeps": IntProperty(name="Substeps", default=1, min=1, max=1000,
                                description="Number of steps in which points move from one frame to the next"),
        "run_up": IntProperty(name="Run-Up", default=0, min=0, soft_max=250,
                              description="Number of frames that are evaluated before the first frame of the scene, so that an "
                                          "emitter has filled the air by then"),
        "repeat": BoolProperty(name="Repeat", description="Show the frames again after the last one, for a loop"),
        "message": StringProperty(options={"SKIP_SAVE"}),
        "preview": EnumProperty(
            name="Preview", items=[("NONE", "Off", "No preview"),
                                   ("POINTS", "Particles", "2,000 particles in the 3D view"),
                                   ("SLICE", "Slice", "The speed on a plane in low resolution, as an image")],
            update=tell),
        "bake_on_frame": BoolProperty(
            name="Bake on Frame Change",
            description="Bake the tree again whenever the scene goes to another frame; renders wait for the bake. This "
                        "turns on Render > Lock Interface, as Blender advises for objects that change with the frame. "
                        "Nodes that write files of their own run only in a bake that you start. Sequences and trees "
                        "with a Frames node show their baked frames instead",
            update=lambda self, context: lock_interface(context.scene) if self.bake_on_frame else None),
        "keep_frames": IntProperty(name="Keep Frames", default=100, min=1, soft_max=1000,
                                   description="Number of frames baked on frame change that stay in the cache"),
        "bake_number": IntProperty(options={"HIDDEN"}),
    }


OWN: Tuple[type, ...] = (CurlewTree, CurlewMeshObject, CurlewCurveObject, CurlewVolumeObject, *RESULTS, CurlewGroup)
_actions: Dict[str, Type[bpy.types.Node]] = {}


def node_classes() -> Dict[str, Type[bpy.types.Node]]:
    """Returns the node classes by action."""
    return _actions


def register() -> None:
    """Creates and registers all classes."""
    for cls in OWN:
        bpy.utils.register_class(cls)
    for name, action in library.actions().items():
        if name not in NO_NODE:
            _actions[name] = _action_class(action)
            bpy.utils.register_class(_actions[name])


def unregister() -> None:
    """Unregisters all classes."""
    for cls in reversed(list(_actions.values())):
        bpy.utils.unregister_class(cls)
    _actions.clear()
    for cls in reversed(OWN):
        bpy.utils.unregister_class(cls)
