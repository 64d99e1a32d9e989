"""What each action takes from the stacks and puts on them, as sockets. Needs no Blender.

A slot takes the newest object, across stacks, whose kind is among its kinds; of slots with the same kinds the first takes the
older one.
"""

from dataclasses import dataclass
from typing import FrozenSet, List, Mapping, Sequence, Tuple

from .actions import Action, Socket

# The kinds of objects, and the stack that each is on. A noise is a field that is no shape.
STACKS = {
    "noise": "fields", "shape": "fields", "flow": "flows", "grid": "grids", "velocity": "grids", "levelSet": "grids",
    "mesh": "geometry", "points": "geometry", "curves": "geometry", "image": "images",
}
FIELDS = frozenset({"noise", "shape"})
GRIDS = frozenset({"grid", "velocity", "levelSet"})
GEOMETRY = frozenset({"mesh", "points", "curves"})
DOMAIN = frozenset({"flow", "shape", "levelSet"})
_WIDER = {"field": FIELDS, "grid": GRIDS}

# What follows points or grids from frame to frame.
EACH_FRAME = frozenset({"advect", "emit", "kill", "wrap", "advectLevelSet", "advectGrid"})
# Points that there are from the first frame on.
ONCE = frozenset({"scatter", "jitter"})
# What says something about the whole run, and stands at its beginning.
FIRST = ("quiet", "verbose", "threads", "set", "resume")
# What a tree does not need: the command line does.
NO_NODE = frozenset({"config", "help", "list", "version"})

_MOST_SOCKETS, _MOST_IMAGES = 4, 9


@dataclass(frozen=True)
class Slot:
    """An input socket."""

    name: str
    kinds: FrozenSet[str]
    stays: bool = True  # else what is taken leaves its stack
    changed: bool = False  # or becomes the output, in its place
    optional: bool = False
    age: str = ""  # the option that chooses one by its position ...
    among: FrozenSet[str] = frozenset()  # ... among these kinds


@dataclass(frozen=True)
class Made:
    """An output socket."""

    name: str
    kind: str
    flag: str = ""  # the option that has to be on for it
    as_taken: bool = False  # of the kind of what was taken


def _kinds(socket: Socket) -> FrozenSet[str]:
    kinds: FrozenSet[str] = frozenset()
    for kind in socket.kinds:
        if kind in STACKS or kind in _WIDER:
            kinds |= _WIDER.get(kind, frozenset({kind}))
    return kinds


def _title(name: str) -> str:
    return name if len(name) == 1 else {"levelSet": "Level Set", "what": "Object"}.get(name, name.capitalize())


def _numbered(name: str, count: int) -> List[str]:
    return [name if k == 0 else f"{name} {k + 1}" for k in range(count)]


def _among(age: str, kinds: FrozenSet[str]) -> FrozenSet[str]:
    if not age:
        return frozenset()
    if kinds == {"image"}:
        return kinds
    if age == "geo":
        return kinds if kinds == {"points"} else GEOMETRY
    return FIELDS if age == "field" else GRIDS


def slots_of(action: Action) -> Tuple[Slot, ...]:
    """The input sockets of an action."""
    slots: List[Slot] = []
    for socket in action.inputs:
        kinds = _kinds(socket)
        most = _MOST_IMAGES if kinds == {"image"} else _MOST_SOCKETS if kinds else 0
        for k, name in enumerate(_numbered(_title(socket.name), min(socket.maximum, most))):
            slots.append(Slot(name, kinds, stays=socket.use == "stays", changed=socket.use == "changed",
                              optional=k >= socket.minimum, age=socket.age, among=_among(socket.age, kinds)))
    return tuple(slots)


def on_request(action: Action, slot: Slot) -> bool:
    """Whether a slot only counts where over=1 asks for it: the picture that is drawn into."""
    return slot.changed and slot.optional and action.has("over")


def pairs(slots: Sequence[Slot]) -> bool:
    """Whether one option gives the ages of two slots, that of the second first."""
    return len(slots) == 2 and slots[0].age != "" and slots[0].age == slots[1].age


def made_of(action: Action) -> Tuple[Made, ...]:
    """The output sockets of an action, in the order in which it pushes them."""
    made: List[Made] = []
    for socket in action.outputs:
        kinds = [kind for kind in socket.kinds if kind in STACKS or kind in _WIDER]
        if not kinds:
            continue
        count = _MOST_SOCKETS if socket.maximum > 1 and kinds == ["grid"] else 1
        as_taken = len(kinds) > 1 or (kinds == ["grid"] and any(s.use == "taken" for s in action.inputs))
        for name in _numbered(_title(socket.name), count):
            made.append(Made(name, "noise" if kinds[0] == "field" else kinds[0], socket.flag, as_taken))
    return tuple(made)


def pushed(action: Action, options: Mapping[str, str], taken: Sequence[str]) -> List[Tuple[int, str]]:
    """What one use of an action pushes, oldest first: the index of its output socket, and its kind. `taken` are the kinds
    of what it has taken."""
    result: List[Tuple[int, str]] = []
    for k, made in enumerate(made_of(action)):
        if made.flag and options.get(made.flag, "0") != "1":
            continue
        kind = made.kind
        if made.as_taken and STACKS[kind] == "fields":
            # A shape that is scaled alike along all axes stays one.
            kind = "shape" if "shape" in taken and len(set(options.get("scale", "1").split(","))) == 1 else "noise"
        elif made.as_taken:
            kind = next((t for t in taken if STACKS[t] == STACKS[kind]), kind)
        result.append((k, kind))
    return result
