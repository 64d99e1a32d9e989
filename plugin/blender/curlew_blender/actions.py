"""What the registry says about actions and their options, and values as a scene writes them. Needs no Blender."""

import math
from dataclasses import dataclass
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np

MOST_INT = 2**31 - 1  # of Blender's properties


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

    @property
    def description(self) -> str:
        """The help text, with the unit."""
        return self.help + (f" [{self.unit}]" if self.unit else "")


@dataclass(frozen=True)
class Socket:
    """What an action takes or makes, in the registry's words."""

    name: str
    kinds: Tuple[str, ...]
    minimum: int
    maximum: int
    use: str  # of what is taken: "stays", "taken" or "changed"
    age: str
    flag: str


@dataclass(frozen=True)
class Action:
    """One action: what a node stands for."""

    name: str
    group: str
    summary: str
    inputs: Tuple[Socket, ...]
    outputs: Tuple[Socket, ...]
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

    def has(self, name: str) -> bool:
        """Whether there is an option of that name."""
        return any(o.name == name for o in self.options)


def _bound(value: Any, otherwise: float) -> float:
    return otherwise if value is None else float(value)


def _sockets(entries: Sequence[Mapping[str, Any]]) -> Tuple[Socket, ...]:
    return tuple(
        Socket(
            name=e["name"],
            kinds=tuple(e["kinds"]),
            minimum=int(e["minimum"]),
            maximum=int(e["maximum"]),
            use=e.get("use", ""),
            age=e.get("age", ""),
            flag=e.get("flag", ""),
        )
        for e in entries
    )


def actions_of(registry: Mapping[str, Any]) -> Dict[str, Action]:
    """The registry's JSON as actions by name, in its order."""
    result: Dict[str, Action] = {}
    for entry in registry["actions"]:
        options = tuple(
            Option(
                name=o["name"],
                type=o["type"],
                default=o.get("default") or "",
                help=o.get("help") or "",
                unit=o.get("unit") or "",
                choices=tuple(o.get("choices") or ()),
                lower=_bound(o.get("lower"), -math.inf),
                upper=_bound(o.get("upper"), math.inf),
                exclusive=bool(o.get("exclusive")),
            )
            for o in entry.get("options", ())
        )
        words = entry.get("positional") or {}
        result[entry["name"]] = Action(
            name=entry["name"],
            group=entry.get("group") or "other",
            summary=entry.get("summary") or "",
            inputs=_sockets(entry["inputs"]),
            outputs=_sockets(entry["outputs"]),
            options=options,
            words=words.get("what") or "",
            fewest_words=int(words.get("minimum") or 0),
            most_words=int(words.get("maximum") or 0),
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


def quoted(word: str) -> str:
    """The word as a scene has it, so that it is read as one."""
    if word and not any(c in " \t\r\n#'\"\\" for c in word):
        return word
    return '"' + word.replace('"', '"\'"\'"') + '"'


def split_words(line: str) -> List[str]:
    """The words of a line of a scene: quotes join, # begins a comment. ValueError where a quote does not end."""
    words: List[str] = []
    word, inside, quote = "", False, ""
    for c in line:
        if quote:
            if c == quote:
                quote = ""
            else:
                word += c
        elif c in "\"'":
            quote, inside = c, True
        elif c in " \t\r":
            if inside:
                words.append(word)
            word, inside = "", False
        elif c == "#" and not inside:
            break
        else:
            word += c
            inside = True
    if quote:
        raise ValueError(f"a quote {quote} does not end")
    if inside:
        words.append(word)
    return words


def line_of(action: str, words: Sequence[str], options: Mapping[str, str]) -> str:
    """One line of a scene."""
    parts = [action] + [quoted(w) for w in words] + [quoted(f"{k}={v}") for k, v in options.items()]
    return " ".join(parts)
