# SPDX-License-Identifier: GPL-3.0-or-later
"""The results of a bake as objects: volumes, particles, curves and meshes."""

from pathlib import Path
from typing import Any, Dict, Optional, Sequence

import bpy
import numpy as np

from . import cache, handlers, looks
from .main_thread import in_main_thread

Arrays = Dict[str, np.ndarray]


def points_arrays(points: Any) -> Arrays:
    """Returns the arrays to store for a session's points. Those that die fade in and out."""
    fades = points.fades
    if points.lives is not None and points.ages is not None:
        with np.errstate(divide="ignore", invalid="ignore"):
            lived = np.where(np.isfinite(points.lives), points.ages / points.lives, 0.5)
        born_and_dying = np.clip(np.minimum(lived / _FADES[0], (1.0 - lived) / _FADES[1]), 0.0, 1.0)
        fades = born_and_dying if fades is None else fades * born_and_dying
    arrays = {
        "position": (points.positions, np.float32),
        "id": (points.ids, np.int32),
        "velocity": (points.velocities, np.float32),
        "age": (points.ages, np.float32),
        "fade": (fades, np.float32),
    }
    return {name: np.ascontiguousarray(array, kind) for name, (array, kind) in arrays.items() if array is not None}


def curves_arrays(curves: Any) -> Arrays:
    """Returns the arrays to store for a session's curves."""
    return {
        "position": np.ascontiguousarray(curves.vertices, np.float32),
        "offsets": np.ascontiguousarray(curves.offsets, np.int64),
        "closed": np.ascontiguousarray(curves.closed, bool),
        "velocity": np.ascontiguousarray(curves.velocities, np.float32),
    }


def mesh_arrays(mesh: Any) -> Arrays:
    """Returns the arrays to store for a session's mesh."""
    faces = (mesh.triangles, mesh.quads)
    return {
        "position": np.ascontiguousarray(mesh.points, np.float32),
        "indices": np.concatenate([np.asarray(f, np.int32).reshape(-1) for f in faces]),
        "sizes": np.concatenate([np.full(len(f), corners, np.int32) for f, corners in zip(faces, (3, 4))]),
    }


ARRAYS = {"points": points_arrays, "curves": curves_arrays, "mesh": mesh_arrays}
_FADES = (0.1, 0.25)  # parts of a life in which a point appears, and disappears
_FEWEST = 4  # minimum number of vertices of a curve that is shown
_ATTRIBUTES = (("id", "INT", "value"), ("velocity", "FLOAT_VECTOR", "vector"), ("age", "FLOAT", "value"),
               ("fade", "FLOAT", "value"))


def _positions(mesh: bpy.types.Mesh, positions: np.ndarray) -> None:
    flat = positions.reshape(-1)
    if bpy.app.version >= (4, 0, 0):
        mesh.attributes["position"].data.foreach_set("vector", flat)
    else:
        mesh.vertices.foreach_set("co", flat)


def show_points(mesh: bpy.types.Mesh, arrays: Arrays) -> None:
    """Shows points as vertices with the attributes id, velocity and age, if the points have them, and fade, which is 1
    by default."""
    positions = arrays["position"]
    arrays = {"fade": np.ones(len(positions), np.float32), **arrays}
    names = {name for name, _, _ in _ATTRIBUTES if name in arrays}
    has = {a.name for a in mesh.attributes} & {name for name, _, _ in _ATTRIBUTES}
    if len(mesh.vertices) != len(positions) or mesh.edges or has != names:
        mesh.clear_geometry()
        mesh.vertices.add(len(positions))
        for name, kind, _ in _ATTRIBUTES:
            if name in arrays:
                mesh.attributes.new(name, kind, "POINT")
    _positions(mesh, positions)
    for name, _, part in _ATTRIBUTES:
        if name in arrays and len(positions):
            mesh.attributes[name].data.foreach_set(part, arrays[name].reshape(-1))
    mesh.update_tag()


def show_mesh(mesh: bpy.types.Mesh, arrays: Arrays) -> None:
    """Shows a mesh: vertices and faces."""
    sizes = arrays["sizes"]
    mesh.clear_geometry()
    mesh.vertices.add(len(arrays["position"]))
    mesh.loops.add(len(arrays["indices"]))
    mesh.polygons.add(len(sizes))
    _positions(mesh, arrays["position"])
    mesh.loops.foreach_set("vertex_index", arrays["indices"])
    mesh.polygons.foreach_set("loop_start", np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int32))
    if bpy.app.version < (4, 1, 0):
        mesh.polygons.foreach_set("loop_total", sizes)
    mesh.polygons.foreach_set("use_smooth", np.ones(len(sizes), bool))
    mesh.update(calc_edges=True)


def show_curves(curve: bpy.types.Curve, arrays: Arrays) -> None:
    """Shows each curve with enough vertices as a poly spline. Its material slot is selected by its speed."""
    curve.splines.clear()
    curve.dimensions = "3D"
    curve.fill_mode = "FULL"
    offsets = arrays["offsets"]
    speeds = np.linalg.norm(arrays["velocity"], axis=1)
    fast = fastest(arrays)
    for begin, end, closed in zip(offsets[:-1], offsets[1:], arrays["closed"]):
        if end - begin < _FEWEST:
            continue
        spline = curve.splines.new("POLY")
        spline.material_index = int(min(float(speeds[begin:end].mean()) / fast, 0.999) * looks.CURVE_COLORS)
        spline.points.add(int(end - begin) - 1)
        points = np.ones((int(end - begin), 4), np.float32)
        points[:, :3] = arrays["position"][begin:end]
        spline.points.foreach_set("co", points.reshape(-1))
        spline.use_cyclic_u = bool(closed)
    curve.update_tag()


def show(obj: bpy.types.Object, arrays: Arrays) -> None:
    """Shows arrays in an object of the matching kind."""
    {"points": show_points, "curves": show_curves, "mesh": show_mesh}[obj["curlew_kind"]](obj.data, arrays)


def _link(obj: bpy.types.Object, scene: bpy.types.Scene) -> None:
    if not obj.users_collection:
        scene.collection.objects.link(obj)


def target_of(node: bpy.types.Node, scene: bpy.types.Scene) -> bpy.types.Object:
    """Returns the object of a result node; creates it if it is missing or of another kind."""
    wanted = {"grid": "VOLUME", "points": "MESH", "curves": "CURVE", "mesh": "MESH"}[node.kind]
    obj = node.target
    name = node.label or f"{node.id_data.name} {node.bl_label.split(' ')[0]}"
    if obj is None or obj.type != wanted or obj.get("curlew_kind", node.kind) != node.kind:
        data = {"VOLUME": bpy.data.volumes, "CURVE": None, "MESH": bpy.data.meshes}[wanted]
        made = data.new(name) if data is not None else bpy.data.curves.new(name, "CURVE")
        obj = bpy.data.objects.new(name, made)
        node.target = obj
    obj["curlew_kind"] = node.kind
    _link(obj, scene)
    return obj


def lock_interface(scene: bpy.types.Scene) -> None:
    """Locks the interface during renders, as Blender advises for objects that a handler changes with the frame."""
    if not scene.render.use_lock_interface:
        scene.render.use_lock_interface = True


def show_result(node: bpy.types.Node, file: Path, frames: Optional[Sequence[int]], scene: bpy.types.Scene,
                shift: int = 0) -> None:
    """Shows the result of a bake for a result node: a file, or one file per frame with `$F4` in its name. `shift`: what to
    subtract from the number of a volume's file to get its frame. Raises RuntimeError if a volume cannot be read."""
    if node.kind == "grid":
        volume(node, file, frames, scene, shift)
    else:
        geometry(node, file, frames, scene)
    if frames:
        lock_interface(scene)


def volume(node: bpy.types.Node, file: Path, frames: Optional[Sequence[int]], scene: bpy.types.Scene,
           shift: int = 0) -> bpy.types.Object:
    """Returns the volume object of a file, or of one file per frame with `$F4` in its name. Velocities are per
    second."""
    obj = target_of(node, scene)
    data = obj.data
    first = str(file).replace("$F4", f"{frames[0] + shift:04d}") if frames else str(file)
    data.filepath = cache.stored(Path(first))
    data.is_sequence = False
    if not cache.load_grids(data):
        raise RuntimeError(f"'{first}': {data.grids.error_message}")
    vectors = [grid.name for grid in data.grids if grid.data_type.startswith("VECTOR")]
    if vectors:
        data.velocity_grid = vectors[0]
    data.velocity_unit = "SECOND"
    data.velocity_scale = 1.0
    if frames:
        data.is_sequence = True
        data.frame_start = frames[0]
        data.frame_duration = frames[-1] - frames[0] + 1
        data.frame_offset = frames[0] + shift - 1  # otherwise the first file would be number 1
        data.sequence_mode = "REPEAT" if node.id_data.repeat else "EXTEND"
    if not data.materials:
        data.materials.append(looks.volume_material())
    return obj


def geometry(node: bpy.types.Node, pattern: Path, frames: Optional[Sequence[int]],
             scene: bpy.types.Scene) -> bpy.types.Object:
    """Returns the object for points, curves or a mesh from a bake."""
    obj = target_of(node, scene)
    obj["curlew_cache"] = cache.stored(pattern)
    obj["curlew_frames"] = [frames[0], frames[-1]] if frames else []
    obj["curlew_repeat"] = bool(frames and node.id_data.repeat)
    obj["curlew_step"] = frames[1] - frames[0] if frames and len(frames) > 1 else 1
    if not obj.data.materials and node.kind != "points":
        for material in looks.curve_materials() if node.kind == "curves" else [looks.surface_material()]:
            obj.data.materials.append(material)
    arrays = _of_frame(obj, scene.frame_current)
    if arrays is not None:
        show(obj, arrays)
    if node.kind == "points":
        looks.particles(obj, node.thickness, fastest(arrays), node.look)
    elif node.kind == "curves":
        obj.data.bevel_depth = node.thickness
        obj.data.bevel_resolution = 2
    return obj


def empty(obj: bpy.types.Object) -> None:
    """Empties the object of a bake."""
    for name in ("curlew_cache", "curlew_frames"):
        obj.pop(name, None)
    if obj.type == "VOLUME":
        obj.data.filepath = ""
    elif obj.type == "CURVE":
        obj.data.splines.clear()
    elif obj.type == "MESH":
        obj.data.clear_geometry()


def fastest(arrays: Optional[Arrays]) -> float:
    """Returns the speed that counts as fast; very few particles are faster."""
    if arrays is None or "velocity" not in arrays or not len(arrays["velocity"]):
        return 1.0
    return float(np.percentile(np.linalg.norm(arrays["velocity"], axis=1), 98)) or 1.0


def _of_frame(obj: bpy.types.Object, frame: int) -> Optional[Arrays]:
    """Returns the arrays that the object shows in a frame: those of the last frame of its range that is not later, or of
    the first frame. If it repeats, its range goes on forever. Returns None if the files no longer exist."""
    frames = list(obj.get("curlew_frames", []))
    path = cache.absolute(obj["curlew_cache"])
    if frames:
        since = min(max(frame, frames[0]), frames[1]) - frames[0]
        if obj.get("curlew_repeat"):
            since = (frame - frames[0]) % (frames[1] - frames[0] + 1)
        shown = frames[0] + since - since % max(1, int(obj.get("curlew_step", 1)))
        path = path.with_name(path.name.replace("$F4", f"{shown:04d}"))
    return cache.load(path) if path.exists() else None


@bpy.app.handlers.persistent
@in_main_thread
def on_frame(scene: bpy.types.Scene, depsgraph: Optional[bpy.types.Depsgraph] = None) -> None:
    """Shows the results that were baked for the frame."""
    for obj in bpy.data.objects:
        if "curlew_cache" in obj and len(obj.get("curlew_frames", [])) == 2:
            arrays = _of_frame(obj, scene.frame_current)
            if arrays is not None:
                show(obj, arrays)


# After an undo, the objects hold what they showed when the step was made, which may be another frame.
register, unregister = handlers.factory(*((name, on_frame) for name in ("frame_change_post", "undo_post", "redo_post")))
