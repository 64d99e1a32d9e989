# SPDX-License-Identifier: GPL-3.0-or-later
"""The actions of the registry with their sockets and options, and the conversion of values to text. Does not need
Blender."""

import math
import os
import re
import shlex
from dataclasses import dataclass
from typing import Any, Dict, FrozenSet, List, Mapping, Optional, Tuple

import numpy as np

MOST_INT = 2**31 - 1  # largest value of Blender's integer properties
# Actions that only make sense in texts and on the command line.
NO_NODE = frozenset({"config", "help", "list", "set", "version"})
_NO_SOCKET = frozenset({"report", "file"})
_MOST_SOCKETS, _MOST_IMAGES = 4, 9


# Names of options as artists know them from Blender. Others are those of the registry, in words.
LABELS = {
    "alpha": "Evolution",
    "aim": "Camera Target",
    "box": "Region",
    "dim": "Resolution",
    "dt": "Time Step",
    "eye": "Camera Position",
    "fov": "Field of View",
    "fps": "Frames per Second",
    "gain": "Roughness",
    "half": "Half Precision",
    "halfWidth": "Band Half Width",
    "iso": "Isovalue",
    "keep": "Keep Input",
    "layer": "Wall Thickness",
    "life": "Lifetime",
    "loop": "Loop Length",
    "name": "Grid Name",
    "octaveAlpha": "Evolution of Octaves",
    "on": "Emit From",
    "pathlines": "Keep Pathlines",
    "potentials": "Store f and g",
    "rate": "Points per Second",
    "reproject": "Keep on Track",
    "rotate": "Rotation",
    "rotation": "Rotation Method",
    "scheme": "Integrator",
    "spread": "Lifetime Randomness",
    "translate": "Location",
    "viewBox": "View Region",
    "voxel": "Voxel Size",
    "wallFade": "Fade at Walls",
}


class TreeError(Exception):
    """An error of a node; the key is "" if the error is not related to a node."""

    def __init__(self, key: str, message: str) -> None:
        super().__init__(message)
        self.key = key


@dataclass(frozen=True)
class Option:
    """One option of an action."""

    name: str
    type: str
    default: str
    help: str
    unit: str
    choices: Tuple[str, ...]
    lower: float
    upper: float
    exclusive: bool
    implied: Mapping[str, str]  # values that this option implies for others that are not given
    formerly: Tuple[str, ...] = ()  # names that it had in the last release
    only_with: Tuple[str, ...] = ()  # conditions, of which one must hold for an effect: "method=curl", "iso=" (given), ".vdb" (file)

    @property
    def label(self) -> str:
        """The name in the user interface."""
        return LABELS.get(self.name) or re.sub(r"(?<=[a-z])(?=[A-Z])", " ", self.name).title()

    @property
    def description(self) -> str:
        """The help text with the unit, and the option's name in scenes if the label differs."""
        unit = f" [{self.unit}]" if self.unit else ""
        only = f"; only with {' or '.join(self.only_with)}" if self.only_with else ""
        return self.help + only + unit + ("" if self.label.lower() == self.name.lower() else f" ({self.name}= in scenes)")


@dataclass(frozen=True)
class Socket:
    """A socket of a node: one object that its action takes or makes."""

    label: str
    name: str  # of the input or output; several sockets may share a name
    kinds: FrozenSet[str]
    number: int = 0  # index among the sockets with this name
    primary: bool = False  # whether the node's name alone refers to this output
    flag: str = ""  # option that an output needs to be 1; "" if it is always made


@dataclass(frozen=True)
class Action:
    """An action, which a node represents."""

    name: str
    group: str
    summary: str
    takes: Tuple[Socket, ...]
    makes: Tuple[Socket, ...]
    options: Tuple[Option, ...]
    words: str  # what the words mean; "" if the action takes none
    fewest_words: int
    most_words: int
    writes: bool = False  # whether the words name files that it may write
    varies: bool = False  # whether it changes with time, whatever the options

    def option(self, name: str) -> Option:
        """Returns the option with this name, former name or unique prefix. Raises ValueError if there is none."""
        found = ([o for o in self.options if o.name == name] or [o for o in self.options if name in o.formerly]
                 or [o for o in self.options if o.name.startswith(name)])
        if len(found) != 1:
            known = ", ".join(o.name for o in self.options) or "none"
            raise ValueError(f"-{self.name} has no option '{name}'; its options are {known}")
        return found[0]

    def has_effect(self, option: Option, given: Mapping[str, str], files: str = "") -> bool:
        """Returns whether an option has an effect with the given ones, and with the names of files."""
        form = given.get("format", "auto")
        endings = ["." + form] if form != "auto" else _endings(files)

        def holds(condition: str) -> bool:
            if condition.startswith("."):
                return condition in endings
            name, wanted = condition.split("=", 1)
            return given.get(name, self.option(name).default) == wanted if wanted else name in given

        return not option.only_with or any(map(holds, option.only_with))

    def implied(self, given: Mapping[str, str]) -> Dict[str, str]:
        """Returns the values that the given options imply for others that are not given."""
        texts = {name: text for o in self.options if o.name in given for name, text in o.implied.items()}
        return {name: text for name, text in texts.items() if name not in given}

    def has(self, name: str) -> bool:
        """Returns whether there is an option with this name."""
        return any(o.name == name for o in self.options)


def _bound(value: Any, otherwise: float) -> float:
    return otherwise if value is None else float(value)


def _label(name: str, number: int) -> str:
    known = {"levelSet": "Level Set", "what": "Object"}
    label = name if len(name) == 1 else known.get(name, name.capitalize())
    return f"{label} {number + 1}" if number else label


def _sockets(entries: List[Mapping[str, Any]]) -> Tuple[Socket, ...]:
    """Returns the sockets of inputs or outputs; several for an input or output of many objects."""
    always = [e["name"] for e in entries if e["minimum"] > 0 and not e.get("flag")]
    sockets: List[Socket] = []
    for entry in entries:
        name, kinds = entry["name"], frozenset(entry["kinds"]) - _NO_SOCKET
        most = _MOST_IMAGES if kinds == {"image"} else _MOST_SOCKETS
        for number in range(min(entry["maximum"], most) if kinds else 0):
            sockets.append(Socket(_label(name, number), name, kinds, number, name in always[-1:], entry.get("flag", "")))
    return tuple(sockets)


def actions_of(registry: Mapping[str, Any]) -> Dict[str, Action]:
    """Converts the registry's JSON to actions by name, in the registry's order."""
    result: Dict[str, Action] = {}
    for entry in registry["actions"]:
        options = tuple(
            # A length is a number; a relative one such as "5%" is kept as text, like an expression.
            Option(**{**{name: o[name] for name in Option.__dataclass_fields__}, "choices": tuple(o["choices"]),
                      "formerly": tuple(o["formerly"]), "only_with": tuple(o["only_with"]),
                      "type": "real" if o["type"] == "length" else o["type"],
                      "lower": _bound(o["lower"], -math.inf), "upper": _bound(o["upper"], math.inf)})
            for o in entry["options"]
            if not o["selects"]  # links select the inputs
        )
        words = entry["positional"]
        result[entry["name"]] = Action(
            name=entry["name"],
            group=entry["group"],
            summary=entry["summary"],
            takes=_sockets(entry["inputs"]),
            makes=_sockets(entry["outputs"]),
            options=options,
            words=words["what"],
            fewest_words=words["minimum"],
            most_words=words["maximum"],
            writes=any("file" in output["kinds"] for output in entry["outputs"]),
            varies=entry["varies"],
        )
    return result


def number_text(value: float) -> str:
    """Returns the shortest decimal text of this float32."""
    text = str(np.float32(value))
    return text[:-2] if text.endswith(".0") else text


def numbers(text: str) -> List[float]:
    """Returns the numbers in "1,2,3". Raises ValueError if one is invalid."""
    return [float(part) for part in text.split(",")]


def value_text(option: Option, value: Any) -> str:
    """Returns a property's value as a scene's text."""
    if option.type == "flag":
        return "1" if value else "0"
    if option.type == "integer":
        return str(int(value))
    if option.type == "real":
        return number_text(value)
    if option.type in ("vector", "interval", "box"):
        return ",".join(number_text(v) for v in value)
    return str(value)


def property_value(option: Option, text: str) -> Optional[Any]:
    """Returns the property's value for a text; None if the property cannot represent the text."""
    if "{" in text or "$" in text:
        return None
    if option.type == "flag":
        return text == "1" if text in ("0", "1") else None
    if option.type == "choice":
        return text if text in option.choices else None
    if option.type in ("text", "ages", "coordinates"):
        return text
    try:
        values = numbers(text)
    except ValueError:
        return None
    if option.type == "integer":
        exact = len(values) == 1 and values[0] == math.floor(values[0]) and abs(values[0]) <= MOST_INT
        return int(values[0]) if exact else None
    if any(float(number_text(v)) != v for v in values):
        return None  # more digits than the property can hold
    if option.type == "real":
        return values[0] if len(values) == 1 else None
    size = {"vector": 3, "interval": 2, "box": 6}[option.type]
    if option.type == "vector" and len(values) == 1:
        values = values * 3
    return tuple(values) if len(values) == size else None


def fitting_text(option: Option, text: str) -> str:
    """Returns the text of numbers as an option takes it: whole for an integer, 0 or 1 for a flag. Expressions stay."""
    if option.type not in ("integer", "flag") or "{" in text:
        return text
    first = numbers(text)[0]
    return str(round(first)) if option.type == "integer" else str(int(first != 0))


def option_range(option: Option) -> Tuple[float, float]:
    """Returns the range for a float32 property, without an excluded bound."""
    largest = float(np.finfo(np.float32).max)
    lower, upper = max(option.lower, -largest), min(option.upper, largest)
    if option.exclusive and math.isfinite(option.lower):
        lower = float(np.nextafter(np.float32(lower), np.float32(np.inf)))
        if lower < 1e-30:
            lower = 1e-30  # avoids denormal numbers
    return lower, upper


def _endings(files: str) -> List[str]:
    """Returns the extensions of files; none while a quote is not closed."""
    try:
        return [os.path.splitext(name)[1].lower() for name in split_words(files)]
    except ValueError:
        return []


def split_words(text: str) -> List[str]:
    """Splits a text into words, in the form that shlex.join() writes. Raises ValueError if a quote is not closed."""
    lexer = shlex.shlex(text, posix=True)
    lexer.whitespace_split, lexer.escape, lexer.commenters = True, "", ""
    return list(lexer)
