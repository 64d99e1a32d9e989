# SPDX-License-Identifier: GPL-3.0-or-later
"""Which files a bake may write besides its cache. A .blend from someone else may contain nodes that write to any path.

A path counts if the user has typed or picked it in this session, or has allowed it with the button of its node. Paths that came
with a file, or with an imported scene, do not. Kept in memory only: whatever a file stored could come from someone else.
"""

from contextlib import contextmanager
from pathlib import Path
from typing import Dict, Iterator, List, Set

import bpy

from . import cache, handlers
from .actions import TreeError, split_words

# Options that name a file that is written. Of an action that outputs files, all words count.
OPTIONS: Dict[str, str] = {"check": "report", "frames": "checkpoint", "spectrum": "plot"}

_allowed: Set[str] = set()  # texts, as in a node
_importing = False


def texts(node: bpy.types.Node) -> List[str]:
    """Returns the names of the files that a node may write, as its words and options give them."""
    action = getattr(node, "action", None)
    if action is None:
        return []
    try:
        named = split_words(node.words) if action.writes else []
    except ValueError:  # told by the bake
        named = []
    option = node.given().get(OPTIONS.get(action.name, ""))
    return named + ([option] if option else [])


def _is_in_cache(text: str) -> bool:
    return cache.beside().resolve() in Path(bpy.path.abspath(text)).resolve().parents


def refused(node: bpy.types.Node) -> List[str]:
    """Returns the names of the files that a node may not write yet."""
    return [text for text in texts(node) if text not in _allowed and not _is_in_cache(text)]


def allow(node: bpy.types.Node) -> None:
    """Allows the files of a node until another .blend is opened."""
    if not _importing:
        _allowed.update(texts(node))


def check(nodes: Dict[str, bpy.types.Node]) -> None:
    """Raises TreeError if one of these nodes may not write its files."""
    for key, node in nodes.items():
        for text in refused(node):
            raise TreeError(key, f"this node came with the file and would write '{text}': if you want that, press Allow Writing "
                                 "Here, or type the name again")


@contextmanager
def imported() -> Iterator[None]:
    """Paths that are set meanwhile do not come from the user."""
    global _importing
    before, _importing = _importing, True
    try:
        yield
    finally:
        _importing = before


class CURLEW_OT_allow_writing(bpy.types.Operator):
    """Let this node write the files that it names, until another .blend is opened"""

    bl_idname = "curlew.allow_writing"
    bl_label = "Allow Writing Here"
    bl_options = {"INTERNAL"}
    __annotations__ = {"tree": bpy.props.StringProperty(), "node": bpy.props.StringProperty()}

    def execute(self, context: bpy.types.Context) -> Set[str]:
        """Allows it, and clears the error of the node."""
        node = bpy.data.node_groups[self.tree].nodes[self.node]
        allow(node)
        node.show_error("")
        return {"FINISHED"}


@bpy.app.handlers.persistent
def on_load(*_: object) -> None:
    """Forgets what the user has allowed in the former file."""
    _allowed.clear()


_register, _unregister = bpy.utils.register_classes_factory((CURLEW_OT_allow_writing,))
_add, _remove = handlers.factory(("load_pre", on_load))


def register() -> None:
    """Registers the operator and the handler."""
    _register()
    _add()


def unregister() -> None:
    """Unregisters them."""
    _remove()
    on_load()
    _unregister()
