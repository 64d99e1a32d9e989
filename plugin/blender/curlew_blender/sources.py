# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes, curves and transforms of the scene's objects in its frames."""

from dataclasses import dataclass, field, fields
from typing import Any, Dict, Generator, Iterator, List, Mapping, Optional, Sequence, Set, Tuple

import bpy
import numpy as np
from mathutils import Euler, Vector

from .actions import Action, TreeError, number_text


MESHES = frozenset({"MESH", "CURVE", "SURFACE", "META", "FONT"})  # types of objects with faces


@dataclass
class MeshSource:
    """Objects that are read as one mesh."""

    objects: Tuple[bpy.types.Object, ...]
    animated: bool  # read again in each frame of a sequence
    key: str  # key of the node
    guessed: bool = False  # read again in each frame only because it may change

    def arrays(self, depsgraph: bpy.types.Depsgraph) -> "ObjectArrays":
        """Returns the evaluated objects. Raises TreeError if they cannot be read."""
        return mesh_arrays(self, depsgraph)


class CurveSource(MeshSource):
    """One object whose edges are read as curves."""

    def arrays(self, depsgraph: bpy.types.Depsgraph) -> "ObjectArrays":
        return curve_arrays(self, depsgraph)


@dataclass
class Place:
    """An object whose transform a node uses."""

    object: bpy.types.Object
    action: Action
    arrow: str = ""  # option that is its z axis instead; "": its transform
    is_length: bool = False  # only the length of the axis


@dataclass
class ObjectArrays:
    """What is read from objects. Positions are in world space."""

    points: np.ndarray

    def all(self) -> List[np.ndarray]:
        """Returns all arrays."""
        return [getattr(self, about.name) for about in fields(self)]

    def same(self, other: "ObjectArrays") -> bool:
        """Returns whether all numbers are the same."""
        return all(map(np.array_equal, self.all(), other.all()))

    def provide(self, session: Any, name: str) -> None:
        """Provides them to a session of the library under this name."""
        raise NotImplementedError


@dataclass
class MeshArrays(ObjectArrays):
    """The vertex indices of all faces in sequence, and the number of vertices of each face."""

    indices: np.ndarray
    sizes: np.ndarray

    def provide(self, session: Any, name: str) -> None:
        session.provide_mesh(name, self.points, (self.indices, self.sizes))


@dataclass
class CurveArrays(ObjectArrays):
    """The two vertices of each edge."""

    edges: np.ndarray

    def provide(self, session: Any, name: str) -> None:
        session.provide_curves(name, self.points, self.edges)


def _world(evaluated: bpy.types.Object, place: Any) -> Optional[MeshArrays]:
    """Returns the faces of an evaluated object at a place; None if it has none."""
    mesh = evaluated.to_mesh()
    try:
        if mesh is None or not mesh.polygons:
            return None
        points = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", points)
        indices = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", indices)
        sizes = np.empty(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get("loop_total", sizes)
    finally:
        evaluated.to_mesh_clear()
    matrix = np.array(place, np.float64)
    world = _placed(points, matrix)
    if np.linalg.det(matrix[:3, :3]) < 0:  # mirrored: restores the orientation of the faces
        ends = np.cumsum(sizes)
        order = np.concatenate([np.arange(end - 1, end - size - 1, -1) for end, size in zip(ends, sizes)])
        indices = indices[order]
    return MeshArrays(world, indices, sizes)


def _placed(points: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Returns coordinates as (n, 3) positions in world space."""
    return np.ascontiguousarray(points.reshape(-1, 3).astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3], np.float32)


def curve_arrays(source: CurveSource, depsgraph: bpy.types.Depsgraph) -> CurveArrays:
    """Returns the edges of the evaluated object. Raises TreeError if it has none, or if it has faces."""
    obj, = source.objects
    evaluated = obj.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        if mesh and mesh.polygons:
            raise TreeError(source.key, f"'{obj.name}' has faces: turn off its bevel, extrusion and fill")
        if mesh is None or not mesh.edges:
            raise TreeError(source.key, f"'{obj.name}' has no curves")
        points = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", points)
        edges = np.empty(2 * len(mesh.edges), np.int32)
        mesh.edges.foreach_get("vertices", edges)
    finally:
        evaluated.to_mesh_clear()
    return CurveArrays(_placed(points, np.array(evaluated.matrix_world, np.float64)), edges.reshape(-1, 2))


def _has_instances(obj: bpy.types.Object) -> bool:
    return obj.instance_type != "NONE" or any(modifier.type == "NODES" for modifier in obj.modifiers)


def mesh_arrays(source: MeshSource, depsgraph: bpy.types.Depsgraph) -> MeshArrays:
    """Returns the evaluated objects with their instances. Raises TreeError if they have no faces."""
    parts = []
    for obj in source.objects:
        evaluated = obj.evaluated_get(depsgraph)
        parts += [_world(evaluated, evaluated.matrix_world)] if obj.type in MESHES else []
        for instance in depsgraph.object_instances if _has_instances(obj) else ():
            if instance.is_instance and instance.parent and instance.parent.original == obj and instance.object.type in MESHES:
                parts.append(_world(instance.object, instance.matrix_world))
    found = [part for part in parts if part]
    if not found:
        names = ", ".join(f"'{obj.name}'" for obj in source.objects)
        raise TreeError(source.key, f"{names} {'has' if len(source.objects) == 1 else 'have'} no faces")
    if len(found) == 1:
        return found[0]
    first = np.cumsum([0] + [len(part.points) for part in found[:-1]])
    return MeshArrays(np.concatenate([part.points for part in found]),
                      np.concatenate([part.indices + start for part, start in zip(found, first)]).astype(np.int32),
                      np.concatenate([part.sizes for part in found]))


def coarse(mesh: MeshArrays, cells: int) -> MeshArrays:
    """Returns a mesh with one vertex for each cell of a grid that has this number of cells along its longest edge."""
    lower = mesh.points.min(axis=0)
    size = max(float((mesh.points - lower).max()), 1e-30) / cells
    x, y, z = ((mesh.points - lower) / size).astype(np.int64).T
    _, first, cell = np.unique((x * (cells + 1) + y) * (cells + 1) + z, return_index=True, return_inverse=True)
    fans = mesh.sizes - 2  # the triangles of each face
    start = np.repeat(np.cumsum(mesh.sizes) - mesh.sizes, fans)
    within = np.arange(fans.sum()) - np.repeat(np.cumsum(fans) - fans, fans)
    a, b, c = (cell.reshape(-1)[mesh.indices[corner]] for corner in (start, start + within + 1, start + within + 2))
    kept = (a != b) & (b != c) & (c != a)
    triangles = np.stack([a[kept], b[kept], c[kept]], axis=1).astype(np.int32)
    return MeshArrays(mesh.points[first], triangles.reshape(-1), np.full(len(triangles), 3, np.int32))


def members(collection: Optional[bpy.types.Collection]) -> Tuple[bpy.types.Object, ...]:
    """Returns the objects of a collection that may have faces, without results of bakes."""
    return tuple(obj for obj in collection.all_objects if is_mesh(obj) and "curlew_kind" not in obj) if collection else ()


def is_mesh(obj: Optional[bpy.types.Object]) -> bool:
    """Returns whether an object may have faces, of its own or of its instances, as an empty that shows a collection."""
    return bool(obj) and (obj.type in MESHES or obj.instance_type == "COLLECTION")


def has_edges(obj: Optional[bpy.types.Object]) -> bool:
    """Returns whether an object may have edges without faces."""
    return bool(obj) and obj.type in {"CURVE", "MESH"}


# Modifiers that give the same mesh in every frame, unless their own options or objects are animated.
_STILL = frozenset("""ARRAY BEVEL BOOLEAN DECIMATE EDGE_SPLIT MASK MIRROR MULTIRES REMESH SCREW SKIN SOLIDIFY SUBSURF
    TRIANGULATE WELD WIREFRAME CAST CORRECTIVE_SMOOTH CURVE HOOK LAPLACIANDEFORM LAPLACIANSMOOTH LATTICE MESH_DEFORM
    SHRINKWRAP SIMPLE_DEFORM SMOOTH SURFACE_DEFORM WARP DATA_TRANSFER NORMAL_EDIT WEIGHTED_NORMAL UV_PROJECT UV_WARP
    VERTEX_WEIGHT_EDIT VERTEX_WEIGHT_MIX VERTEX_WEIGHT_PROXIMITY ARMATURE""".split())


def _is_animated(data: Optional[bpy.types.ID]) -> bool:
    about = getattr(data, "animation_data", None)
    return bool(about and (about.action or len(about.drivers) or any(track.strips for track in about.nla_tracks)))


def _objects_in(struct: bpy.types.bpy_struct) -> Iterator[bpy.types.Object]:
    """Yields the objects that a modifier or constraint uses."""
    for about in struct.bl_rna.properties:
        if about.type == "POINTER" and isinstance(getattr(struct, about.identifier, None), bpy.types.Object):
            yield getattr(struct, about.identifier)
    for target in getattr(struct, "targets", ()):  # of an armature constraint
        if target.target:
            yield target.target


def may_change(obj: bpy.types.Object, seen: Optional[Set[bpy.types.Object]] = None) -> bool:
    """Returns whether an object may have another shape or place in another frame: it, its data or something that it depends
    on is animated, or it has a modifier that depends on time."""
    seen = set() if seen is None else seen
    if obj in seen:
        return False
    seen.add(obj)
    if _is_animated(obj) or _is_animated(obj.data) or _is_animated(getattr(obj.data, "shape_keys", None)):
        return True
    if obj.rigid_body or any(modifier.type not in _STILL for modifier in obj.modifiers):
        return True
    bones = obj.pose.bones if obj.pose else ()
    used: List[Any] = [obj.parent] if obj.parent else []
    for part in (*obj.modifiers, *obj.constraints, *(constraint for bone in bones for constraint in bone.constraints)):
        if part.type in {"FOLLOW_PATH", "CAMERA_SOLVER", "FOLLOW_TRACK", "OBJECT_SOLVER", "TRANSFORM_CACHE"}:
            return True
        used += _objects_in(part)
    return any(may_change(other, seen) for other in used)


@dataclass
class Sampled:
    """Meshes and transforms in the requested frames."""

    meshes: Dict[str, ObjectArrays] = field(default_factory=dict)  # by file name
    options: Dict[str, Dict[str, str]] = field(default_factory=dict)  # by the key of a node
    still: Dict[str, str] = field(default_factory=dict)  # meshes that turned out to be the same in all frames: their names
                                                         # in `meshes`, by the name that the graph reads


def _in_frame(name: str, frame: int) -> str:
    return name.replace("$F4", f"{frame:04d}")


def _depsgraph(scene: bpy.types.Scene) -> bpy.types.Depsgraph:
    """Returns the evaluated dependency graph of a scene, which may not be the one in the window."""
    if bpy.context.scene == scene:
        return bpy.context.evaluated_depsgraph_get()
    scene.view_layers[0].update()
    return scene.view_layers[0].depsgraph


_Pose = Tuple[Tuple[float, ...], Euler, Tuple[float, ...]]


def sample(scene: bpy.types.Scene, meshes: Mapping[str, MeshSource], places: Mapping[Tuple[str, str], Place],
           frames: Optional[Sequence[int]], shift: int = 0,
           depsgraph: Optional[bpy.types.Depsgraph] = None) -> Generator[float, None, Sampled]:
    """Samples the objects in each frame, or in the current one if `frames` is None. Yields the progress after each frame,
    and returns the samples. Leaves the scene in the current frame, also if it is closed early. The transforms of moving
    objects become expressions of FF that are linear between frames. `shift`: what to subtract from a frame to get that of
    the scene. `depsgraph`: the dependency graph for the current frame; that of the scene if None. Raises TreeError if an object is invalid."""
    result = Sampled()
    poses: Dict[Tuple[str, str], List[_Pose]] = {key: [] for key in places}
    moving = frames is not None and (any(m.animated for m in meshes.values()) or bool(places))
    now = scene.frame_current
    seen = frames if moving and frames else [now]
    last: Dict[str, ObjectArrays] = {}
    changes: Dict[str, int] = {}
    try:
        for k, frame in enumerate(seen):
            if moving:
                scene.frame_set(frame - shift)
            graph = depsgraph if depsgraph and not moving else _depsgraph(scene)
            for name, mesh in meshes.items():
                if mesh.animated or k == 0:
                    arrays = mesh.arrays(graph)
                    if name not in last or not arrays.same(last[name]):  # otherwise both frames share the memory
                        changes[name] = changes.get(name, 0) + 1
                        last[name] = arrays
                    result.meshes[_in_frame(name, frame)] = last[name]
            for key, place in places.items():
                poses[key].append(_pose(place, graph, poses[key]))
            if moving:
                yield (k + 1) / len(seen)
    finally:
        if moving:
            scene.frame_set(now)
    for name in [name for name, mesh in meshes.items() if mesh.animated and mesh.guessed and changes[name] == 1]:
        for frame in seen:
            del result.meshes[_in_frame(name, frame)]
        result.still[name] = name.replace("$F4", "still")
        result.meshes[result.still[name]] = last[name]
    for key, place in places.items():
        result.options.setdefault(key[0], {}).update(_options(key[0], place, poses[key], frames or [now]))
    return result


def _pose(place: Place, depsgraph: bpy.types.Depsgraph, before: Sequence[_Pose]) -> _Pose:
    location, rotation, scale = place.object.evaluated_get(depsgraph).matrix_world.decompose()
    euler = rotation.to_euler("XYZ", before[-1][1]) if before else rotation.to_euler("XYZ")
    return tuple(location), euler, tuple(scale)


def _options(key: str, place: Place, poses: Sequence[_Pose], frames: Sequence[int]) -> Dict[str, str]:
    options: Dict[str, str] = {}
    if place.arrow:
        ends = [tuple(pose[1].to_matrix() @ Vector((0, 0, pose[2][2]))) for pose in poses]
        values = [(pose[2][2],) for pose in poses] if place.is_length else ends
        return {place.arrow: ",".join(in_time([v[axis] for v in values], frames) for axis in range(len(values[0])))}
    columns: Dict[str, List[Tuple[float, ...]]] = {
        "translate": [pose[0] for pose in poses],
        "rotate": [tuple(np.degrees(pose[1])) for pose in poses],
        "scale": [pose[2] for pose in poses],
    }
    for name, values in columns.items():
        if not place.action.has(name):
            continue
        if place.action.option(name).type == "real":  # uniform scale
            if any(max(v) - min(v) > 1e-4 * max(v) for v in values):
                raise TreeError(key, f"the scale of '{place.object.name}' differs between its axes; make it uniform")
            values = [v[:1] for v in values]
        text = ",".join(in_time([v[axis] for v in values], frames) for axis in range(len(values[0])))
        if text not in ("0,0,0", "1", "1,1,1"):
            options[name] = text
    return options


def in_time(values: Sequence[float], frames: Sequence[int], whole: bool = False) -> str:
    """Returns a number if all values are equal, otherwise an expression that interpolates linearly between frames, or
    jumps if `whole`."""
    rounded = [float(number_text(0.0 if abs(v) < 1e-7 else v)) for v in values]
    if all(v == rounded[0] for v in rounded):
        return number_text(rounded[0])
    text = number_text(rounded[-1])
    for k in range(len(rounded) - 2, -1, -1):
        slope = 0.0 if whole else (rounded[k + 1] - rounded[k]) / (frames[k + 1] - frames[k])
        since = f"max(FF-{frames[k]},0)" if k == 0 else f"(FF-{frames[k]})"
        piece = number_text(rounded[k]) + (f"+{slope:.7g}*{since}" if slope else "")
        text = f"FF<{frames[k + 1]}?{piece}:({text})"
    return "{" + text.replace("+-", "-") + "}"
