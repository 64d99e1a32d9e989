"""From a graph of nodes to a program on stacks: actions in an order in which each takes what is linked to it.

Stacks only give the newest object. What is wanted again later is kept, or chosen by its age where the action can, or made
again: an action makes the same from the same. Needs no Blender.
"""

import re
from dataclasses import dataclass, field
from typing import Dict, List, Mapping, Optional, Sequence, Set, Tuple

from .actions import Action, line_of
from .slots import DOMAIN, EACH_FRAME, FIRST, GRIDS, ONCE, Slot, made_of, on_request, pairs, pushed, slots_of
from .stacks import Entry, Ref, Stacks, extension, kinds_read, write_options

_VARIES = re.compile(r"\$F|\{[^}]*\b(F|FF|T)\b[^}]*\}")
_HEAVY = frozenset({"grid", "levelSet", "mesh", "flow"})
_ATTEMPTS = 6


class TreeError(Exception):
    """Something is wrong with a node."""

    def __init__(self, key: str, message: str) -> None:
        super().__init__(message)
        self.key = key


@dataclass
class GraphNode:
    """A node as the program needs it: no reroutes, groups or muted nodes any more."""

    key: str
    action: str
    words: List[str] = field(default_factory=list)
    options: Dict[str, str] = field(default_factory=dict)
    inputs: List[Optional[Ref]] = field(default_factory=list)
    when: str = ""  # "once": before the first frame; "frame": in each; "": as it depends on time
    order: float = 0
    reads: Optional[List[Tuple[int, str]]] = None  # of `read`: what the files hold, if that is known


@dataclass
class Wanted:
    """An object that has to be on its stack in the end (of each frame)."""

    key: str
    kind: str
    ref: Optional[Ref]


@dataclass
class Program:
    """A scene, and whose its lines are."""

    lines: List[str] = field(default_factory=list)
    keys: List[str] = field(default_factory=list)
    ages: Dict[str, int] = field(default_factory=dict)  # of what was wanted, among its kind

    @property
    def text(self) -> str:
        """The scene."""
        return "".join(line + "\n" for line in self.lines)

    def key_of(self, line: Optional[int]) -> Optional[str]:
        """The node of a line, counted from 1."""
        return self.keys[line - 1] if line is not None and 0 < line <= len(self.keys) else None


def program_of(
    graph: Mapping[str, GraphNode],
    actions: Mapping[str, Action],
    frames: Optional[str] = None,
    wanted: Sequence[Wanted] = (),
) -> Program:
    """The program of a graph: what leads to a sink (a node that makes nothing), or to what is wanted. `frames`:
    the words of -frames, where it is a sequence. Throws TreeError."""
    return _Planner(graph, actions, frames, wanted).run()


def _only_reports(node: GraphNode) -> bool:
    """Whether it writes the report, which is on no stack."""
    return node.action == "write" and bool(node.words) and all(extension(word) == ".json" for word in node.words)


class _Planner:
    def __init__(self, graph: Mapping[str, GraphNode], actions: Mapping[str, Action], frames: Optional[str],
                 wanted: Sequence[Wanted]) -> None:
        self._graph = graph
        self._actions = actions
        self._frames = frames
        self._wanted = wanted
        self._stacks = Stacks()
        self._program = Program()
        self._active: List[str] = []
        self._done: Set[str] = set()
        self._varying: Dict[str, bool] = {}
        self._in_frame = False

    # --- the whole

    def run(self) -> Program:
        self._check()
        sinks = sorted((n for n in self._graph.values() if self._is_sink(n)), key=lambda n: n.order)
        for node in sinks:
            if node.action in FIRST:
                self._emit(node.key)
        rest = [n for n in sinks if n.action not in FIRST and n.action != "frames"]
        for key in self._upstream([n.key for n in rest] + [w.ref.key for w in self._wanted if w.ref]):
            if self._graph[key].action in ONCE and not self._varies(key) and not any(self._graph[key].inputs):
                self._emit(key)  # in a box: before there is a flow whose domain would count
        if self._frames is None:
            self._emit_all(rest)
        else:
            still = [n for n in rest if not self._varies(n.key)]
            moving = [n for n in rest if self._varies(n.key)]
            for node in still:
                self._emit(node.key)
            roots = [n.key for n in moving] + [w.ref.key for w in self._wanted if w.ref]
            for key in self._upstream(roots):
                self._before_frames(key)
            self._line("frames", self._frames.split(" "), {}, next((n.key for n in sinks if n.action == "frames"), ""))
            for entry in self._stacks.all():
                if entry.ref and self._varies(entry.ref.key):
                    entry.ref = None  # of another time
            self._in_frame = True
            self._done = {key for key in self._done if not self._varies(key)}
            self._emit_all(moving)
        return self._program

    def _emit_all(self, sinks: Sequence[GraphNode]) -> None:
        for node in sinks:
            self._emit(node.key)
        for want in self._wanted:
            if want.ref is None:
                raise TreeError(want.key, f"nothing is connected: it needs {want.kind}")
        for _ in range(len(self._wanted) + 1):
            missing = [w for w in self._wanted if w.ref and not self._stacks.find(w.ref)]
            for want in missing:
                if want.ref and not self._stacks.find(want.ref):
                    self._emit(want.ref.key)
        for want in self._wanted:
            entry = self._stacks.find(want.ref) if want.ref else None
            if entry is None:
                raise TreeError(want.key, "what it shows is moved on by another node; give each its own points")
            same = GRIDS if want.kind == "grid" else {want.kind}
            if entry.kind not in same:
                raise TreeError(want.key, f"it needs {want.kind}, not {entry.kind}")
            self._program.ages[want.key] = self._stacks.age(entry, same)

    def _before_frames(self, key: str) -> None:
        """Puts there what a frame needs that does not change, and the points that it moves."""
        node = self._graph[key]
        if not self._varies(key):
            return
        for ref in node.inputs:
            if ref and not self._varies(ref.key) and not self._stacks.find(ref):
                self._prepare(ref.key)
                self._emit(ref.key)

    def _is_sink(self, node: GraphNode) -> bool:
        if node.action in FIRST or node.action == "frames":
            return True
        return not made_of(self._actions[node.action])

    def _check(self) -> None:
        for node in self._graph.values():
            if node.action not in self._actions:
                raise TreeError(node.key, f"there is no action '{node.action}' in this version of Curlew")
            for ref in node.inputs:
                if ref and ref.key not in self._graph:
                    raise TreeError(node.key, "is linked to a node that is not there")
        state: Dict[str, int] = {}
        for start in self._graph:
            path: List[Tuple[str, int]] = [(start, 0)]
            while path:
                key, k = path.pop()
                if k == 0 and state.get(key) == 2:
                    continue
                state[key] = 1
                inputs = self._graph[key].inputs
                if k == len(inputs):
                    state[key] = 2
                    continue
                path.append((key, k + 1))
                ref = inputs[k]
                if ref and state.get(ref.key) == 1:
                    raise TreeError(key, "the links go in a circle")
                if ref and state.get(ref.key) != 2:
                    path.append((ref.key, 0))

    def _varies(self, key: str) -> bool:
        """Whether it is of a moment: it stands after -frames."""
        if key not in self._varying:
            node = self._graph[key]
            texts = list(node.words) + list(node.options.values())
            varies = node.when == "frame" or node.action in EACH_FRAME or any(_VARIES.search(t) for t in texts)
            if node.action not in ONCE and not varies:
                varies = any(self._varies(ref.key) for ref in node.inputs if ref)
            self._varying[key] = varies and node.when != "once"
        return self._varying[key]

    def _upstream(self, keys: Sequence[str]) -> List[str]:
        """All that these need, and they themselves, what is needed first."""
        order: List[str] = []
        seen: Set[str] = set()

        def visit(key: str) -> None:
            if key in seen:
                return
            seen.add(key)
            for ref in self._graph[key].inputs:
                if ref:
                    visit(ref.key)
            order.append(key)

        for key in keys:
            visit(key)
        return order

    # --- one node

    def _linked(self, node: GraphNode) -> Tuple[List[Slot], List[Ref]]:
        """The slots that have a link, and their links. Throws TreeError where one has to be there and is not."""
        slots, refs = [], []
        for k, slot in enumerate(slots_of(self._actions[node.action])):
            ref = node.inputs[k] if k < len(node.inputs) else None
            if ref:
                slots.append(slot)
                refs.append(ref)
            elif not slot.optional and not _only_reports(node):
                raise TreeError(node.key, f"nothing is connected to '{slot.name}'")
        return slots, refs

    def _prepare(self, key: str) -> None:
        """Makes what stays on its stack before what is taken from it, so that nothing comes between two fields."""
        slots, refs = self._linked(self._graph[key])
        for slot, ref in zip(slots, refs):
            if slot.stays and not self._stacks.find(ref):
                self._emit(ref.key)
        for slot, ref in zip(slots, refs):
            if not slot.stays and not self._stacks.find(ref):
                self._prepare(ref.key)

    def _emit(self, key: str) -> None:
        node = self._graph[key]
        if self._in_frame and node.action in EACH_FRAME and key in self._done:
            raise TreeError(key, "in a sequence, what it moves can be used at the end of a frame only, not also before "
                                 "another node moves it on")
        self._active.append(key)
        slots, refs = self._linked(node)
        self._prepare(key)
        for slot, ref in zip(slots, refs):
            if not self._stacks.find(ref):
                self._emit(ref.key)
        options = dict(node.options)
        action = self._actions[node.action]
        if action.has("over"):
            options.pop("over", None)
            if any(on_request(action, slot) for slot in slots):
                options["over"] = "1"
        if action.has("count") and slots and slots[0].kinds == {"image"}:
            options["count"] = str(len(slots))
        if node.action == "write":
            self._write(node, refs, options)
        else:
            self._joins(node)
            taken = self._arrange(node, slots, refs, options)
            self._apply(node, slots, refs, taken, options)
        self._done.add(key)
        self._active.pop()

    def _arrange(self, node: GraphNode, slots: Sequence[Slot], refs: Sequence[Ref],
                 options: Dict[str, str]) -> List[Entry]:
        """Sees to it that the action takes what is linked to it."""
        self._without_domain(node, options)
        for _ in range(_ATTEMPTS):
            for ref in refs:
                if not self._stacks.find(ref):
                    self._emit(ref.key)
            wrong = self._wrong(node, slots, refs, options)
            if not wrong:
                return [entry for entry in (self._stacks.find(ref) for ref in refs) if entry]
            for ref in wrong:
                self._emit(ref.key)
        raise TreeError(node.key, "no order of actions gives it what is linked to it")

    def _joins(self, node: GraphNode) -> None:
        """New points join those that there are, also where nothing is linked: then that must be meant."""
        for k, slot in enumerate(slots_of(self._actions[node.action])):
            linked = k < len(node.inputs) and node.inputs[k] is not None
            if slot.kinds != {"points"} or not slot.changed or not slot.optional or linked:
                continue
            for entry in self._stacks.newest(slot.kinds):
                other = f" of {entry.ref.key}" if entry.ref else ""
                raise TreeError(node.key, f"its points would join those{other}: link them to '{slot.name}' if they are to, "
                                          "or else use another tree")

    def _wrong(self, node: GraphNode, slots: Sequence[Slot], refs: Sequence[Ref], options: Dict[str, str]) -> List[Ref]:
        wrong: List[Ref] = []
        if pairs(slots):
            return self._pair(node, slots, refs, options)
        for slot, ref, takes in zip(slots, refs, self._stacks.taken(slots)):
            entry = self._stacks.find(ref)
            if entry is None:
                wrong.append(ref)
                continue
            self._require_kind(node, slot, entry)
            options.pop(slot.age, None)
            if slot.age == "mask" or (takes is not entry and slot.age and entry.kind in slot.among):
                options[slot.age] = str(self._stacks.age(entry, slot.among))
            elif takes is not entry:
                wrong.append(ref)
        if not wrong:
            return []
        # All that are of these kinds, in their order.
        kinds = [slot.kinds for slot, ref in zip(slots, refs) if ref in wrong]
        return [ref for slot, ref in zip(slots, refs) if slot.kinds in kinds]

    def _pair(self, node: GraphNode, slots: Sequence[Slot], refs: Sequence[Ref], options: Dict[str, str]) -> List[Ref]:
        """Two objects that one option chooses."""
        entries = [self._stacks.find(ref) for ref in refs]
        ages = []
        for slot, ref, entry in zip(slots, refs, entries):
            if entry is None:
                return [ref]
            self._require_kind(node, slot, entry)
            ages.insert(0, str(self._stacks.age(entry, slot.among)))
        options[slots[0].age] = ",".join(ages)
        return []

    def _require_kind(self, node: GraphNode, slot: Slot, entry: Entry) -> None:
        if entry.kind not in slot.kinds:
            names = {"levelSet": "a level set", "shape": "a shape", "grid": "a grid", "noise": "a field", "flow": "a flow",
                     "mesh": "a mesh", "image": "an image", "velocity": "a velocity grid"}
            wanted = " or ".join(sorted(names.get(kind, kind) for kind in slot.kinds))
            raise TreeError(node.key, f"'{slot.name}' needs {wanted}, not {names.get(entry.kind, entry.kind)}")

    def _without_domain(self, node: GraphNode, options: Mapping[str, str]) -> None:
        """Points that fill a box without a flow: what is on the stacks must not count."""
        slots = slots_of(self._actions[node.action])
        if not slots or slots[0].name != "Domain" or (node.inputs and node.inputs[0]):
            return
        if node.action != "jitter" and "box" not in options:
            raise TreeError(node.key, "connect a flow or a shape to 'Domain', or set box")
        if self._stacks.newest(DOMAIN):
            box = {"box": options["box"]} if "box" in options else {}
            self._line("uniform", [], box, node.key)
            self._stacks.push(Ref("", 0), "flow")

    def _wanted_later(self, entry: Entry, by: str) -> bool:
        waiting = [n for n in self._graph.values() if n.key != by and n.key not in self._done and entry.ref in n.inputs]
        return bool(waiting) or any(w.ref == entry.ref for w in self._wanted)

    def _apply(self, node: GraphNode, slots: Sequence[Slot], refs: Sequence[Ref], taken: Sequence[Entry],
               options: Dict[str, str]) -> None:
        action = self._actions[node.action]
        leaving = [e for e, slot in zip(taken, slots) if not slot.stays and not slot.changed]
        if action.has("keep") and "keep" not in options:
            if any(e.kind in _HEAVY and self._wanted_later(e, node.key) for e in leaving):
                options["keep"] = "1"
        self._line(node.action, node.words, options, node.key)
        kept = options.get("keep", "0") == "1"
        for entry in leaving:
            if not kept:
                self._stacks.remove(entry)
        changed = [entry for entry, slot in zip(taken, slots) if slot.changed]
        for entry in changed:
            entry.ref = Ref(node.key, 0)
        for output, kind in self._made(node, action, options, taken):
            if not any(entry.kind == kind for entry in changed):
                self._stacks.push(Ref(node.key, output), kind)

    def _made(self, node: GraphNode, action: Action, options: Mapping[str, str],
              taken: Sequence[Entry]) -> List[Tuple[int, str]]:
        if node.action != "read":
            return pushed(action, options, [entry.kind for entry in taken])
        reads = kinds_read(action, node.words, options) if node.reads is None else node.reads
        return [(output, self._grid_kind(Ref(node.key, output)) if kind == "grid" else kind) for output, kind in reads]

    def _grid_kind(self, ref: Ref) -> str:
        """Names and types do not tell what a grid is: one that is linked to where only a level set fits is taken for one,
        and the library says if it is none."""
        for node in self._graph.values():
            for slot, linked in zip(slots_of(self._actions[node.action]), node.inputs):
                fitting = slot.kinds & GRIDS
                if linked == ref and len(fitting) == 1:
                    return next(iter(fitting))
        return "grid"

    def _write(self, node: GraphNode, refs: Sequence[Ref], options: Dict[str, str]) -> None:
        """A line for each file that needs other ages."""
        for name in ("grid", "geo", "image"):
            options.pop(name, None)
        lines: List[Tuple[List[str], Dict[str, str]]] = []
        if not node.words:
            raise TreeError(node.key, "has no file to write")
        for ref in refs:
            if not self._stacks.find(ref):
                self._emit(ref.key)
        entries = [entry for entry in (self._stacks.find(ref) for ref in refs) if entry]
        for word in node.words:
            try:
                ages = write_options(self._stacks, word, entries)
            except ValueError as error:
                raise TreeError(node.key, str(error)) from None
            if lines and lines[-1][1] == ages:
                lines[-1][0].append(word)
            else:
                lines.append(([word], ages))
        for words, ages in lines:
            self._line("write", words, {**options, **ages}, node.key)

    def _line(self, action: str, words: Sequence[str], options: Mapping[str, str], key: str) -> None:
        self._program.lines.append(line_of(action, words, options))
        self._program.keys.append(key)
