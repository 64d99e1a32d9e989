# SPDX-License-Identifier: Apache-2.0
"""Common tasks in one call."""

import json
import os
from typing import Any, Dict, Mapping, Optional, Tuple, Union

import numpy as np

from . import _library as lib
from ._objects import Flow, Points
from ._session import Graph, Progress, Session

Meshes = Mapping[str, Tuple[Any, Any]]


def version() -> str:
    """Returns the version and commit of the library, and the instruction set in use."""
    return _text("version")


def registry() -> Dict[str, Any]:
    """Returns all actions with their inputs, outputs, options, defaults, ranges and help."""
    return json.loads(_text("registry"))


def read_isolated(on: bool = True) -> bool:
    """Sets whether files that could crash the library that reads them are read by a separate process; on by default.

    These are .vdb with points, .nvdb, .exr, .gltf, .glb, .fbx and .dae. A damaged file then cannot crash this process.
    The setting applies to the whole process. It needs the command `curlew`: the one that the environment variable
    CURLEW_READER names, or else the one beside the library or in the bin/ of its installation. Returns whether a
    separate process now reads such files.
    """
    return bool(lib.library().curlew_read_isolated(int(on)))


def translate(graph: Graph, form: str, name: str = "graph") -> str:
    """Translates a program to JSON text (form "json": nodes and links, docs/graph.md) or to the text of a scene (form
    "scene").

    Args:
        graph: a dict, JSON text or the text of a scene.
        form: "json" or "scene".
        name: the program's name in messages.

    Raises Error if the program is invalid. Files that it reads need not exist.
    """
    text = lib.plain(lib.graph_text(graph), "the graph")
    return lib.told("translate", text, lib.plain(name, "its name"), lib.plain(form, "the form"))


def _text(name: str) -> str:
    text = getattr(lib.library(), f"curlew_{name}")()
    if text is None:
        raise lib.Error(lib.library().curlew_error_message().decode(errors="replace"))
    return text.decode()


class Program:
    """The text of a program: one action per line, as in a scene file. Raises Error if it is invalid."""

    def __init__(self, text: str, name: str = "scene") -> None:
        self.text, self.name = text, name
        lib.call("check", lib.plain(text, "the program"), lib.plain(name, "its name"))

    def run(self, meshes: Optional[Meshes] = None, **callbacks: Any) -> Session:
        """Runs the program in a new session, with meshes (points, faces) by name; callbacks as for Session.run()."""
        session = Session()
        for name, (points, faces) in (meshes or {}).items():
            session.provide_mesh(name, points, faces)
        session.run(self.text, self.name, **callbacks)
        return session

    def flow(self, meshes: Optional[Meshes] = None, **callbacks: Any) -> Flow:
        """Runs the program and returns its newest flow."""
        with self.run(meshes, **callbacks) as session:
            return session.flow()


def _written(name: str, value: Any) -> str:
    """Returns the value of an option as a program has it."""
    if isinstance(value, (np.ndarray, np.generic)) and value.ndim == 0:
        value = value.item()
    if isinstance(value, (str, os.PathLike)):
        return lib.plain(value, f"the option '{name}'").decode()
    if isinstance(value, int):
        return str(int(value))
    if isinstance(value, float):
        return repr(value)
    try:
        if isinstance(value, (bytes, bytearray, Mapping)):
            raise TypeError
        given = value if isinstance(value, np.ndarray) or not hasattr(value, "__iter__") else list(value)
        return ",".join(repr(float(number)) for number in np.atleast_1d(lib.numbers(given, name)))
    except (TypeError, lib.Error):
        raise lib.Error(f"the option '{name}' must be text, numbers or a truth value, not {value!r}") from None


def _options(options: Mapping[str, Any]) -> str:
    """Returns options as a program has them. Those that are None are left out."""
    given = {name: _written(name, value) for name, value in options.items() if value is not None}
    return "".join(" " + lib.quoted(f"{name}={value}", f"the option '{name}'") for name, value in given.items())


def _text_of(program: Union[Program, str]) -> str:
    text = program.text if isinstance(program, Program) else program
    if not isinstance(text, str):
        raise lib.Error(f"the program must be text or a Program, not {type(text).__name__}")
    return text if text.endswith("\n") else text + "\n"


def advect(
    positions: Any,
    program: Union[Program, str],
    ids: Any = None,
    meshes: Optional[Meshes] = None,
    progress: Optional[Progress] = None,
    **options: Any,
) -> Points:
    """Advects points along the newest flow of a program, each on its own track.

    Args:
        positions: (n, 3), world units.
        program: the program that makes the flow.
        ids: (n,) integers.
        meshes: (points, faces) by name, for `read NAME` in the program.
        options: those of the action `advect`: duration=2, steps=50, scheme="rk4", reproject="gauss-newton", …
    """
    with Session() as session:
        for name, (points, faces) in (meshes or {}).items():
            session.provide_mesh(name, points, faces)
        session.provide_points("curlew:positions", positions, ids)
        text = f"{_text_of(program)}read curlew:positions\nadvect{_options(options)}\n"
        session.run(text, getattr(program, "name", "scene"), progress)
        return session.points()


def velocity_grid(
    path: Any,
    program: Union[Program, str],
    meshes: Optional[Meshes] = None,
    progress: Optional[Progress] = None,
    **options: Any,
) -> Dict[str, Any]:
    """Samples the newest flow of a program on a sparse grid, and writes the grid to a .vdb file atomically.

    Args:
        path: the path of the file, in which {, $, # and % have no special meaning.
        program: the program that makes the flow.
        meshes: (points, faces) by name, for `read NAME` in the program.
        options: those of the action `velocity`: voxel=0.02 or dim=128, staggered=True, name="velocity", …

    Returns the description of the grid, as Session.grids() does.
    """
    with Session() as session:
        for name, (points, faces) in (meshes or {}).items():
            session.provide_mesh(name, points, faces)
        file = lib.quoted(lib.escaped(lib.plain(path, "the path").decode()), "the path")
        text = f"{_text_of(program)}velocity{_options(options)}\nwrite grid=0 {file}\n"
        session.run(text, getattr(program, "name", "scene"), progress)
        return session.grids()[0]
