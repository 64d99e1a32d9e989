# SPDX-License-Identifier: Apache-2.0
"""What a session has made, as NumPy arrays, and the fields and flows that can be evaluated."""

import ctypes
import json
from dataclasses import dataclass
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from . import _library as lib


@dataclass
class Points:
    """Points; arrays have an entry for each of them."""

    positions: np.ndarray  #: (n, 3) float64, world units
    ids: np.ndarray  #: (n,) int64, the same for all of a point's life
    velocities: Optional[np.ndarray] = None  #: (n, 3) float32, world units per second
    ages: Optional[np.ndarray] = None  #: (n,) float32, seconds
    lives: Optional[np.ndarray] = None  #: (n,) float32, the age at which it dies; infinite: never
    tracks: Optional[np.ndarray] = None  #: (n, 2) float64, the values of f and g that it keeps
    fades: Optional[np.ndarray] = None  #: (n,) float32, 0 to 1: how much of it is seen

    def __len__(self) -> int:
        return len(self.positions)


@dataclass
class Curves:
    """Polylines: curve k has the vertices offsets[k] to offsets[k + 1] - 1."""

    vertices: np.ndarray  #: (n, 3) float64, world units
    offsets: np.ndarray  #: (k + 1,) int64
    closed: np.ndarray  #: (k,) bool: an edge leads from the last vertex to the first
    ids: np.ndarray  #: (k,) int64, those of the seeds
    lengths: np.ndarray  #: (k,) float64, world units
    velocities: np.ndarray  #: (n, 3) float32, of the flow at the vertices
    along: np.ndarray  #: (n,) float64, from the seed, world units or seconds
    tracks: Optional[np.ndarray] = None  #: (n, 2) float64, f and g at the vertices

    def __len__(self) -> int:
        return len(self.closed)


@dataclass
class Mesh:
    """A surface of triangles and quads."""

    points: np.ndarray  #: (n, 3) float32, world units
    triangles: np.ndarray  #: (m, 3) int32
    quads: np.ndarray  #: (q, 4) int32

    @property
    def faces(self) -> List[Tuple[int, ...]]:
        """The corners of each face: triangles first, then quads."""
        return [tuple(face) for face in self.triangles.tolist() + self.quads.tolist()]


@dataclass
class Image:
    """A picture; rows from top to bottom. NaN: nothing is there."""

    pixels: np.ndarray  #: (h, w, c) float32
    channels: List[str]  #: a name for each of c


class Field:
    """A scalar field. It never changes; threads may share it."""

    def __init__(self, handle: Any) -> None:
        self._handle = handle
        self.dimension: int = lib.library().curlew_field_dimension(handle)  #: 1 to 7

    def __del__(self) -> None:
        lib.library().curlew_field_release(self._handle)

    def value(self, positions: Any) -> np.ndarray:
        """Its values at positions (n, d): (n,).

        Positions have as many coordinates as the field has dimensions, or 3 where it has fewer. What float32 positions
        give is float32; positions of any other kind give float64. Where a position is not finite it is NaN.
        """
        return _evaluated("field", self, positions, lambda d: (1, None))[0]

    def gradient(self, positions: Any) -> np.ndarray:
        """Its gradients at positions (n, d): (n, d)."""
        return _evaluated("field", self, positions, lambda d: (None, d))[1]

    def value_and_gradient(self, positions: Any) -> Tuple[np.ndarray, np.ndarray]:
        """Both, for little more than the cost of the gradient."""
        return _evaluated("field", self, positions, lambda d: (1, d))


class Flow:
    """A flow: velocities made of scalar fields. It never changes; threads may share it."""

    def __init__(self, handle: Any, about: Dict[str, Any]) -> None:
        self._handle = handle
        self.dimension: int = about["dimension"]  #: 2 to 7
        self.has_tracks: bool = about["tracks"]  #: fields() stay the same along streamlines
        self.divergence_free: bool = about["divergence_free"]
        self.lower = np.array(about["lower"])  #: (d,) of the box that it is made for
        self.upper = np.array(about["upper"])  #: (d,)

    def __del__(self) -> None:
        lib.library().curlew_flow_release(self._handle)

    def velocity(self, positions: Any) -> np.ndarray:
        """Its velocities at positions (n, d): (n, d), world units per second; see Field.value()."""
        return _evaluated("flow", self, positions, lambda d: (d, None))[0]

    def fields(self, positions: Any) -> np.ndarray:
        """Its potentials at positions (n, d): (n, d - 1); in space f and g. Raises Error for a sum of flows."""
        return _evaluated("flow", self, positions, lambda d: (None, d - 1))[1]

    def velocity_and_fields(self, positions: Any) -> Tuple[np.ndarray, np.ndarray]:
        """Both, for the cost of the velocity."""
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
    lib.call(f"{kind}_evaluate", what._handle, lib.array_of(points), *views)
    return made[0], made[1]


_VALUES: Dict[str, Tuple[Any, Tuple[int, ...]]] = {  # what a grid's voxels have
    "float": (np.dtype(np.float32), ()),
    "double": (np.dtype(np.float64), ()),
    "int32": (np.dtype(np.int32), ()),
    "int64": (np.dtype(np.int64), ()),
    "vec3s": (np.dtype(np.float32), (3,)),
    "vec3d": (np.dtype(np.float64), (3,)),
}


class Leaf(NamedTuple):
    """One block of 8 x 8 x 8 voxels of a grid, those of the smallest indices first."""

    origin: Tuple[int, int, int]  #: the indices of its first voxel
    values: np.ndarray  #: (8, 8, 8) or (8, 8, 8, 3), indexed by x, y, z: a view of the grid, which cannot be written to
    active: np.ndarray  #: (8, 8, 8) bool, whether a voxel has a value of its own


class Grid:
    """A sparse grid of a session.

    What it reads is there until the session runs again or is closed; after that its methods raise Error.
    """

    def __init__(self, session: Any, position: int) -> None:
        self._session, self._position, self._run = session, position, session.runs
        self.about: Dict[str, Any] = Reader(session.handle, lib.GRID, position).about
        self.name: str = self.about["name"]
        self.type: str = self.about["type"]  #: "float", "vec3s", …
        self.grid_class: str = self.about["class"]  #: "level set", "fog volume", "staggered", …
        self.voxel_size = np.array(self.about["voxel_size"])  #: (3,) world units
        self.lower = tuple(self.about["lower"])  #: of the box of the active voxels, in indices
        self.upper = tuple(self.about["upper"])  #: exclusive
        self.transform = np.array(self.about["transform"])  #: (4, 4): transform @ (i, j, k, 1) is (x, y, z, 1)
        self._dtype, self._shape = _VALUES.get(self.about["value_type"], (np.dtype(np.float64), ()))

    def _open(self) -> Any:
        if self._session.runs != self._run:
            raise lib.Error(f"the session has run since it was asked for the grid '{self.name}': ask again")
        return self._session.handle

    def array(self, lower: Optional[Sequence[int]] = None, upper: Optional[Sequence[int]] = None) -> np.ndarray:
        """The values of a box of voxels: (x, y, z), or (x, y, z, 3) for vectors.

        Args:
            lower: the indices of its first voxel; those of the active voxels' box if None.
            upper: those after its last voxel; those of the active voxels' box if None.
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
        """The blocks that have active voxels, without copies: `for origin, values, active in grid.leaves()`.

        The values are the grid's own memory. They may be used until the session runs again or is closed; copy what has
        to live longer.
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
        memory.kept = self._session  # for as long as the view is there
        array = np.frombuffer(memory, np.uint8)
        array.flags.writeable = False
        return array


_DTYPES = {"float32": np.float32, "float64": np.float64, "int32": np.int32, "int64": np.int64}


class Reader:
    """One object of a session: what there is about it, and its arrays."""

    def __init__(self, session: Any, kind: int, age: int) -> None:
        self._session, self._kind, self._age = session, kind, age
        self.about: Dict[str, Any] = json.loads(lib.told("describe", session, kind, age))

    def array(self, name: str) -> Optional[np.ndarray]:
        """The array of that name, or None where it has none."""
        shape = self.about["arrays"].get(name)
        if shape is None:
            return None
        components = shape["components"]
        size = (shape["count"],) if components == 1 else (shape["count"], components)
        array = np.empty(size, _DTYPES[shape["type"]])
        lib.call("read", self._session, self._kind, self._age, name.encode(), lib.array_of(array))
        return array

    def into(self, name: str, array: np.ndarray) -> None:
        """Fills an array of the right shape."""
        lib.call("read", self._session, self._kind, self._age, name.encode(), lib.array_of(array))
