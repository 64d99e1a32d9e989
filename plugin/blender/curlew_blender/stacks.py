"""The stacks of a program as it would run: who made what is where. Needs no Blender."""

from dataclasses import dataclass
from typing import AbstractSet, Dict, Iterable, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from .actions import Action
from .slots import GEOMETRY, GRIDS, STACKS, Slot


class Ref(NamedTuple):
    """An output socket of a node."""

    key: str
    output: int


@dataclass(eq=False)
class Entry:
    """One object on a stack. One that has been changed since is no longer that of its ref."""

    ref: Optional[Ref]
    kind: str
    made: int
    dimensions: int = 3


class Stacks:
    """What is on the stacks, without the things themselves."""

    def __init__(self) -> None:
        self._entries: Dict[str, List[Entry]] = {name: [] for name in set(STACKS.values())}
        self._clock = 0

    def push(self, ref: Ref, kind: str, dimensions: int = 3) -> Entry:
        """Puts an object on its stack."""
        self._clock += 1
        entry = Entry(ref, kind, self._clock, dimensions)
        self._entries[STACKS[kind]].append(entry)
        return entry

    def remove(self, entry: Entry) -> None:
        """Takes an object from its stack."""
        self._entries[STACKS[entry.kind]].remove(entry)

    def all(self) -> Iterable[Entry]:
        """All objects, in no order that means anything."""
        return [entry for stack in self._entries.values() for entry in stack]

    def newest(self, kinds: AbstractSet[str]) -> List[Entry]:
        """Those of some kinds, the newest first."""
        return sorted((e for e in self.all() if e.kind in kinds), key=lambda e: -e.made)

    def find(self, ref: Ref) -> Optional[Entry]:
        """The newest object that this output has made, if it is still there."""
        return next((e for e in sorted(self.all(), key=lambda e: -e.made) if e.ref == ref), None)

    def age(self, entry: Entry, kinds: AbstractSet[str]) -> int:
        """Its position among those of some kinds."""
        return self.newest(kinds).index(entry)

    def taken(self, slots: Sequence[Slot]) -> List[Optional[Entry]]:
        """What an action with these slots takes."""
        result: List[Optional[Entry]] = []
        for k, slot in enumerate(slots):
            rank = sum(1 for later in slots[k + 1:] if later.kinds == slot.kinds)
            there = self.newest(slot.kinds)
            result.append(there[rank] if rank < len(there) else None)
        return result


# What of the geometry a file can hold.
HOLDS = {
    ".vdb": frozenset({"points", "curves"}), ".ply": GEOMETRY, ".csv": frozenset({"points", "curves"}),
    ".obj": frozenset({"mesh", "curves"}), ".png": frozenset(), ".exr": frozenset(), ".json": frozenset(),
}


def extension(file: str) -> str:
    """".vdb" of a file's name, in lower case."""
    dot = file.rfind(".")
    return file[dot:].lower() if dot > file.rfind("/") else ""


def write_options(stacks: Stacks, file: str, entries: Sequence[Entry]) -> Dict[str, str]:
    """The ages with which `write` puts these objects into a file; none where it would take them anyhow. ValueError where
    the file cannot hold one."""
    ending = extension(file)
    if ending not in HOLDS:
        raise ValueError(f"'{file}' has no known extension; it can be {' '.join(HOLDS)}")
    ages: Dict[str, List[str]] = {}
    for entry in entries:
        if entry.kind in GRIDS and ending == ".vdb":
            ages.setdefault("grid", []).append(str(stacks.age(entry, GRIDS)))
        elif entry.kind in HOLDS[ending]:
            ages.setdefault("geo", []).append(str(stacks.age(entry, HOLDS[ending])))
        elif entry.kind == "image" and ending in (".png", ".exr"):
            ages.setdefault("image", []).append(str(stacks.age(entry, {"image"})))
        elif ending != ".json":
            raise ValueError(f"a {ending} file does not hold {entry.kind}")
    plain = written_entries(stacks, file, {})
    return {} if list(entries) == plain else {name: ",".join(each) for name, each in ages.items()}


def written_entries(stacks: Stacks, file: str, options: Mapping[str, str]) -> List[Entry]:
    """What `write` puts into a file."""
    ending = extension(file)
    if ending in (".png", ".exr"):
        return _at(stacks, {"image"}, options.get("image", "0"))
    if ending == ".vdb" and ("grid" in options or "geo" in options):
        return _at(stacks, GRIDS, options.get("grid", "")) + _at(stacks, HOLDS[ending], options.get("geo", ""))
    if ending == ".vdb":
        return stacks.newest(GRIDS | HOLDS[ending])[:1]
    return _at(stacks, HOLDS.get(ending, frozenset()), options.get("geo", "0"))


def _at(stacks: Stacks, kinds: AbstractSet[str], ages: str) -> List[Entry]:
    there = stacks.newest(kinds)
    return [there[int(age)] for age in ages.split(",") if age.isdigit() and int(age) < len(there)]


def kinds_read(action: Action, words: Sequence[str], options: Mapping[str, str]) -> List[Tuple[int, str]]:
    """What `read` pushes, as far as names tell: output sockets and kinds. A grid may be a level set."""
    made: List[Tuple[int, str]] = []
    grids = 0
    for word in words:
        if extension(word) != ".vdb":
            made.append((0, "mesh"))
            continue
        for _ in options.get("grids", "all").split(","):
            grids = min(grids + 1, 4)
            made.append((grids, "grid"))
    return made
