"""Sessions, which run programs."""

import json
import signal
import threading
from contextlib import contextmanager
from typing import Any, Callable, Dict, Iterator, List, Optional

import numpy as np

from . import _library as lib
from ._objects import Curves, Field, Flow, Image, Mesh, Points, Reader

Progress = Callable[[str, float], Any]


def _proceed(_title: str, _fraction: float) -> bool:
    return False


@contextmanager
def _ctrl_c_cancels(cancel: Callable[[], Any], seen: List[Any]) -> Iterator[None]:
    """Ctrl-C is seen and asks to stop, and does afterwards what it does otherwise.

    An exception of its own, where a callback has just been entered, would be lost: nothing there can catch it.
    """
    usual = signal.getsignal(signal.SIGINT)
    if not callable(usual) or threading.current_thread() is not threading.main_thread():
        yield
        return

    def pressed(*what: Any) -> None:
        seen.append(what)
        cancel()

    signal.signal(signal.SIGINT, pressed)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)
        if seen:
            usual(*seen[0])


class Session:
    """Runs programs, and has what they have made.

    Use it in a `with` statement, or call close(). Different sessions may be used by different threads at the same
    time; one session is used by one thread at a time, but for cancel(). While a program runs, other threads of Python
    go on.
    """

    def __init__(self) -> None:
        self._handle: Any = None
        self._handle = lib.created("session_create")

    def close(self) -> None:
        """Gives everything back. Arrays, fields and flows that came from the session live on."""
        if self._handle is not None:
            lib.library().curlew_session_release(self._handle)
            self._handle = None

    def __enter__(self) -> "Session":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def __del__(self) -> None:
        self.close()

    @property
    def _open(self) -> Any:
        if self._handle is None:
            raise lib.Error("the session is closed")
        return self._handle

    def provide_mesh(self, name: str, points: Any, faces: Any) -> None:
        """From now on, `read NAME` in programs takes this mesh, and no file.

        Args:
            points: (n, 3), world units.
            faces: (m, 3) or (m, 4) indices of points; or a pair (indices, sizes) for faces of different sizes: all
                corners one after another, and how many each face has.
        """
        # Two triangles are no such pair: there are more corners than faces.
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
        lib.call("provide_mesh", self._open, name, lib.array_of(points), lib.array_of(corners), sizes)

    def provide_points(self, name: str, positions: Any, ids: Any = None, velocities: Any = None) -> None:
        """From now on, `read NAME` in programs takes these points, and no file.

        Args:
            positions: (n, 3), world units.
            ids: (n,) integers; 0, 1, 2, … if there are none.
            velocities: (n, 3), world units per second.
        """
        given = [
            lib.usable(positions, 3, "positions"),
            None if ids is None else lib.usable(ids, 1, "ids", integers=True),
            None if velocities is None else lib.usable(velocities, 3, "velocities"),
        ]
        views = [None if array is None else lib.array_of(array) for array in given]
        lib.call("provide_points", self._open, lib.plain(name, "the name"), *views)

    def withdraw(self, name: str) -> None:
        """What was provided under that name is not there any more."""
        lib.call("withdraw", self._open, lib.plain(name, "the name"))

    def run(
        self,
        text: str,
        name: str = "scene",
        progress: Optional[Progress] = None,
        on_frame: Optional[Callable[[int, "Session"], Any]] = None,
        on_message: Optional[Callable[[str], Any]] = None,
    ) -> None:
        """Runs a program, one action a line as in a scene file, on what the session has.

        Args:
            name: stands for the text in messages.
            progress: called as progress(title, fraction) about 20 times a second, from any thread; something true
                cancels the program.
            on_frame: called as on_frame(frame, session) at the end of each frame of `frames`, while what it has made
                is there to be read; something true cancels the program.
            on_message: called with each line that the program says, and each text that it prints.

        Raises:
            Cancelled: where a callback or cancel() has asked for it. Error: for everything else that fails. An
                exception in a callback ends the program, and is raised here.
        """
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
                    lib.library().curlew_cancel(self._handle)
                    return 1

            return kind(called)

        def decoded(text: bytes) -> str:
            return text.decode(errors="replace")

        if progress is None and threading.current_thread() is threading.main_thread():
            progress = _proceed  # Python sees Ctrl-C only where it is called
        callbacks = lib.Callbacks(
            None,
            guarded(progress, lib.PROGRESS, decoded, float),
            guarded(None if on_frame is None else lambda frame: on_frame(frame, self), lib.FRAME, int),
            guarded(on_message, lib.MESSAGE, decoded),
        )
        try:
            with _ctrl_c_cancels(self.cancel, interrupts):
                lib.call("run", self._open, lib.plain(text, "the program"), lib.plain(name, "its name"), callbacks)
        except lib.Error:
            if not failures:
                raise
        if failures:
            raise failures[0]

    def cancel(self) -> None:
        """Asks the program that runs to stop. From any thread; where none runs it does nothing."""
        lib.call("cancel", self._open)

    def _read(self, kind: int, age: int) -> Reader:
        return Reader(self._open, kind, age)

    def count(self, kind: str) -> int:
        """How many there are: of "field", "flow", "grid", "mesh", "points", "curves" or "image"."""
        kinds = ["field", "flow", "grid", "mesh", "points", "curves", "image"]
        if kind not in kinds:
            raise lib.Error(f"there are no objects of kind '{kind}'; kinds are {', '.join(kinds)}")
        number = lib.c_int64()
        lib.call("count", self._open, kinds.index(kind), lib.byref(number))
        return number.value

    def points(self, age: int = 0) -> Points:
        """Points; those of age 0 are the newest."""
        read = self._read(lib.POINTS, age).array
        return Points(
            positions=read("position"),
            ids=read("id"),
            velocities=read("velocity"),
            ages=read("age"),
            lives=read("life"),
            tracks=read("track"),
        )

    def curves(self, age: int = 0) -> Curves:
        """Curves; those of age 0 are the newest."""
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

    def mesh(self, age: int = 0) -> Mesh:
        """A mesh; that of age 0 is the newest."""
        read = self._read(lib.MESH, age).array
        return Mesh(points=read("position"), triangles=read("triangles"), quads=read("quads"))

    def image(self, age: int = 0) -> Image:
        """A picture; that of age 0 is the newest."""
        reader = self._read(lib.IMAGE, age)
        width, height, channels = (reader.about[name] for name in ("width", "height", "channels"))
        pixels = np.empty((width * height, len(channels)), np.float32)
        reader.into("pixels", pixels)
        return Image(pixels.reshape(height, width, len(channels)), channels)

    def grids(self) -> List[Dict[str, Any]]:
        """What there is to know about each grid, the newest first: "name", "type", "class", "voxel_size" (the edge
        of a voxel, or three where they differ), "active_voxels", "level_set"."""
        found = [self._read(lib.GRID, age).about for age in range(self.count("grid"))]
        for grid in found:
            if len(set(grid["voxel_size"])) == 1:
                grid["voxel_size"] = grid["voxel_size"][0]
        return found

    def field(self, age: int = 0) -> Field:
        """A field, to evaluate; that of age 0 is the newest."""
        return Field(lib.created("session_field", self._open, age))

    def flow(self, age: int = 0) -> Flow:
        """A flow, to evaluate; that of age 0 is the newest."""
        return Flow(lib.created("session_flow", self._open, age), self._read(lib.FLOW, age).about)

    def report(self) -> Dict[str, Any]:
        """What the actions have measured, by action."""
        return json.loads(lib.told("report", self._open))
