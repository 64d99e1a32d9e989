# SPDX-License-Identifier: GPL-3.0-or-later
"""The library, its registry and its sessions. The rest of the add-on asks here."""

import importlib
import sys
import threading
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any, Dict, Iterator, Mapping, Optional

from .actions import Action, TreeError, actions_of
from .sources import MeshArrays

_HERE = Path(__file__).resolve().parent
_module: Optional[ModuleType] = None
_actions: Dict[str, Action] = {}


def curlew() -> ModuleType:
    """The Python package of Curlew: the one in the add-on, or else the one of this checkout or of the system."""
    global _module
    if _module is None:
        if (_HERE / "curlew").is_dir():
            _module = importlib.import_module(".curlew", __package__)
        else:
            checkout = _HERE.parents[1] / "python"
            if checkout.is_dir() and str(checkout) not in sys.path:
                sys.path.append(str(checkout))
            _module = importlib.import_module("curlew")
    return _module


def actions() -> Dict[str, Action]:
    """All actions by name, in the registry's order. Throws what loading the library throws."""
    if not _actions:
        _actions.update(actions_of(curlew().registry()))
    return _actions


@contextmanager
def said_of_nodes() -> Iterator[None]:
    """What the library says is wrong becomes a TreeError of its node."""
    try:
        yield
    except curlew().Error as error:
        raise TreeError(error.node or "", str(error)) from error


class Sessions:
    """A session for each tree: a run evaluates only what differs from the tree's last run. One thread at a time uses a
    session; another one waits."""

    def __init__(self) -> None:
        self._kept: Dict[str, "_Kept"] = {}

    @contextmanager
    def of(self, tree: str, meshes: Mapping[str, MeshArrays]) -> Iterator[Any]:
        """The session of the tree of that name, which reads these meshes."""
        if tree not in self._kept:
            self._kept[tree] = _Kept()
        kept = self._kept[tree]
        with kept.lock:
            kept.provide(meshes)
            yield kept.session

    def keep(self, trees: Mapping[str, Any]) -> None:
        """Forgets the sessions of all other trees; one that is in use ends after that."""
        self._kept = {name: kept for name, kept in self._kept.items() if name in trees}


class _Kept:
    def __init__(self) -> None:
        self.session = curlew().Session()
        self.lock = threading.Lock()
        self._meshes: Dict[str, MeshArrays] = {}

    def provide(self, meshes: Mapping[str, MeshArrays]) -> None:
        """Hands over meshes that are new or have changed."""
        for name in self._meshes.keys() - meshes.keys():
            self.session.withdraw(name)
        for name, mesh in meshes.items():
            if name not in self._meshes or not mesh.same(self._meshes[name]):
                self.session.provide_mesh(name, mesh.points, (mesh.indices, mesh.sizes))
        self._meshes = dict(meshes)
