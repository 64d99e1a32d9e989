# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets: trees whose lengths are relative to the object's size."""

from dataclasses import dataclass
from typing import Dict, Optional, Set, Tuple

import bpy
import numpy as np

from . import bake, library, nodes, scene_io, shots, values
from .actions import TreeError, number_text
from .sources import MeshArrays, MeshSource, is_mesh, mesh_arrays

_KEY = "curlew_preset"  # custom property of a preset's tree
_SHORTEST, _LONGEST = 48, 150  # frames of a loop, if the scene's frames are a multiple of such a number


@dataclass(frozen=True)
class Preset:
    """A scene. @0.1@ is a tenth of the object's size, @/4@ is 4 divided by that size, and LOOP the
    seconds of a loop.
    Written files become results, and the file that is read becomes the object."""

    name: str
    help: str
    text: str = ""  # empty: the parts of a shot as groups, shots.example()
    needs_mesh: bool = True
    thickness: float = 0.004
    look: str = "POINTS"
    inside: bool = False  # whether the object hides the result
    seconds: float = 0.0  # run-up: what the emitter needs to fill the air

    def loops(self) -> bool:
        """Returns whether the frames repeat."""
        return "LOOP" in self.text

    def moves(self) -> bool:
        """Returns whether it is a sequence."""
        return "frames" in self.text or not self.text


PRESETS: Dict[str, Preset] = {
    "SWIRL": Preset(
        "Contained Swirl",
        "Particles that swirl inside the object, in a loop",
        """
        read object.ply
        mesh2ls dim=96
        noise frequency=@/2.2@ octaves=2 seed=1
        noise frequency=@/2.2@ octaves=2 seed=2
        bound layer=@0.06@
        dfvn speed=@0.35@
        scatter count=15000 seed=7
        frames 1-2
        advect loop=LOOP
        write particles.ply
        """,
        thickness=0.0022,
        look="STREAKS",
        inside=True,
    ),
    "WIND": Preset(
        "Wind Around the Object",
        "Streaks of a gusty wind that goes around the object",
        """
        read object.ply
        mesh2ls dim=80
        noise frequency=@/1.3@ octaves=2 seed=3
        wind direction=1,0,0 speed=@1@ gusts=0.4 layer=@0.3@ padding=@0.35@
        frames 1-2
        emit rate=6000 life=1.5 spread=0.5 seed=4
        advect
        write particles.ply
        """,
        thickness=0.0022,
        look="STREAKS",
        seconds=1.5,
    ),
    "WAKE": Preset(
        "Streamlines Around the Object",
        "Streamlines of a wind that goes around the object: a still",
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
        trace integrate=both maxLength=@2@
        write curves.obj
        """,
        thickness=0.003,
    ),
    "DUST": Preset(
        "Dust From the Surface",
        "Dust that a turbulent wind blows off the object in wisps",
        """
        read object.ply as=statue
        mesh2ls dim=96 as=body
        noise frequency=@/5@ octaves=2 seed=7 as=wisps
        noise frequency=@/2.6@ octaves=2 gain=0.6 seed=1 as=f
        frames 1-2
        noise frequency=@/2.6@ octaves=2 gain=0.6 seed=2 alpha={0.6*T} as=g0
        bound side=outside wall=body layer=@0.06@ noise=g0 as=g
        dfvn f=f g=g speed=@0.27@ padding=@1@ as=turbulence
        wind direction=1,0.1,0.2 speed=@0.7@ layer=@0.12@ padding=@1@ wall=body as=breeze
        superpose first=turbulence second=breeze as=air
        emit on=surface offset=@0.012@ domain=body flow=air density=wisps rate=26000 life=1.6 spread=0.6 seed=5 as=dust
        advect flow=air points=dust scheme=midpoint steps=1
        write particles.ply
        """,
        thickness=0.0021,
        seconds=1.6,
    ),
    "SURFACE": Preset(
        "Flow on the Skin",
        "Particles that run along the object's surface, in a loop",
        """
        read object.ply
        mesh2ls dim=128 as=body
        noise frequency=@/4@ octaves=2 seed=4 as=f
        ramp gradient=@/0.001@,0,0 value=1 as=one
        bound side=outside wall=body noise=one layer=@0.03@ amplitude=0 as=g
        dfvn f=f g=g speed=@0.04@ as=skin
        scatter domain=body on=surface offset=@0.003@ count=15000 seed=2
        frames 1-2
        advect flow=skin loop=LOOP
        write particles.ply
        """,
        thickness=0.002,
        look="STREAKS",
    ),
    "GLOBE": Preset(
        "Globe",
        "Winds on a globe, in a loop; needs no object",
        """
        sphere radius=1 as=ball
        noise frequency=1.4 octaves=2 seed=11 as=f
        ramp gradient=0.001,0,0 value=1 as=one
        bound side=outside wall=ball noise=one layer=0.05 amplitude=0 as=g
        dfvn f=f g=g speed=0.1 as=winds
        scatter domain=ball on=surface offset=0.006 count=20000 seed=3
        frames 1-2
        advect flow=winds loop=LOOP
        write particles.ply
        """,
        needs_mesh=False,
        thickness=0.0018,
        look="STREAKS",
    ),
    "SMOKE": Preset(
        "Smoke Around the Object",
        "Smoke that rises from the object and flows around it: a volume to render",
        """
        read object.ply as=statue
        mesh2ls dim=80 as=body
        noise frequency=@/3@ octaves=2 seed=7 as=wisps
        noise frequency=@/2@ octaves=2 seed=1 as=f
        frames 1-2
        noise frequency=@/2@ octaves=2 seed=2 alpha={0.5*T} as=g0
        bound side=outside wall=body layer=@0.08@ noise=g0 as=g
        dfvn f=f g=g speed=@0.28@ padding=@1.2@ as=turbulence
        wind direction=0,0,1 speed=@0.5@ layer=@0.25@ padding=@1.2@ wall=body as=rise
        superpose first=turbulence second=rise as=air
        emit on=surface domain=body flow=air density=wisps rate=4000 life=2.2 spread=0.4 seed=5 as=puffs
        advect flow=air points=puffs scheme=midpoint steps=1
        write particles.ply
        """,
        thickness=0.012,
        look="SMOKE",
        seconds=2.5,
    ),
    "SHOT": Preset(
        "Shot to Edit",
        "Emitter, collider, wind and turbulence as nodes to change; an arrow beside the object directs the wind",
        thickness=0.0022,
        look="STREAKS",
        seconds=1.5,
    ),
}


def _scaled(text: str, size: float) -> str:
    parts = text.split("@")
    for k in range(1, len(parts), 2):
        part = parts[k]
        parts[k] = number_text(float(part[1:]) / size if part.startswith("/") else float(part) * size)
    return "".join(parts)


def loop_frames(scene: bpy.types.Scene) -> int:
    """Returns the number of frames of a loop, which the scene's frames are a multiple of."""
    count = scene.frame_end - scene.frame_start + 1
    return next((n for n in range(min(count, _LONGEST), _SHORTEST, -1) if count % n == 0), count)


def _is_sheet(mesh: MeshArrays) -> bool:
    """Returns whether a mesh encloses nothing, like a plane or a cloth. Only asks the library if it is open."""
    ends = np.cumsum(mesh.sizes)
    following = np.arange(1, len(mesh.indices) + 1)
    following[ends - 1] = ends - mesh.sizes
    ends_of_edges = mesh.indices.astype(np.int64), mesh.indices[following].astype(np.int64)
    _, uses = np.unique(np.minimum(*ends_of_edges) * len(mesh.points) + np.maximum(*ends_of_edges), return_counts=True)
    if not (uses == 1).any():
        return False
    with library.Sessions().of("", {"sheet.ply": mesh}) as session:
        try:
            session.run("read sheet.ply\nmesh2ls dim=24\n")
        except library.curlew().Error as error:
            return "encloses nothing" in str(error)
    return False


def _measured(preset: Preset, obj: Optional[bpy.types.Object]) -> Tuple[float, bool]:
    """Returns the size of the object, and whether it is a sheet. Raises TreeError if it does not suit the preset."""
    if not preset.needs_mesh:
        return 2.0, False
    if not is_mesh(obj):
        raise TreeError("", f"'{preset.name}' needs a mesh: select a mesh object")
    mesh = mesh_arrays(MeshSource((obj,), False, ""), bpy.context.evaluated_depsgraph_get())
    size = float(np.ptp(mesh.points, axis=0).max())
    if not size > 0:
        raise TreeError("", f"'{obj.name}' has zero size")
    return size, _is_sheet(mesh)


def make(name: str, obj: Optional[bpy.types.Object], scene: Optional[bpy.types.Scene] = None) -> bpy.types.NodeTree:
    """Creates the tree of a preset for an object. Raises TreeError if the preset needs an object and none is given, or if
    the object does not suit it."""
    preset, scene = PRESETS[name], scene or bpy.context.scene
    size, sheet = _measured(preset, obj)
    fps = scene.render.fps / scene.render.fps_base

    def replace(tree: bpy.types.NodeTree, entry: scene_io.Entry) -> Optional[bpy.types.Node]:
        if entry["action"] == "read":
            node = tree.nodes.new(nodes.CurlewMeshObject.bl_idname)
            node.object = obj
            return node
        result = scene_io.as_results(tree, entry)
        if result:
            result.thickness = preset.thickness * size
            if result.kind == "points":
                result.look = preset.look
        return result

    title = f"{preset.name}: {obj.name}" if preset.needs_mesh and obj else preset.name
    if not preset.text:
        tree, result = shots.example(title, obj, size, scene)
        result.thickness, result.look = preset.thickness * size, preset.look
        return _finished(tree, name, fps)
    text = _scaled(preset.text, size).replace("LOOP", number_text(loop_frames(scene) / fps))
    tree = scene_io.tree_of(text, title, replace)
    for node in list(tree.nodes):
        if sheet and node.bl_idname == nodes.action_id("mesh2ls"):
            node.set_option("thickness", number_text((0.1 if preset.inside else 0.02) * size))
        elif node.bl_idname == nodes.action_id("frames"):
            if preset.loops():
                node.words = f"{scene.frame_start}-{scene.frame_start + loop_frames(scene) - 1}"
            else:
                tree.nodes.remove(node)  # the scene's frames
    return _finished(tree, name, fps)


def _finished(tree: bpy.types.NodeTree, name: str, fps: float) -> bpy.types.NodeTree:
    """Sets what all presets have."""
    preset = PRESETS[name]
    tree.use_fake_user = True
    tree.sequence, tree.repeat, tree.run_up = preset.moves(), preset.loops(), round(preset.seconds * fps)
    tree[_KEY] = name
    return tree


def _object_of(tree: bpy.types.NodeTree) -> Optional[bpy.types.Object]:
    """Returns the object of a preset's tree, which its first node with an object reads."""
    kinds = (nodes.CurlewMeshObject.bl_idname, values.CurlewObject.bl_idname)
    return next((node.object for node in tree.nodes if node.bl_idname in kinds), None)


def made_before(name: str, obj: Optional[bpy.types.Object]) -> Optional[bpy.types.NodeTree]:
    """Returns the tree that the button has made for this object."""
    if PRESETS[name].needs_mesh and obj is None:
        return None
    return next((tree for tree in bpy.data.node_groups if tree.bl_idname == nodes.TREE and tree.get(_KEY) == name
                 and (not PRESETS[name].needs_mesh or _object_of(tree) == obj)), None)


class CURLEW_OT_quick(bpy.types.Operator):
    """Create a node tree from the preset for the active object, and bake it. Pressed again, bake that tree again"""

    bl_idname = "curlew.quick"
    bl_label = "Make It Flow"
    bl_options = {"REGISTER", "UNDO"}
    __annotations__ = {
        "preset": bpy.props.EnumProperty(name="Preset", items=[(k, p.name, p.help) for k, p in PRESETS.items()]),
        "bake": bpy.props.BoolProperty(name="Bake", default=True),
    }

    def execute(self, context: bpy.types.Context) -> Set[str]:
        """For scripts: returns when the tree is baked."""
        return self._run(context, in_thread=False)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Set[str]:
        """From the user interface: bakes in a thread."""
        return self._run(context, in_thread=not bpy.app.background)

    def _run(self, context: bpy.types.Context, in_thread: bool) -> Set[str]:
        obj = context.active_object
        tree = made_before(self.preset, obj)
        is_new, before, objects = tree is None, context.scene.curlew_tree, set(bpy.data.objects)
        try:
            tree = tree or make(self.preset, obj, context.scene)
            context.scene.curlew_tree = tree.name
            if self.bake and in_thread:
                bpy.ops.curlew.bake("INVOKE_DEFAULT", tree=tree.name)
            elif self.bake:
                bake.bake(tree, context.scene)
        except (TreeError, RuntimeError) as error:  # an operator raises RuntimeError for its report of an error
            if is_new and tree:
                bpy.data.node_groups.remove(tree)
                bpy.data.batch_remove(set(bpy.data.objects) - objects)
                context.scene.curlew_tree = before
            self.report({"ERROR"}, str(error).strip().removeprefix("Error: "))
            return {"CANCELLED"}
        if PRESETS[self.preset].inside and obj and obj.display_type not in {"WIRE", "BOUNDS"}:
            obj.display_type = "WIRE"
            self.report({"INFO"}, f"'{obj.name}' is shown as wire, so that you see what is inside (Object > Viewport Display)")
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory((CURLEW_OT_quick,))
