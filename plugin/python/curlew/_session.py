# SPDX-License-Identifier: Apache-2.0
"""Sessions, which run programs."""

import json
import threading
from typing import Any, Callable, Dict, List, Mapping, Optional, Union

import numpy as np

from . import _calls
from . import _library as lib
from ._objects import Curves, Field, Flow, Grid, Image, Mesh, Points, Reader

Progress = Callable[[str, float], Any]
Graph = Union[str, Mapping[str, Any]]
Which = Union[int, str]


def _proceed(_title: str, _fraction: float) -> bool:
    return False


#: The functions of fields. They are kept, since fields and flows made from them may outlive their session.
_FIELD_FUNCTIONS: List[Any] = []


class Session:
    """Runs programs and holds the objects that they make.

    Objects are selected by name ("dust", "smoke.density": a node, or one of its outputs) or by age (0 is the newest of
    its kind). Use a session in a `with` statement, or call close(). Different sessions may be used by different threads
    at the same time. One session may be used by one thread at a time, except for cancel(). Other Python threads
    continue while a program runs.
    """

    def __init__(self) -> None:
        self.runs = 0  #: number of programs that were run
        self.turns = 0  #: number of runs and of frames that on_frame has seen; each discards the objects before it
        self._handle: Any = None
        self._failures = _calls.Failures()
        self._handle = lib.created("session_create")

    def close(self) -> None:
        """Releases the session. Arrays, fields and flows that came from it remain valid.

        Raises Error while the session runs, including from its callbacks.
        """
        if self._handle is not None:
            lib.call("session_release", self._handle)
            self._handle = None
            self.turns += 1

    def __enter__(self) -> "Session":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def __del__(self) -> None:
        self.close()

    @property
    def handle(self) -> Any:
        """The curlew_session. Raises Error if the session is closed."""
        if self._handle is None:
            raise lib.Error("the session is closed")
        return self._handle

    def provide_mesh(self, name: str, points: Any, faces: Any) -> None:
        """Provides a mesh: `read NAME` in programs then reads it instead of a file.

        Args:
            points: (n, 3), world units.
            faces: (m, 3) or (m, 4) vertex indices; or a pair (indices, sizes) for faces of different sizes: the vertex
                indices of all faces one after another, and the number of vertices of each face.
        """
        # A tuple of two faces is not such a pair: its entries have the same size, while a pair has more indices than
        # sizes.
        pair = isinstance(faces, tuple) and len(faces) == 2 and np.size(faces[0]) != np.size(faces[1])
        corners, sizes = faces if pair else (faces, None)
        if sizes is None:
            corners = lib.numbers(corners, "faces", integers=True)
            quads = corners.ndim == 2 and corners.shape[1] == 4
            corners = lib.usable(corners, 4 if quads else 3, "faces", integers=True)
        else:
            corners = lib.usable(corners, 1, "the faces' indices", integers=True)
            sizes = lib.array_of(lib.usable(sizes, 1, "the faces' sizes", integers=True))
        points = lib.usable(points, 3, "points")
        name = lib.plain(name, "the name")
        lib.call("provide_mesh", self.handle, name, lib.array_of(points), lib.array_of(corners), sizes)

    def provide_points(self, name: str, positions: Any, ids: Any = None, velocities: Any = None) -> None:
        """Provides points: `read NAME` in programs then reads them instead of a file.

        Args:
            positions: (n, 3), world units.
            ids: (n,) integers; 0, 1, 2, … if None.
            velocities: (n, 3), world units per second.
        """
        given = [
            lib.usable(positions, 3, "positions"),
            None if ids is None else lib.usable(ids, 1, "ids", integers=True),
            None if velocities is None else lib.usable(velocities, 3, "velocities"),
        ]
        views = [None if array is None else lib.array_of(array) for array in given]
        lib.call("provide_points", self.handle, lib.plain(name, "the name"), *views)

    def provide_curves(self, name: str, positions: Any, edges: Any) -> None:
        """Provides curves, for instance for -rail: `read NAME` in programs then reads them instead of a file.

        Args:
            positions: (n, 3) vertices, world units.
            edges: (m, 2) vertex indices. Edges are joined where exactly two meet at a vertex. A curve runs from the first
                vertex of its edges to the second, if they agree.
        """
        positions = lib.usable(positions, 3, "positions")
        edges = lib.usable(edges, 2, "edges", integers=True)
        lib.call("provide_curves", self.handle, lib.plain(name, "the name"), lib.array_of(positions), lib.array_of(edges))

    def provide_field(self, name: str, function: Callable[[np.ndarray], Any], dimension: int = 3) -> None:
        """Provides a field: `read NAME` in programs then makes it.

        Args:
            function: called with positions, an (n, dimension) array of up to 64 rows, from any thread. Several threads
                call it at a time if it gives up Python's lock, for instance to read a file or to evaluate a field; it
                must guard what it changes. Returns the values, (n,), and their gradients, (n, dimension), at these
                positions, and always the same at the same position. An exception ends the program or the evaluation,
                and is raised from run() or from the method of the field or flow.
            dimension: 1 to 7.

        Raises Error if the gradients are not those of the values. Slower than a formula, since each call takes Python's
        lock.
        """
        failures, known = self._failures, str(name)
        dimension = lib.whole(dimension, "the dimension of a field")
        if not 1 <= dimension <= 7:
            raise lib.Error(f"a field of {dimension} dimensions; give 1 to 7")

        def evaluate(_user: Any, count: int, positions: Any, values: Any, gradients: Any) -> int:
            try:
                if _calls.refused():
                    return 1
                at = np.ctypeslib.as_array(positions, (count, dimension)).copy()
                found, derivatives = function(at)
                np.ctypeslib.as_array(values, (count,))[:] = lib.numbers(found, "the field's values")
                derivatives = lib.numbers(derivatives, "the field's gradients")
                np.ctypeslib.as_array(gradients, (count, dimension))[:] = derivatives
                return 0
            except BaseException as failure:  # pylint: disable=broad-except
                failures.found[known] = failure
                return 1

        held = lib.FIELD_FUNCTION(evaluate)
        _FIELD_FUNCTIONS.append(held)
        arguments = self.handle, lib.plain(name, "the name"), dimension, held, None, len(_FIELD_FUNCTIONS)
        with _calls.ctrl_c_waits():
            _calls.call(failures, "provide_field", *arguments)

    def withdraw(self, name: str) -> None:
        """Withdraws what was provided under this name. Raises Error if there is nothing."""
        lib.call("withdraw", self.handle, lib.plain(name, "the name"))

    def run(
        self,
        graph: Graph,
        name: str = "scene",
        progress: Optional[Progress] = None,
        on_frame: Optional[Callable[[int, "Session"], Any]] = None,
        on_message: Optional[Callable[[str], Any]] = None,
    ) -> None:
        """Runs a program, the text of a scene, on the objects in the session. A dict is passed to run_graph().

        Args:
            graph: the program.
            name: the program's name in messages.
            progress: called as progress(title, fraction) up to 20 times per second, from any thread. A true result
                cancels the program.
            on_frame: called as on_frame(frame, session) at the end of each frame of `frames`, while the results of the
                frame can be read. A true result cancels the program.
            on_message: called with each line that the program says and each text that it prints.

        Raises:
            Cancelled: if a callback or cancel() has cancelled the program. Error: for any other failure. An exception
                in a callback ends the program and is raised here.
        """
        self._run("run" if isinstance(graph, str) else "run_graph", graph, name, progress, on_frame, on_message)

    def run_graph(self, graph: Graph, name: str = "graph", **callbacks: Any) -> None:
        """Runs a program that replaces all objects in the session.

        Nodes whose options and inputs are those of the previous run are not evaluated again; `evaluated` lists the
        others.

        Args:
            graph: nodes and links as a dict or as JSON text (docs/graph.md), or the text of a scene.
            name: the program's name in messages.
            callbacks: those of run(), which raises the same exceptions.
        """
        self._run("run_graph", graph, name, **callbacks)

    def _run(
        self,
        function: str,
        graph: Graph,
        name: str,
        progress: Optional[Progress] = None,
        on_frame: Optional[Callable[[int, "Session"], Any]] = None,
        on_message: Optional[Callable[[str], Any]] = None,
    ) -> None:
        failures: List[BaseException] = []
        interrupts: List[Any] = []

        def guarded(callback: Optional[Callable[..., Any]], kind: Any, *convert: Callable[[Any], Any]) -> Any:
            if callback is None:
                return kind()

            def called(_: Any, *values: Any) -> int:
                try:
                    stop = callback(*[f(value) for f, value in zip(convert, values)])
                    return 1 if stop or interrupts else 0
                except BaseException as failure:  # pylint: disable=broad-except
                    failures.append(failure)
                    self._ask_to_stop()
                    return 1

            return kind(called)

        def decoded(text: bytes) -> str:
            return text.decode(errors="replace")

        def at_frame(frame: int) -> Any:
            self.turns += 1
            try:
                return on_frame(frame, self)
            finally:
                self.turns += 1

        if progress is None and threading.current_thread() is threading.main_thread():
            progress = _proceed  # Python only handles Ctrl-C while a callback runs
        callbacks = lib.Callbacks(
            None,
            guarded(progress, lib.PROGRESS, decoded, float),
            guarded(None if on_frame is None else at_frame, lib.FRAME, int),
            guarded(on_message, lib.MESSAGE, decoded),
        )
        text = lib.plain(lib.graph_text(graph), "the program")
        self.runs += 1
        self.turns += 1
        arguments = self.handle, text, lib.plain(name, "its name"), callbacks
        try:
            with _calls.ctrl_c_cancels(self.cancel, interrupts):
                _calls.call(self._failures, function, *arguments, cancel=self._ask_to_stop)
        except lib.Error:
            if not failures:
                raise
        if failures:
            raise failures[0]

    def cancel(self) -> None:
        """Asks the running program to stop. May be called from any thread. Does nothing if no program is running."""
        lib.call("cancel", self.handle)

    def _ask_to_stop(self) -> None:
        lib.library().curlew_cancel(self._handle)

    @property
    def evaluated(self) -> List[str]:
        """The names of the nodes that the last run evaluated. The values of the others were reused."""
        return list(json.loads(lib.told("evaluated", self.handle)))

    def _position(self, kind: int, which: Which) -> int:
        if not isinstance(which, str):
            return lib.whole(which, "the age of an object, if it is not a name,")
        found, position = lib.c_int32(), lib.c_int64()
        lib.call("find", self.handle, lib.plain(which, "the name"), lib.byref(found), lib.byref(position))
        if found.value != kind:
            raise lib.Error(f"'{which}' is of kind '{lib.KINDS[found.value]}', not '{lib.KINDS[kind]}'")
        return position.value

    def _read(self, kind: int, which: Which) -> Reader:
        return Reader(self.handle, kind, self._position(kind, which))

    def count(self, kind: str) -> int:
        """Returns the number of objects of a kind: "field", "flow", "grid", "mesh", "points", "curves" or "image"."""
        if kind not in lib.KINDS:
            raise lib.Error(f"there is no kind '{kind}'; the kinds are {', '.join(lib.KINDS)}")
        number = lib.c_int64()
        lib.call("count", self.handle, lib.KINDS.index(kind), lib.byref(number))
        return number.value

    def points(self, age: Which = 0) -> Points:
        """Returns points, by name or by age."""
        read = self._read(lib.POINTS, age).array
        return Points(
            positions=read("position"),
            ids=read("id"),
            velocities=read("velocity"),
            ages=read("age"),
            lives=read("life"),
            tracks=read("track"),
            fades=read("fade"),
        )

    def curves(self, age: Which = 0) -> Curves:
        """Returns curves, by name or by age."""
        read = self._read(lib.CURVES, age).array
        return Curves(
            vertices=read("position"),
            offsets=read("start"),
            closed=read("closed").astype(bool),
            ids=read("id"),
            lengths=read("length"),
            velocities=read("velocity"),
            along=read("along"),
            tracks=read("track"),
        )

    def mesh(self, age: Which = 0) -> Mesh:
        """Returns a mesh, by name or by age."""
        read = self._read(lib.MESH, age).array
        return Mesh(
            points=read("position"),
            triangles=read("triangles"),
            quads=read("quads"),
            normals=read("normal"),
            uvs=read("uv"),
        )

    def image(self, age: Which = 0) -> Image:
        """Returns an image, by name or by age."""
        reader = self._read(lib.IMAGE, age)
        width, height, channels = (reader.about[name] for name in ("width", "height", "channels"))
        pixels = np.empty((width * height, len(channels)), np.float32)
        reader.into("pixels", pixels)
        return Image(pixels.reshape(height, width, len(channels)), channels)

    def grid(self, age: Which = 0) -> Grid:
        """Returns a grid, by name or by age."""
        return Grid(self, self._position(lib.GRID, age))

    def grids(self) -> List[Dict[str, Any]]:
        """Describes each grid, the newest first: "name", "type", "class", "voxel_size" (one number, or three if they
        differ), "active_voxels", "level_set", …"""
        found = [self._read(lib.GRID, age).about for age in range(self.count("grid"))]
        for grid in found:
            if len(set(grid["voxel_size"])) == 1:
                grid["voxel_size"] = grid["voxel_size"][0]
        return found

    def field(self, age: Which = 0) -> Field:
        """Returns a field, by name or by age."""
        return Field(lib.created("session_field", self.handle, self._position(lib.FIELD, age)), self._failures)

    def flow(self, age: Which = 0) -> Flow:
        """Returns a flow, by name or by age."""
        position = self._position(lib.FLOW, age)
        about = self._read(lib.FLOW, position).about
        return Flow(lib.created("session_flow", self.handle, position), about, self._failures)

    def report(self) -> Dict[str, Any]:
        """Returns the measurements of the actions, by action."""
        return json.loads(lib.told("report", self.handle))
