# SPDX-License-Identifier: Apache-2.0
"""What is done most, in one call."""

import json
from typing import Any, Dict, Mapping, Optional, Tuple, Union

from . import _library as lib
from ._objects import Flow, Points
from ._session import Graph, Progress, Session

Meshes = Mapping[str, Tuple[Any, Any]]


def version() -> str:
    """The versions of the library and of OpenVDB, and the instruction set in use."""
    return _text("version")


def registry() -> Dict[str, Any]:
    """All actions, with their inputs, outputs, options, defaults, ranges and help."""
    return json.loads(_text("registry"))


def read_isolated(on: bool = True) -> bool:
    """Whether damaged files of points or pictures (.vdb, .exr) can end only a process of their own; on by default.

    It takes the command `curlew` beside the library or in the bin/ of its installation, or where the environment's
    CURLEW_READER says. For the whole process. Returns whether such files are now read by another process.
    """
    return bool(lib.library().curlew_read_isolated(int(on)))


def translate(graph: Graph, form: str, name: str = "graph") -> str:
    """A program as JSON text (form "json": nodes and links, docs/graph.md) or as the text of a scene (form "scene").

    Args:
        graph: a dict, JSON text or the text of a scene.
        form: "json" or "scene".
        name: stands for it in messages.

    Raises Error for what is wrong with it. Files that it reads need not be there.
    """
    text = lib.plain(lib.graph_text(graph), "the graph")
    return lib.told("translate", text, lib.plain(name, "its name"), lib.plain(form, "the form"))


def _text(name: str) -> str:
    text = getattr(lib.library(), f"curlew_{name}")()
    if text is None:
        raise lib.Error(lib.library().curlew_error_message().decode(errors="replace"))
    return text.decode()


class Program:
    """The text of a program: one action a line, as in a scene file. Raises Error where it is not right."""

    def __init__(self, text: str, name: str = "scene") -> None:
        self.text, self.name = text, name
        lib.call("check", lib.plain(text, "the program"), lib.plain(name, "its name"))

    def run(self, meshes: Optional[Meshes] = None, **callbacks: Any) -> Session:
        """Runs it in a session of its own, with meshes (points, faces) by name; callbacks as of Session.run()."""
        session = Session()
        for name, (points, faces) in (meshes or {}).items():
            session.provide_mesh(name, points, faces)
        session.run(self.text, self.name, **callbacks)
        return session

    def flow(self, meshes: Optional[Meshes] = None, **callbacks: Any) -> Flow:
        """The newest flow that it makes."""
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
    """Moves points along the newest flow of a program, each on its own track.

    Args:
        positions: (n, 3), world units.
        program: what makes the flow.
        ids: (n,) integers.
        meshes: (points, faces) by name, for `read NAME` in the program.
        options: those of the action `advect`: time=2, steps=50, scheme="rk4", reproject="gauss-newton", …
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
    """Samples the newest flow of a program on a sparse grid, and writes that to a .vdb file, whole or not at all.

    Args:
        path: of the file.
        program: what makes the flow.
        meshes: (points, faces) by name, for `read NAME` in the program.
        options: those of the action `velocity`: voxel=0.02 or dim=128, staggered=True, name="velocity", …

    Returns what there is to know about the grid, as Session.grids() does.
    """
    with Session() as session:
        for name, (points, faces) in (meshes or {}).items():
            session.provide_mesh(name, points, faces)
        file = str(path).replace("{", "{{").replace("$", "$$")
        quote = "'" if "'" not in file else '"'
        text = f"{_text_of(program)}velocity{_options(options)}\nwrite grid=0 {quote}{file}{quote}\n"
        session.run(text, getattr(program, "name", "scene"), progress)
        return session.grids()[0]
