# SPDX-License-Identifier: Apache-2.0
"""Finds and loads the shared library, declares its functions, and turns their errors into exceptions."""

import ctypes
import json
import operator
import os
import platform
import re
from ctypes import POINTER, byref, c_char_p, c_double, c_int, c_int32, c_int64, c_void_p
from pathlib import Path
from typing import Any, List, Mapping, Optional

import numpy as np

ABI_VERSION = 2
_NAME = "libcurlew.so"

FLOAT32, FLOAT64, INT32, INT64 = range(4)
FIELD, FLOW, GRID, MESH, POINTS, CURVES, IMAGE = range(7)
KINDS = ("field", "flow", "grid", "mesh", "points", "curves", "image")
_OK, _CANCELLED = 0, 4
_TYPES = {"float32": FLOAT32, "float64": FLOAT64, "int32": INT32, "int64": INT64}


class Error(Exception):
    """An error that the library reports, as one line.

    Attributes:
        line: the line of the program's text that failed, counted from 1; None if the error is not related to a line.
        action: the name of the action that failed; None if the error is not related to an action.
        node: the name of the node that failed; None if the node has no name or the error is not related to a node.
    """

    def __init__(
        self, message: str, line: Optional[int] = None, action: Optional[str] = None, node: Optional[str] = None
    ) -> None:
        super().__init__(message)
        self.line = line
        self.action = action
        self.node = node


class Cancelled(Error):
    """A callback or Session.cancel() has cancelled the program."""


class Array(ctypes.Structure):
    """curlew_array and curlew_buffer, which have the same memory layout."""

    _fields_ = [
        ("data", c_void_p),
        ("count", c_int64),
        ("stride", c_int64),
        ("components", c_int32),
        ("type", c_int32),
    ]


PROGRESS = ctypes.CFUNCTYPE(c_int, c_void_p, c_char_p, c_double)
FRAME = ctypes.CFUNCTYPE(c_int, c_void_p, c_int32)
MESSAGE = ctypes.CFUNCTYPE(None, c_void_p, c_char_p)
_DOUBLES = ctypes.POINTER(c_double)
FIELD_FUNCTION = ctypes.CFUNCTYPE(c_int, c_void_p, c_int64, _DOUBLES, _DOUBLES, _DOUBLES)


class Callbacks(ctypes.Structure):
    """curlew_callbacks."""

    _fields_ = [("user", c_void_p), ("progress", PROGRESS), ("frame", FRAME), ("message", MESSAGE)]


def _candidates() -> List[Path]:
    package = Path(__file__).resolve().parent
    beside = [package / _NAME, package.parent / _NAME]
    # Installed, the package is prefix/lib/python3/…/curlew. In a checkout, it is plugin/python/curlew, and the build
    # tree is build/.
    above = [parent / _NAME for parent in list(package.parents)[:4]]
    checkout = [top / "build" / _NAME for top in list(package.parents)[2:3]]
    return beside + above + checkout


def find_library() -> str:
    """Returns the path of the shared library.

    This is the path in the environment variable CURLEW_LIBRARY if it is set. Otherwise it is libcurlew.so in this
    package, in one of the four folders above it, or in the build tree of the checkout that contains the package. Raises
    Error if
    none is found.
    """
    given = os.environ.get("CURLEW_LIBRARY")
    if given:
        if not Path(given).is_file():
            raise Error(f"CURLEW_LIBRARY is '{given}', but there is no such file")
        return given
    for path in _candidates():
        if path.is_file():
            return str(path)
    raise Error(f"{_NAME} is not beside the package '{Path(__file__).parent}'; set CURLEW_LIBRARY to its path")


_library: Optional[ctypes.CDLL] = None


def library() -> ctypes.CDLL:
    """Returns the library; loads it at the first call."""
    global _library
    if _library is None:
        _library = _load(find_library())
    return _library


def _let_run(command: Path) -> None:
    """Makes the command executable, since Blender unpacks an add-on without its files' permissions."""
    if command.is_file() and not os.access(command, os.X_OK):
        try:
            command.chmod(0o755)
        except OSError:
            pass  # files are then read in this process


def _load(path: str) -> ctypes.CDLL:
    _let_run(Path(path).with_name("curlew"))
    try:
        lib = ctypes.CDLL(path)
        version = lib.curlew_abi_version()
    except (OSError, AttributeError) as error:
        raise Error(f"cannot load '{path}' on {platform.platform()}: {error}") from error
    if version != ABI_VERSION:
        raise Error(f"'{path}' has version {version} of the interface, but this package needs {ABI_VERSION}")
    session, text, array, place = c_void_p, c_char_p, POINTER(Array), POINTER(c_int64)
    functions = {
        "version": (text, []),
        "registry": (text, []),
        "read_isolated": (c_int32, [c_int32]),
        "error_message": (text, []),
        "error_line": (c_int32, []),
        "error_action": (text, []),
        "error_node": (text, []),
        "session_create": (c_int32, [POINTER(session)]),
        "session_release": (c_int32, [POINTER(session)]),
        "provide_mesh": (c_int32, [session, text, array, array, array]),
        "provide_points": (c_int32, [session, text, array, array, array]),
        "provide_curves": (c_int32, [session, text, array, array]),
        "provide_field": (c_int32, [session, text, c_int32, FIELD_FUNCTION, c_void_p, c_int64]),
        "withdraw": (c_int32, [session, text]),
        "run": (c_int32, [session, text, text, POINTER(Callbacks)]),
        "run_graph": (c_int32, [session, text, text, POINTER(Callbacks)]),
        "check": (c_int32, [text, text]),
        "translate": (c_int32, [text, text, text, POINTER(c_char_p)]),
        "cancel": (c_int32, [session]),
        "count": (c_int32, [session, c_int32, POINTER(c_int64)]),
        "describe": (c_int32, [session, c_int32, c_int64, POINTER(c_char_p)]),
        "read": (c_int32, [session, c_int32, c_int64, text, array]),
        "report": (c_int32, [session, POINTER(c_char_p)]),
        "find": (c_int32, [session, text, POINTER(c_int32), POINTER(c_int64)]),
        "evaluated": (c_int32, [session, POINTER(c_char_p)]),
        "grid_box": (c_int32, [session, c_int64, place, place]),
        "grid_read": (c_int32, [session, c_int64, place, place, array]),
        "grid_leaves": (c_int32, [session, c_int64, POINTER(c_int64)]),
        "grid_leaf": (c_int32, [session, c_int64, c_int64, place, POINTER(c_void_p), POINTER(c_void_p)]),
        "session_field": (c_int32, [session, c_int64, POINTER(c_void_p)]),
        "session_flow": (c_int32, [session, c_int64, POINTER(c_void_p)]),
        "field_release": (None, [POINTER(c_void_p)]),
        "flow_release": (None, [POINTER(c_void_p)]),
        "field_dimension": (c_int32, [c_void_p]),
        "flow_dimension": (c_int32, [c_void_p]),
        "field_evaluate": (c_int32, [c_void_p, array, array, array]),
        "flow_evaluate": (c_int32, [c_void_p, array, array, array]),
    }
    for name, (result, arguments) in functions.items():
        function = getattr(lib, f"curlew_{name}")
        function.restype, function.argtypes = result, arguments
    return lib


def call(name: str, *arguments: Any) -> None:
    """Calls a function that returns a status. Raises Error or Cancelled if it fails."""
    lib = library()
    status = getattr(lib, f"curlew_{name}")(*arguments)
    if status == _OK:
        return
    kind = Cancelled if status == _CANCELLED else Error
    raise kind(
        lib.curlew_error_message().decode(errors="replace"),
        lib.curlew_error_line() or None,
        lib.curlew_error_action().decode(errors="replace") or None,
        lib.curlew_error_node().decode(errors="replace") or None,
    )


def told(name: str, *arguments: Any) -> str:
    """Returns the text that a function passes out through its last argument."""
    text = c_char_p()
    call(name, *arguments, byref(text))
    return (text.value or b"").decode()


def created(name: str, *arguments: Any) -> c_void_p:
    """Returns the handle that a function passes out through its last argument."""
    handle = c_void_p()
    call(name, *arguments, byref(handle))
    return handle


def plain(text: Any, what: str) -> bytes:
    """Encodes text, or a path, for the library. Raises Error if the library cannot take it."""
    text = os.fspath(text) if isinstance(text, os.PathLike) else text
    if not isinstance(text, str):
        raise Error(f"{what} must be text, not {type(text).__name__}")
    if "\0" in text:
        raise Error(f"{what} must not contain the character NUL")
    try:
        return text.encode()
    except UnicodeEncodeError as error:
        raise Error(f"{what} has a character that UTF-8 does not have: {text[error.start]!r}") from error


def quoted(word: str, what: str) -> str:
    """Quotes a word for a line of a program. Raises Error if it contains a line break."""
    if "\n" in word:
        raise Error(f"{what} must not contain a line break: {word!r}")
    return "'" + word.replace("'", "'\"'\"'") + "'"


def escaped(text: str) -> str:
    """Escapes a text for a program, so that it contains no expressions: {, $F, #### and %04d stay as they are."""
    return re.sub(r"([{$#%])", lambda found: "{{" if found[1] == "{" else "$" + found[1], text)


def graph_text(graph: Any) -> str:
    """Returns a graph as text: the text itself, or the JSON of a mapping.

    The values in it may also be other mappings, paths, and NumPy numbers and arrays.
    """
    if isinstance(graph, str):
        return graph
    if not isinstance(graph, Mapping):
        raise Error(f"a program must be text or a dict, not {type(graph).__name__}")
    try:
        return json.dumps(dict(graph), default=_json_of)
    except (TypeError, ValueError) as error:
        raise Error(f"the graph cannot be written as JSON: {error}") from error


def _json_of(value: Any) -> Any:
    if isinstance(value, Mapping):
        return dict(value)
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, (np.ndarray, np.generic)) and not isinstance(value, bytes):
        return value.tolist()
    raise Error(f"a graph must contain text, numbers, lists and dicts, but {value!r} is of type {type(value).__name__}")


def whole(value: Any, what: str) -> int:
    """Returns a whole number of 64 bits. Raises Error if the value is none."""
    try:
        number = operator.index(value)
    except TypeError:
        raise Error(f"{what} must be a whole number, not {value!r}") from None
    if not -(2**63) <= number < 2**63:
        raise Error(f"{what} must be a whole number below 2^63, not {number}")
    return number


def triple(values: Any = (0, 0, 0)) -> Any:
    """Converts three indices for the library."""
    return (c_int64 * 3)(*(int(value) for value in values))


def array_of(values: np.ndarray) -> Array:
    """Returns the library's view of a 1D or 2D array, whose items must be contiguous."""
    components = 1 if values.ndim == 1 else values.shape[1]
    view = Array(values.ctypes.data, values.shape[0], values.strides[0], components, _TYPES[values.dtype.name])
    view.kept = values  # keeps the array alive as long as the view
    return view


def numbers(values: Any, what: str, integers: bool = False) -> np.ndarray:
    """Converts the values to an array of a type that the library supports; without a copy if they already are one."""
    if isinstance(values, np.ma.MaskedArray) and np.ma.is_masked(values):
        raise Error(f"{what} must be an array without masked entries; give their values, or leave them out")
    try:
        array = np.asarray(values)
        if integers and array.size and array.dtype.kind not in "iub":
            raise Error(f"{what} must be whole numbers, not {array.dtype}")
        if array.dtype.kind not in "biufO":
            raise Error(f"{what} must be real numbers, not {array.dtype}")
        if integers and array.dtype == np.uint64 and array.size and array.max() >= 2**63:
            raise Error(f"{what} must be whole numbers below 2^63, not {array.max()}")
        if array.dtype.name not in (("int32", "int64") if integers else ("float32", "float64")):
            array = array.astype(np.int64 if integers else np.float64)
        return array if array.dtype.isnative else array.astype(array.dtype.newbyteorder("="))
    except (TypeError, ValueError) as error:
        raise Error(f"{what} must be an array of numbers: {error}") from error


def usable(values: Any, components: int, what: str, integers: bool = False) -> np.ndarray:
    """Like numbers(), but also checks that each item has `components` numbers, and makes the items contiguous."""
    array = numbers(values, what, integers)
    shape = array.shape
    if array.size == 0 and array.ndim < 2:
        array = array.reshape((0, components) if components > 1 else (0,))
    elif components == 1 and array.ndim == 2 and shape[1] == 1:
        array = array[:, 0]
    if array.ndim != (1 if components == 1 else 2) or (components > 1 and array.shape[1] != components):
        wanted = "(n,)" if components == 1 else f"(n, {components})"
        raise Error(f"{what} must have the shape {wanted}, not {shape}")
    contiguous_items = array.ndim == 1 or array.strides[1] == array.itemsize
    repeated = array.strides[0] == 0  # the library takes a stride of 0 for contiguous items
    return array if contiguous_items and not repeated else np.ascontiguousarray(array)
