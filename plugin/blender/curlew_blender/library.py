# SPDX-License-Identifier: GPL-3.0-or-later
"""Access to the library, its registry and its sessions for the rest of the add-on."""

import importlib
import importlib.util
import json
import re
import sys
import threading
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any, Dict, Iterator, Mapping, Optional, Tuple

from .actions import Action, TreeError, actions_of
from .sources import ObjectArrays

_HERE = Path(__file__).resolve().parent
_module: Optional[ModuleType] = None
_actions: Dict[str, Action] = {}
_files: Dict[Path, Tuple[int, ...]] = {}  # the loaded files, and what told them from others then


def _about(file: Path) -> Tuple[int, ...]:
    """Returns numbers that change if the file is replaced."""
    try:
        about = file.stat()
    except OSError:
        return ()
    return about.st_dev, about.st_ino, about.st_size, about.st_mtime_ns


def updated() -> bool:
    """Returns whether another version was installed since Blender has loaded this one. This one runs on until Blender is
    restarted: Python and the system keep what they have loaded."""
    return any(_about(file) != about for file, about in _files.items())


def _of_file(path: Path) -> ModuleType:
    """Returns the package with this __init__.py, without a change to Python's path."""
    about = importlib.util.spec_from_file_location("curlew", path, submodule_search_locations=[str(path.parent)])
    assert about and about.loader
    module = sys.modules["curlew"] = importlib.util.module_from_spec(about)
    about.loader.exec_module(module)
    return module


def curlew() -> ModuleType:
    """Returns Curlew's Python package: the one in the legacy add-on, or that of this checkout, or that of the extension's
    wheel, which Blender installs, or of the system."""
    global _module
    if _module is None:
        if (_HERE / "curlew").is_dir():
            _module = importlib.import_module(".curlew", __package__)
        else:
            checkout = _HERE.parents[1] / "python" / "curlew" / "__init__.py"
            _module = _of_file(checkout) if checkout.is_file() else importlib.import_module("curlew")
    return _module


def actions() -> Dict[str, Action]:
    """Returns all actions by name, in the registry's order. Raises the errors of loading the library."""
    if not _actions:
        _actions.update(actions_of(curlew().registry()))
        _files.update((file, _about(file)) for file in (_HERE / "__init__.py", Path(curlew().find_library())))
    return _actions


def changes(node: Mapping[str, Any]) -> bool:
    """Returns whether a node of a graph that has no inputs changes with time. False if it is invalid, which a run tells."""
    graph = {"nodes": [node], "frames": {"words": ["1-2"]}}
    try:
        return any(each["when"] == "frame" for each in json.loads(curlew().translate(graph, "json"))["nodes"])
    except curlew().Error:
        return False


def text_of(error: Exception) -> str:
    """Returns the message of an error without the name of the action or node, which shows the message itself."""
    return re.sub(r"^-\w+( '[^']*')?: ", "", str(error))


@contextmanager
def said_of_nodes() -> Iterator[None]:
    """Converts an error of the library to a TreeError of the node."""
    try:
        yield
    except curlew().Error as error:
        raise TreeError(error.node or "", text_of(error)) from error


class Sessions:
    """One session per tree, so that a run only evaluates what has changed since the tree's last run. A session is used
    by one thread at a time; others wait."""

    def __init__(self) -> None:
        self._kept: Dict[str, "_Kept"] = {}

    @contextmanager
    def of(self, tree: str, meshes: Mapping[str, ObjectArrays]) -> Iterator[Any]:
        """Yields the session of the tree with this name, which reads these meshes and curves."""
        if tree not in self._kept:
            self._kept[tree] = _Kept()
        kept = self._kept[tree]
        with kept.lock:
            kept.provide(meshes)
            yield kept.session

    def keep(self, trees: Mapping[str, Any]) -> None:
        """Drops the sessions of all other trees. A session in use is closed afterwards."""
        self._kept = {name: kept for name, kept in self._kept.items() if name in trees}


class _Kept:
    def __init__(self) -> None:
        self.session = curlew().Session()
        self.lock = threading.Lock()
        self._meshes: Dict[str, ObjectArrays] = {}

    def provide(self, meshes: Mapping[str, ObjectArrays]) -> None:
        """Provides meshes and curves that are new or have changed. If one is invalid, the session keeps the former one, and
        those that come after it."""
        for name in self._meshes.keys() - meshes.keys():
            self.session.withdraw(name)
            del self._meshes[name]
        for name, mesh in meshes.items():
            if name not in self._meshes or not mesh.same(self._meshes[name]):
                mesh.provide(self.session, name)
                self._meshes[name] = mesh
