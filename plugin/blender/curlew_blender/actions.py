# SPDX-License-Identifier: GPL-3.0-or-later
"""What the registry says about actions, their sockets and options, and values as text. Needs no Blender."""

import math
import shlex
from dataclasses import dataclass
from typing import Any, Dict, FrozenSet, List, Mapping, Optional, Tuple

import numpy as np

MOST_INT = 2**31 - 1  # of Blender's properties
# What only texts and the command line need.
NO_NODE = frozenset({"config", "help", "list", "set", "version"})
_NO_SOCKET = frozenset({"report", "file"})
_MOST_SOCKETS, _MOST_IMAGES = 4, 9


class TreeError(Exception):
    """Something is wrong with a node; "" is the key of none."""

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
    implied: Mapping[str, str]  # what other options are beside this one, unless they are given

    @property
    def description(self) -> str:
        """The help text, with the unit."""
        return self.help + (f" [{self.unit}]" if self.unit else "")


@dataclass(frozen=True)
class Socket:
    """A socket of a node: one object that its action takes or makes."""

    label: str
    name: str  # of the input or the output; several sockets may share one
    kinds: FrozenSet[str]
    number: int = 0  # among the sockets of that name
    primary: bool = False  # of an output: what a link by the node's name alone means


@dataclass(frozen=True)
class Action:
    """One action: what a node stands for."""

    name: str
    group: str
    summary: str
    takes: Tuple[Socket, ...]
    makes: Tuple[Socket, ...]
    options: Tuple[Option, ...]
    words: str  # what its words are; "" for none
    fewest_words: int
    most_words: int

    def option(self, name: str) -> Option:
        """The option of that name, or of that unique beginning of one."""
        found = [o for o in self.options if o.name == name] or [o for o in self.options if o.name.startswith(name)]
        if len(found) != 1:
            known = ", ".join(o.name for o in self.options) or "none"
            raise ValueError(f"-{self.name} has no option '{name}'; its options are {known}")
        return found[0]

    def implied(self, given: Mapping[str, str]) -> Dict[str, str]:
        """What options have that are not given, because others are."""
        texts = {name: text for o in self.options if o.name in given for name, text in o.implied.items()}
        return {name: text for name, text in texts.items() if name not in given}

    def has(self, name: str) -> bool:
        """Whether there is an option of that name."""
        return any(o.name == name for o in self.options)


def _bound(value: Any, otherwise: float) -> float:
    return otherwise if value is None else float(value)


def _label(name: str, number: int) -> str:
    known = {"levelSet": "Level Set", "what": "Object"}
    label = name if len(name) == 1 else known.get(name, name.capitalize())
    return f"{label} {number + 1}" if number else label


def _sockets(entries: List[Mapping[str, Any]]) -> Tuple[Socket, ...]:
    """Those of inputs or outputs, a few for one that takes or makes many objects."""
    always = [e["name"] for e in entries if e["minimum"] > 0 and not e.get("flag")]
    sockets: List[Socket] = []
    for entry in entries:
        name, kinds = entry["name"], frozenset(entry["kinds"]) - _NO_SOCKET
        most = _MOST_IMAGES if kinds == {"image"} else _MOST_SOCKETS
        for number in range(min(entry["maximum"], most) if kinds else 0):
            sockets.append(Socket(_label(name, number), name, kinds, number, name in always[-1:]))
    return tuple(sockets)


def actions_of(registry: Mapping[str, Any]) -> Dict[str, Action]:
    """The registry's JSON as actions by name, in its order."""
    result: Dict[str, Action] = {}
    for entry in registry["actions"]:
        options = tuple(
            # A length is a number; "5%" is kept as text, as an expression is.
            Option(**{**{name: o[name] for name in Option.__dataclass_fields__}, "choices": tuple(o["choices"]),
                      "type": "real" if o["type"] == "length" else o["type"],
                      "lower": _bound(o["lower"], -math.inf), "upper": _bound(o["upper"], math.inf)})
            for o in entry["options"]
            if not o["selects"]  # links say what is taken
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
        )
    return result


def number_text(value: float) -> str:
    """The shortest decimal that is this float32."""
    text = str(np.float32(value))
    return text[:-2] if text.endswith(".0") else text


def numbers(text: str) -> List[float]:
    """The numbers of "1,2,3"; ValueError where one is none."""
    return [float(part) for part in text.split(",")]


def value_text(option: Option, value: Any) -> str:
    """A property's value as a scene writes it."""
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
    """The value for the property of a text; None where only the text itself can hold it."""
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
        return None  # more digits than the property has
    if option.type == "real":
        return values[0] if len(values) == 1 else None
    size = {"vector": 3, "interval": 2, "box": 6}[option.type]
    if option.type == "vector" and len(values) == 1:
        values = values * 3
    return tuple(values) if len(values) == size else None


def option_range(option: Option) -> Tuple[float, float]:
    """The range as a float32 property has it, an excluded bound left out."""
    largest = float(np.finfo(np.float32).max)
    lower, upper = max(option.lower, -largest), min(option.upper, largest)
    if option.exclusive and math.isfinite(option.lower):
        lower = float(np.nextafter(np.float32(lower), np.float32(np.inf)))
        if lower < 1e-30:
            lower = 1e-30  # not a denormal number
    return lower, upper


def split_words(text: str) -> List[str]:
    """The words of a text, as shlex.join() writes them: quotes join. Throws ValueError if a quote does not end."""
    lexer = shlex.shlex(text, posix=True)
    lexer.whitespace_split, lexer.escape, lexer.commenters = True, "", ""
    return list(lexer)
