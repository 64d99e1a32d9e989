# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes and places of the scene's objects, at its frames."""

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
    key: str  # of its node


@dataclass
class Place:
    """An object whose place a node takes."""

    object: bpy.types.Object
    action: Action


@dataclass
class MeshArrays:
    """Corners of faces in a row, and how many each face has. Positions are in the world."""

    points: np.ndarray
    indices: np.ndarray
    sizes: np.ndarray

    def same(self, other: "MeshArrays") -> bool:
        """Whether all numbers are."""
        return all(np.array_equal(getattr(self, name), getattr(other, name)) for name in ("points", "indices", "sizes"))


def mesh_arrays(source: MeshSource, depsgraph: bpy.types.Depsgraph) -> MeshArrays:
    """The object as it is evaluated. Throws TreeError where it has no faces."""
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
    if np.linalg.det(matrix[:3, :3]) < 0:  # mirrored: what was counterclockwise no longer is
        ends = np.cumsum(sizes)
        order = np.concatenate([np.arange(end - 1, end - size - 1, -1) for end, size in zip(ends, sizes)])
        indices = indices[order]
    return MeshArrays(np.ascontiguousarray(world, np.float32), indices, sizes)


@dataclass
class Sampled:
    """Meshes and places at the wanted frames."""

    meshes: Dict[str, MeshArrays] = field(default_factory=dict)  # by file name
    options: Dict[str, Dict[str, str]] = field(default_factory=dict)  # by the key of a node


_Pose = Tuple[Tuple[float, ...], Euler, Tuple[float, ...]]


def sample(scene: bpy.types.Scene, meshes: Mapping[str, MeshSource], places: Mapping[str, Place],
           frames: Optional[Sequence[int]], depsgraph: Optional[bpy.types.Depsgraph] = None) -> Sampled:
    """What the objects are in each frame, or now. Objects that move make expressions of FF that are linear between frames.
    `depsgraph`: the one to ask if it is about now; without one that of the context. Throws TreeError."""
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
        "offset": [pose[0] for pose in poses],
        "rotate": [tuple(np.degrees(pose[1])) for pose in poses],
        "scale": [pose[2] for pose in poses],
    }
    for name, values in columns.items():
        if not place.action.has(name):
            continue
        if place.action.option(name).type == "real":  # one scale for all axes
            if any(max(v) - min(v) > 1e-4 * max(v) for v in values):
                raise TreeError(key, f"the scale of '{place.object.name}' differs between axes")
            values = [v[:1] for v in values]
        text = ",".join(in_time([v[axis] for v in values], frames) for axis in range(len(values[0])))
        if text not in ("0,0,0", "1", "1,1,1"):
            options[name] = text
    return options


def in_time(values: Sequence[float], frames: Sequence[int], whole: bool = False) -> str:
    """One number, or an expression that goes from one to the next; whole numbers jump."""
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
