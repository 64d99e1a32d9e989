# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes and transforms of the scene's objects in its frames."""

from dataclasses import dataclass, field
from typing import Dict, List, Mapping, Optional, Sequence, Tuple

import bpy
import numpy as np
from mathutils import Euler

from .actions import Action, TreeError, number_text


@dataclass
class MeshSource:
    """An object that is read as a mesh."""

    object: bpy.types.Object
    animated: bool
    key: str  # key of the node


@dataclass
class Place:
    """An object whose transform a node uses."""

    object: bpy.types.Object
    action: Action


@dataclass
class MeshArrays:
    """The vertex indices of all faces in sequence, and the number of vertices of each face. Positions are in world
    space."""

    points: np.ndarray
    indices: np.ndarray
    sizes: np.ndarray

    def same(self, other: "MeshArrays") -> bool:
        """Returns whether all numbers are the same."""
        return all(np.array_equal(getattr(self, name), getattr(other, name)) for name in ("points", "indices", "sizes"))


def mesh_arrays(source: MeshSource, depsgraph: bpy.types.Depsgraph) -> MeshArrays:
    """Returns the evaluated object. Raises TreeError if it has no faces."""
    evaluated = source.object.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        if mesh is None or not mesh.polygons:
            raise TreeError(source.key, f"'{source.object.name}' has no faces")
        points = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", points)
        indices = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", indices)
        sizes = np.empty(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get("loop_total", sizes)
    finally:
        evaluated.to_mesh_clear()
    matrix = np.array(evaluated.matrix_world, np.float64)
    world = points.reshape(-1, 3).astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    if np.linalg.det(matrix[:3, :3]) < 0:  # mirrored: restores the orientation of the faces
        ends = np.cumsum(sizes)
        order = np.concatenate([np.arange(end - 1, end - size - 1, -1) for end, size in zip(ends, sizes)])
        indices = indices[order]
    return MeshArrays(np.ascontiguousarray(world, np.float32), indices, sizes)


@dataclass
class Sampled:
    """Meshes and transforms in the requested frames."""

    meshes: Dict[str, MeshArrays] = field(default_factory=dict)  # by file name
    options: Dict[str, Dict[str, str]] = field(default_factory=dict)  # by the key of a node


_Pose = Tuple[Tuple[float, ...], Euler, Tuple[float, ...]]


def sample(scene: bpy.types.Scene, meshes: Mapping[str, MeshSource], places: Mapping[str, Place],
           frames: Optional[Sequence[int]], depsgraph: Optional[bpy.types.Depsgraph] = None) -> Sampled:
    """Samples the objects in each frame, or in the current one if `frames` is None. The transforms of moving objects
    become expressions of FF that are linear between frames. `depsgraph`: the dependency graph for the current frame;
    the context's if None. Raises TreeError if an object is invalid."""
    result = Sampled()
    poses: Dict[str, List[_Pose]] = {key: [] for key in places}
    moving = frames is not None and (any(m.animated for m in meshes.values()) or bool(places))
    now = scene.frame_current
    for k, frame in enumerate(frames if moving and frames else [now]):
        if moving:
            scene.frame_set(frame)
        graph = depsgraph if depsgraph and not moving else bpy.context.evaluated_depsgraph_get()
        for name, mesh in meshes.items():
            if mesh.animated or k == 0:
                result.meshes[name.replace("$F4", f"{frame:04d}")] = mesh_arrays(mesh, graph)
        for key, place in places.items():
            poses[key].append(_pose(place, graph, poses[key]))
    if moving:
        scene.frame_set(now)
    for key, place in places.items():
        result.options[key] = _options(key, place, poses[key], frames or [now])
    return result


def _pose(place: Place, depsgraph: bpy.types.Depsgraph, before: Sequence[_Pose]) -> _Pose:
    location, rotation, scale = place.object.evaluated_get(depsgraph).matrix_world.decompose()
    euler = rotation.to_euler("XYZ", before[-1][1]) if before else rotation.to_euler("XYZ")
    return tuple(location), euler, tuple(scale)


def _options(key: str, place: Place, poses: Sequence[_Pose], frames: Sequence[int]) -> Dict[str, str]:
    options: Dict[str, str] = {}
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
