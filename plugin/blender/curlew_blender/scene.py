"""From a scene's text to a graph: the stacks are followed, and what an action takes becomes its links. Needs no Blender."""

from typing import Dict, List, Mapping, Optional, Sequence, Tuple

from .actions import Action, split_words
from .program import GraphNode
from .slots import EACH_FRAME, FIELDS, Slot, on_request, pairs, pushed, slots_of
from .stacks import Entry, Ref, Stacks, kinds_read, written_entries


class SceneError(Exception):
    """A line of a scene is not understood."""


def graph_of(text: str, actions: Mapping[str, Action]) -> List[GraphNode]:
    """The nodes of a scene, in its order. Throws SceneError."""
    return _Reader(actions).read(text)


def logical_lines(text: str) -> List[Tuple[int, str]]:
    """The lines with those that a backslash continues in one, and the numbers of their first."""
    lines: List[Tuple[int, str]] = []
    pending, first = "", 0
    for number, line in enumerate(text.splitlines(), 1):
        first = first if pending else number
        continues = line.endswith("\\")
        pending += (line[:-1] if continues else line) + " "
        if not continues:
            lines.append((first, pending))
            pending = ""
    if pending.strip():
        raise SceneError("the scene ends with a \\: its last line is missing")
    return lines


class _Reader:
    def __init__(self, actions: Mapping[str, Action]) -> None:
        self._actions = actions
        self._stacks = Stacks()
        self._nodes: List[GraphNode] = []
        self._in_frames = False

    def read(self, text: str) -> List[GraphNode]:
        for number, line in logical_lines(text):
            try:
                words = split_words(line)
                if words:
                    self._action(words[0][1:] if words[0].startswith("-") else words[0], words[1:])
            except (ValueError, KeyError) as error:
                raise SceneError(f"line {number}: {error.args[0]}") from None
        if not self._in_frames:
            for node in self._nodes:
                node.when = ""
        return self._nodes

    def _action(self, name: str, tokens: Sequence[str]) -> None:
        if name not in self._actions:
            raise ValueError(f"there is no action '{name}'")
        if name == "config":
            raise ValueError("it includes another scene: import that one, or put its actions in its place")
        action = self._actions[name]
        node = GraphNode(key=f"{name}.{len(self._nodes)}", action=name, order=len(self._nodes))
        for token in tokens:
            option, equals, value = token.partition("=")
            if equals and option.replace("_", "").isalnum() and name != "set":
                node.options[action.option(option).name] = value
            else:
                node.words.append(token)
        self._nodes.append(node)
        if name == "frames":
            self._in_frames = True
            return
        if self._in_frames != (name in EACH_FRAME):
            node.when = "frame" if self._in_frames else "once"
        if name == "write":
            self._link_written(node)
        else:
            self._link(action, node)

    def _link_written(self, node: GraphNode) -> None:
        """Its files may hold different things: then there is a node for each."""
        ages = {k: node.options.pop(k) for k in ("grid", "geo", "image") if k in node.options}
        by_entries: List[Tuple[List[Entry], List[str]]] = []
        for word in node.words:
            entries = written_entries(self._stacks, word, ages)
            if by_entries and by_entries[-1][0] == entries:
                by_entries[-1][1].append(word)
            else:
                by_entries.append((entries, [word]))
        for k, (entries, words) in enumerate(by_entries):
            one = node
            if k > 0:
                one = GraphNode(f"write.{len(self._nodes)}", "write", [], dict(node.options), [], node.when,
                                len(self._nodes))
                self._nodes.append(one)
            one.words = words
            one.inputs = [entry.ref for entry in entries]

    def _link(self, action: Action, node: GraphNode) -> None:
        slots = slots_of(action)
        used = self._used(action, node, slots)
        entries: List[Optional[Entry]] = [None] * len(slots)
        for k, entry in zip(used, self._stacks.taken([slots[k] for k in used])):
            entries[k] = entry
        if pairs(slots):
            ages = node.options.pop(slots[0].age, "0,1").split(",")
            there = self._stacks.newest(slots[0].among)
            chosen = [there[int(a)] if a.isdigit() and int(a) < len(there) else None for a in ages]
            entries = list(reversed(chosen)) if len(chosen) == 2 else entries
        for k, slot in enumerate(slots):
            if slot.age and slot.age in node.options:
                there = self._stacks.newest(slot.among)
                age = node.options.pop(slot.age).split(",")[0]
                entries[k] = there[int(age)] if age.isdigit() and int(age) < len(there) else None
        node.inputs = [entry.ref if entry else None for entry in entries]
        self._apply(action, node, slots, entries)

    def _used(self, action: Action, node: GraphNode, slots: Sequence[Slot]) -> List[int]:
        """The slots that count with these options."""
        options = node.options
        over = options.pop("over", "0") == "1" if action.has("over") else False
        indices = [k for k, slot in enumerate(slots) if over or not on_request(action, slot)]
        if slots and slots[0].kinds == {"image"} and len(slots) > 1:
            count = options.pop("count", "") if action.has("count") else ""
            return indices[:int(count) if count.isdigit() else len(self._stacks.newest({"image"}))]
        if action.name == "dfvn":
            return indices[:self._potentials()]
        if action.name == "curl":
            offset = options.get("offset", "0")
            return indices[:3 if offset in ("", "0") else 1]
        if action.name == "lift":
            return indices if options.get("functions") == "2" else [0, 2]
        if action.name in ("kill", "wrap") and "box" in options:
            return [0]
        if action.name == "emit" and not self._stacks.newest({"points"}):
            return [0]
        if action.name in ("scatter", "emit") and "box" in options and not self._stacks.newest({"flow"}):
            return [k for k in indices if k != 0]
        if action.name in ("advectLevelSet", "advectGrid") and options.get("flow") == "enright":
            return [1]
        if action.name == "velocity":
            return [0]
        return indices

    def _potentials(self) -> int:
        fields = self._stacks.newest(FIELDS)
        if not fields:
            return 2
        n = fields[0].dimensions
        if n == 2:
            return 2 if len(fields) > 1 and fields[1].dimensions == 3 else 1
        return n - 1 if n >= 4 else 2

    def _apply(self, action: Action, node: GraphNode, slots: Sequence[Slot], entries: Sequence[Optional[Entry]]) -> None:
        dimensions = _dimensions(node, [entry for entry in entries if entry])
        kept = node.options.get("keep", "0") == "1"
        changed = set()
        for slot, entry in zip(slots, entries):
            if entry and slot.changed:
                entry.ref = Ref(node.key, 0)
                changed.add(entry.kind)
            elif entry and not slot.stays and not kept:
                self._stacks.remove(entry)
        kinds = [entry.kind for entry in entries if entry]
        made = kinds_read(action, node.words, node.options) if action.name == "read" else pushed(
            action, node.options, kinds)
        for output, kind in made:
            if kind in changed:
                continue
            # A grid from a file may be a level set: it is taken for one where one is wanted.
            self._stacks.push(Ref(node.key, output), "levelSet" if action.name == "read" and kind == "grid" else kind,
                              dimensions)


def _dimensions(node: GraphNode, entries: Sequence[Entry]) -> int:
    """Of the field that an action makes."""
    given = node.options.get
    of_first = entries[0].dimensions if entries else 3
    if node.action in ("noise", "constant"):
        text = given("dim", "3")
        return int(text) if text.isdigit() else 3
    if node.action == "ramp":
        return len(given("direction", "0,1,0").split(","))
    if node.action == "height":
        return of_first + 1
    if node.action == "lift":
        return entries[-1].dimensions - (len(entries) - 1) if entries else 3
    return max((entry.dimensions for entry in entries), default=3) if entries else 3


def as_mapping(nodes: Sequence[GraphNode]) -> Dict[str, GraphNode]:
    """The nodes by their keys."""
    return {node.key: node for node in nodes}
