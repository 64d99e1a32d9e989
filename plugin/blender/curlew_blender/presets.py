# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets: trees whose lengths are relative to the object's size."""

from dataclasses import dataclass
from typing import Callable, Dict, Optional, Set

import bpy

from . import nodes, scene_io
from .actions import TreeError, number_text


@dataclass(frozen=True)
class Preset:
    """A scene. @0.1@ is a tenth of the object's size, @/4@ is 4 divided by that size. Written files become results, and
    the file that is read becomes the object."""

    name: str
    help: str
    text: str
    needs_mesh: bool = True
    thickness: float = 0.004


PRESETS: Dict[str, Preset] = {
    "SWIRL": Preset(
        "Contained Swirl",
        "Smoke, streamlines and particles that stay inside the object",
        """
        read object.ply
        mesh2ls dim=96
        noise frequency=@/3@ octaves=2 seed=1
        noise frequency=@/3@ octaves=2 seed=2
        bound layer=@0.06@
        dfvn speed=@0.35@
        velocity dim=96 name=velocity density=1
        write volume.vdb grid=0,1
        scatter count=250 seed=5
        trace maxLength=@1.5@
        write curves.obj
        scatter count=20000 seed=7
        advect duration=1.5 steps=40
        write particles.ply
        """,
        thickness=0.0022,
    ),
    "WAKE": Preset(
        "Obstacle Wake",
        "Streamlines of a wind that goes around the object",
        """
        read object.ply
        mesh2ls dim=80
        ramp gradient=0,0,1
        noise frequency=@/1.3@ octaves=2 seed=3 amplitude=@0.09@
        sum
        ramp gradient=0,1,0
        noise frequency=@/1.3@ octaves=2 seed=5 amplitude=@0.09@
        sum
        bound side=outside layer=@0.3@
        dfvn speed=@1@ padding=@0.35@
        scatter count=150 seed=4
        trace direction=both maxLength=@2@
        write curves.obj
        """,
        thickness=0.003,
    ),
    "SURFACE": Preset(
        "Surface Flow",
        "Streamlines that run along the object's surface",
        """
        read object.ply
        mesh2ls dim=128
        noise frequency=@/4@ octaves=2 seed=4
        surface extent=@0.014@ speed=@0.3@
        scatter count=5000 seed=2
        trace direction=both maxLength=@0.5@
        write curves.obj
        """,
        thickness=0.002,
    ),
    "GLOBE": Preset(
        "Globe",
        "Particles and streamlines on a sphere; needs no object",
        """
        sphere radius=1
        noise frequency=2 octaves=3 seed=11
        surface extent=0.04 speed=0.5
        sphere radius=1.012
        sphere radius=1.002
        difference smoothing=0
        scatter count=40000 seed=3
        advect duration=0.8 steps=30
        write particles.ply
        scatter count=500 seed=5
        trace direction=both maxLength=1.6
        write curves.obj
        """,
        needs_mesh=False,
        thickness=0.002,
    ),
}


def _scaled(text: str, size: float) -> str:
    parts = text.split("@")
    for k in range(1, len(parts), 2):
        part = parts[k]
        parts[k] = number_text(float(part[1:]) / size if part.startswith("/") else float(part) * size)
    return "".join(parts)


def make(name: str, obj: Optional[bpy.types.Object]) -> bpy.types.NodeTree:
    """Creates the tree of a preset for an object. Raises TreeError if the preset needs an object and none is given."""
    preset = PRESETS[name]
    if preset.needs_mesh and (obj is None or obj.type not in {"MESH", "CURVE", "SURFACE", "META", "FONT"}):
        raise TreeError("", f"'{preset.name}' needs a mesh: select a mesh object")
    size = max(obj.dimensions) if preset.needs_mesh and obj else 2.0
    if not size > 0:
        raise TreeError("", f"'{obj.name if obj else ''}' has zero size")

    def replace(tree: bpy.types.NodeTree, entry: scene_io.Entry) -> Optional[bpy.types.Node]:
        if entry["action"] == "read":
            node = tree.nodes.new(nodes.CurlewMeshObject.bl_idname)
            node.object = obj
            return node
        result = scene_io.as_results(tree, entry)
        if result:
            result.thickness = preset.thickness * size
        return result

    title = f"{preset.name}: {obj.name}" if preset.needs_mesh and obj else preset.name
    return scene_io.tree_of(_scaled(preset.text, size), title, replace)


class CURLEW_OT_quick(bpy.types.Operator):
    """Create a node tree from the preset for the active object, and bake it"""

    bl_idname = "curlew.quick"
    bl_label = "Make It Flow"
    bl_options = {"REGISTER", "UNDO"}
    __annotations__ = {
        "preset": bpy.props.EnumProperty(name="Preset", items=[(k, p.name, p.help) for k, p in PRESETS.items()]),
        "bake": bpy.props.BoolProperty(name="Bake", default=True),
    }

    def _run(self, context: bpy.types.Context, start: Callable[[str], Set[str]]) -> Set[str]:
        try:
            tree = make(self.preset, context.active_object)
        except TreeError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        context.scene.curlew_tree = tree.name
        return start(tree.name) if self.bake else {"FINISHED"}

    def execute(self, context: bpy.types.Context) -> Set[str]:
        """For scripts: returns when the tree is baked."""
        return self._run(context, lambda name: bpy.ops.curlew.bake(tree=name))

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Set[str]:
        """From the user interface: bakes in a thread."""

        def start(name: str) -> Set[str]:
            bpy.ops.curlew.bake("INVOKE_DEFAULT", tree=name)
            return {"FINISHED"}

        return self._run(context, start)


register, unregister = bpy.utils.register_classes_factory((CURLEW_OT_quick,))
