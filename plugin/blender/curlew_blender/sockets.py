# SPDX-License-Identifier: GPL-3.0-or-later
"""Socket types: one for each kind of object."""

from typing import AbstractSet, Dict, List, Tuple, Type

import bpy

Color = Tuple[float, float, float, float]

COLORS: Dict[str, Color] = {
    "Field": (0.63, 0.63, 0.63, 1.0),
    "Shape": (0.80, 0.65, 0.25, 1.0),
    "Flow": (0.39, 0.39, 0.78, 1.0),
    "Geometry": (0.00, 0.84, 0.64, 1.0),
    "Grid": (0.60, 0.36, 0.72, 1.0),
    "Points": (0.30, 0.65, 0.90, 1.0),
    "Curves": (0.85, 0.45, 0.35, 1.0),
    "Image": (0.78, 0.78, 0.16, 1.0),
    "Any": (0.35, 0.35, 0.35, 1.0),
}
_OF_KIND = {
    "field": "Field", "noise": "Field", "shape": "Shape", "flow": "Flow", "mesh": "Geometry", "grid": "Grid",
    "velocity": "Grid", "levelSet": "Grid", "points": "Points", "curves": "Curves", "image": "Image",
}


def socket_type(kinds: AbstractSet[str]) -> str:
    """Returns the bl_idname of the socket for these kinds."""
    names = {_OF_KIND[kind] for kind in kinds}
    if names == {"Field", "Shape"}:
        names = {"Field"}
    return f"Curlew{names.pop() if len(names) == 1 else 'Any'}Socket"


def color_of(kinds: AbstractSet[str]) -> Color:
    """Returns the colour of the socket for these kinds."""
    return COLORS[socket_type(kinds)[len("Curlew"):-len("Socket")]]


def _socket_class(name: str) -> Type[bpy.types.NodeSocket]:
    color = COLORS[name]

    def draw(self, context, layout, node, text):  # noqa: ANN001
        layout.label(text=text)

    def draw_color(self, context, node):  # noqa: ANN001
        return color

    def draw_color_simple(cls):  # noqa: ANN001
        return color

    return type(
        f"Curlew{name}Socket",
        (bpy.types.NodeSocket,),
        {
            "bl_idname": f"Curlew{name}Socket",
            "bl_label": name,
            "__doc__": f"{name} of a Curlew tree.",
            "draw": draw,
            "draw_color": draw_color,
            "draw_color_simple": classmethod(draw_color_simple),
        },
    )


CLASSES: List[Type[bpy.types.NodeSocket]] = [_socket_class(name) for name in COLORS]
# Blender's own sockets, for options by type and for objects.
VALUES: Dict[str, str] = {"real": "NodeSocketFloat", "integer": "NodeSocketInt", "flag": "NodeSocketBool",
                          "vector": "NodeSocketVector", "object": "NodeSocketObject", "collection": "NodeSocketCollection"}
SOCKETS = frozenset([*(cls.bl_idname for cls in CLASSES), *VALUES.values()])
register, unregister = bpy.utils.register_classes_factory(CLASSES)
