# SPDX-License-Identifier: Apache-2.0
"""The objects of a session: data as NumPy arrays, and fields and flows that can be evaluated."""

import ctypes
import json
from dataclasses import dataclass
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from . import _calls
from . import _library as lib


@dataclass
class Points:
    """Points. Each array has one entry per point."""

    positions: np.ndarray  #: (n, 3) float64, world units; (n, 4) to (n, 7) in more dimensions
    ids: np.ndarray  #: (n,) int64, constant during a point's life
    velocities: Optional[np.ndarray] = None  #: (n, 3) float32, world units per second
    ages: Optional[np.ndarray] = None  #: (n,) float32, seconds
    lives: Optional[np.ndarray] = None  #: (n,) float32, the age at which the point dies; infinite: never
    tracks: Optional[np.ndarray] = None  #: (n, 2) float64, the values of f and g that the point keeps
    fades: Optional[np.ndarray] = None  #: (n,) float32, visibility from 0 to 1

    def __len__(self) -> int:
        return len(self.positions)


@dataclass
class Curves:
    """Polylines: curve k has the vertices offsets[k] to offsets[k + 1] - 1."""

    vertices: np.ndarray  #: (n, 3) float64, world units
    offsets: np.ndarray  #: (k + 1,) int64
    closed: np.ndarray  #: (k,) bool, whether an edge connects the last vertex to the first
    ids: np.ndarray  #: (k,) int64, ids of the seeds
    lengths: np.ndarray  #: (k,) float64, world units
    velocities: np.ndarray  #: (n, 3) float32, velocity of the flow at the vertices, world units per second
    along: np.ndarray  #: (n,) float64, distance or time from the seed, in world units or seconds
    tracks: Optional[np.ndarray] = None  #: (n, 2) float64, f and g at the vertices

    def __len__(self) -> int:
        return len(self.closed)


@dataclass
class Mesh:
    """A surface of triangles and quads."""

    points: np.ndarray  #: (n, 3) float32, world units
    triangles: np.ndarray  #: (m, 3) int32
    quads: np.ndarray  #: (q, 4) int32
    normals: Optional[np.ndarray] = None  #: (n, 3) float32, a unit normal for each point
    uvs: Optional[np.ndarray] = None  #: (n, 2) float32, texture coordinates of each point

    @property
    def faces(self) -> List[Tuple[int, ...]]:
        """The vertex indices of each face: triangles first, then quads."""
        return [tuple(face) for face in self.triangles.tolist() + self.quads.tolist()]


@dataclass
class Image:
    """An image, with rows from top to bottom. NaN marks pixels without a value."""

    pixels: np.ndarray  #: (h, w, c) float32
    channels: List[str]  #: c channel names


class Field:
    """A scalar field. Immutable; may be shared between threads."""

    def __init__(self, handle: Any, failures: _calls.Failures) -> None:
        self._handle, self._failures = handle, failures
        self.dimension: int = lib.library().curlew_field_dimension(handle)  #: 1 to 7

    def __del__(self) -> None:
        lib.library().curlew_field_release(self._handle)

    def value(self, positions: Any) -> np.ndarray:
        """Returns the values (n,) at positions (n, d).

        Positions have as many coordinates as the field has dimensions, or 3 if it has fewer. The results are float32
        for float32 positions, otherwise float64. They are NaN at positions that are not finite.
        """
        return _evaluated("field", self, positions, lambda d: (1, None))[0]

    def gradient(self, positions: Any) -> np.ndarray:
        """Returns the gradients (n, d) at positions (n, d)."""
        return _evaluated("field", self, positions, lambda d: (None, d))[1]

    def value_and_gradient(self, positions: Any) -> Tuple[np.ndarray, np.ndarray]:
        """Returns the values and the gradients, for little more than the cost of the gradients."""
        return _evaluated("field", self, positions, lambda d: (1, d))


class Flow:
    """A flow: a velocity field made from scalar fields. Immutable; may be shared between threads."""

    def __init__(self, handle: Any, about: Dict[str, Any], failures: _calls.Failures) -> None:
        self._handle, self._failures = handle, failures
        self.dimension: int = about["dimension"]  #: 2 to 7
        self.has_tracks: bool = about["tracks"]  #: whether fields() are constant along streamlines
        self.divergence_free: bool = about["divergence_free"]
        self.lower = np.array(about["lower"])  #: (d,) lower corner of the domain's box
        self.upper = np.array(about["upper"])  #: (d,) upper corner of the domain's box

    def __del__(self) -> None:
        lib.library().curlew_flow_release(self._handle)

    def velocity(self, positions: Any) -> np.ndarray:
        """Returns the velocities (n, d) at positions (n, d), in world units per second; see Field.value()."""
        return _evaluated("flow", self, positions, lambda d: (d, None))[0]

    def fields(self, positions: Any) -> np.ndarray:
        """Returns the potentials (n, d - 1) at positions (n, d): f and g in 3D. Raises Error if the flow is a sum of
        flows."""
        return _evaluated("flow", self, positions, lambda d: (None, d - 1))[1]

    def velocity_and_fields(self, positions: Any) -> Tuple[np.ndarray, np.ndarray]:
        """Returns the velocities and the potentials, for the cost of the velocities."""
        return _evaluated("flow", self, positions, lambda d: (d, d - 1))


def _evaluated(kind: str, what: Any, positions: Any, components: Any) -> Tuple[Any, Any]:
    given = lib.numbers(positions, "positions")
    in_space = what.dimension < 3 and given.ndim == 2 and given.shape[1] == 3
    dimension = 3 if in_space else what.dimension
    points = lib.usable(given, dimension, "positions")
    made = [
        None if c is None else np.empty((len(points),) if kind == "field" and k == 0 else (len(points), c), points.dtype)
        for k, c in enumerate(components(dimension))
    ]
    views = [None if array is None else lib.array_of(array) for array in made]
    with _calls.ctrl_c_waits():
        _calls.call(what._failures, f"{kind}_evaluate", what._handle, lib.array_of(points), *views)
    return made[0], made[1]


_VALUES: Dict[str, Tuple[Any, Tuple[int, ...]]] = {  # type and shape of a voxel's value
    "float": (np.dtype(np.float32), ()),
    "double": (np.dtype(np.float64), ()),
    "int32": (np.dtype(np.int32), ()),
    "int64": (np.dtype(np.int64), ()),
    "vec3s": (np.dtype(np.float32), (3,)),
    "vec3d": (np.dtype(np.float64), (3,)),
}


class Leaf(NamedTuple):
    """A leaf node of a grid: a block of 8 x 8 x 8 voxels in order of increasing indices."""

    origin: Tuple[int, int, int]  #: indices of the first voxel
    values: np.ndarray  #: (8, 8, 8) or (8, 8, 8, 3), indexed by x, y, z: a read-only view of the grid
    active: np.ndarray  #: (8, 8, 8) bool, whether a voxel is active


class Grid:
    """A sparse grid of a session.

    Can be read until the session runs again or is closed; in on_frame, until that returns. After that, its methods
    raise Error, and views of its leaves must not be used.
    """

    def __init__(self, session: Any, position: int) -> None:
        self._session, self._position, self._turn = session, position, session.turns
        self.about: Dict[str, Any] = Reader(session.handle, lib.GRID, position).about
        self.name: str = self.about["name"]
        self.type: str = self.about["type"]  #: "float", "vec3s", …
        self.grid_class: str = self.about["class"]  #: "level set", "fog volume", "staggered", …
        self.voxel_size = np.array(self.about["voxel_size"])  #: (3,) world units
        self.lower = tuple(self.about["lower"])  #: lower corner of the active voxels' bounding box, in index space
        self.upper = tuple(self.about["upper"])  #: upper corner, exclusive
        self.transform = np.array(self.about["transform"])  #: (4, 4): transform @ (i, j, k, 1) is (x, y, z, 1)
        self._dtype, self._shape = _VALUES.get(self.about["value_type"], (np.dtype(np.float64), ()))

    def _open(self) -> Any:
        if self._session.turns != self._turn:
            raise lib.Error(f"the session has gone on since it returned the grid '{self.name}'; get the grid again")
        return self._session.handle

    def array(self, lower: Optional[Sequence[int]] = None, upper: Optional[Sequence[int]] = None) -> np.ndarray:
        """Returns the values in a box of voxels: (x, y, z), or (x, y, z, 3) for vectors.

        Args:
            lower: the indices of the first voxel; the lower corner of the active voxels' box if None.
            upper: the indices after the last voxel; the upper corner of the active voxels' box if None.
        """
        low = self.lower if lower is None else tuple(lower)
        high = self.upper if upper is None else tuple(upper)
        size = tuple(max(0, int(b) - int(a)) for a, b in zip(low, high))
        values = np.empty((int(np.prod(size)), *self._shape), self._dtype)
        session = self._open()
        if len(values):
            lib.call("grid_read", session, self._position, lib.triple(low), lib.triple(high), lib.array_of(values))
        return values.reshape(*size, *self._shape)

    def leaves(self) -> Iterator[Leaf]:
        """Iterates over the leaf nodes without copying: `for origin, values, active in grid.leaves()`.

        The values are views of the grid's memory, valid as long as the grid can be read. Copy what is needed longer.
        """
        count = lib.c_int64()
        lib.call("grid_leaves", self._open(), self._position, lib.byref(count))
        origin, values, bits = lib.triple(), lib.c_void_p(), lib.c_void_p()
        size = 512 * int(np.prod(self._shape, dtype=int)) * self._dtype.itemsize
        for k in range(count.value):
            lib.call("grid_leaf", self._open(), self._position, k, origin, lib.byref(values), lib.byref(bits))
            active = np.unpackbits(self._memory(bits, 64).view(np.uint8), bitorder="little").reshape(8, 8, 8)
            block = self._memory(values, size).view(self._dtype).reshape(8, 8, 8, *self._shape)
            yield Leaf((origin[0], origin[1], origin[2]), block, active.astype(bool))

    def _memory(self, address: Any, size: int) -> np.ndarray:
        memory = (ctypes.c_uint8 * size).from_address(address.value)
        memory.kept = self._session  # keeps the session alive as long as the view
        array = np.frombuffer(memory, np.uint8)
        array.flags.writeable = False
        return array


_DTYPES = {"float32": np.float32, "float64": np.float64, "int32": np.int32, "int64": np.int64}


class Reader:
    """Reads the description and the arrays of one object of a session."""

    def __init__(self, session: Any, kind: int, age: int) -> None:
        self._session, self._kind, self._age = session, kind, age
        self.about: Dict[str, Any] = json.loads(lib.told("describe", session, kind, age))

    def array(self, name: str) -> Optional[np.ndarray]:
        """Returns the array with this name; None if the object has none."""
        shape = self.about["arrays"].get(name)
        if shape is None:
            return None
        components = shape["components"]
        size = (shape["count"],) if components == 1 else (shape["count"], components)
        array = np.empty(size, _DTYPES[shape["type"]])
        lib.call("read", self._session, self._kind, self._age, name.encode(), lib.array_of(array))
        return array

    def into(self, name: str, array: np.ndarray) -> None:
        """Copies an object's array into an array of the right shape."""
        lib.call("read", self._session, self._kind, self._age, name.encode(), lib.array_of(array))
