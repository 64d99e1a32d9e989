# SPDX-License-Identifier: Apache-2.0
"""Common tasks in one call."""

import json
from typing import Any, Dict, Mapping, Optional, Tuple, Union

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

    These are .vdb with points, .nvdb, .exr, .gltf, .glb, .fbx and .dae. A damaged file then cannot crash this process. The setting applies to the whole process. It needs the command
    `curlew`: the one that the environment variable CURLEW_READER names, or else the one beside the library or in the
    bin/ of its installation. Returns whether a separate process now reads such files.
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


def _options(options: Mapping[str, Any]) -> str:
    def written(value: Any) -> str:
        if isinstance(value, bool):
            return str(int(value))
        if isinstance(value, str):
            return value
        try:
            return ",".join(repr(float(number)) for number in value)
        except TypeError:
            return repr(value) if isinstance(value, int) else repr(float(value))

    words = [f"{name}={written(value)}" for name, value in options.items()]
    return "".join(f" '{word}'" if "'" not in word else f' "{word}"' for word in words)


def _text_of(program: Union[Program, str]) -> str:
    text = program.text if isinstance(program, Program) else program
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
        file = lib.escaped(str(path))
        quote = "'" if "'" not in file else '"'
        text = f"{_text_of(program)}velocity{_options(options)}\nwrite grid=0 {quote}{file}{quote}\n"
        session.run(text, getattr(program, "name", "scene"), progress)
        return session.grids()[0]
