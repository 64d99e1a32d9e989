"""The library and its registry. The rest of the add-on asks here."""

import importlib
import os
import sys
from pathlib import Path
from types import ModuleType
from typing import Dict, Optional

from .actions import Action, actions_of

_HERE = Path(__file__).resolve().parent
_module: Optional[ModuleType] = None
_actions: Dict[str, Action] = {}


def curlew() -> ModuleType:
    """The Python package of Curlew: the one in the add-on, or else the one of this checkout or of the system."""
    global _module
    if _module is None:
        bundled = _HERE / "lib" / "libcurlew.so"
        if bundled.exists():
            os.environ.setdefault("CURLEW_LIBRARY", str(bundled))
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
