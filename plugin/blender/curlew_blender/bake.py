# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators for bakes. If started from the user interface, a thread runs the library and the headers show its
progress."""

import time
from contextlib import suppress
from typing import Any, Dict, Generator, Optional, Set, Tuple

import bpy

from . import cache, handlers, results
from .actions import TreeError, number_text
from .job import Job, bake, finish, preparation, running_folders, stop_all
from .nodes import TREE
from .tree import nodes_of

_STEP = 0.05  # seconds of a timer's step that samples objects


class _Known:
    """A tree or a scene that may be renamed, undone or removed meanwhile, so that no reference to it is kept."""

    def __init__(self, block: bpy.types.ID) -> None:
        self._address, self._name = block.as_pointer(), block.name

    def among(self, blocks: Any) -> Optional[bpy.types.ID]:
        """Returns it, or None if it no longer exists. A new name keeps its address, and undo, which may move it, its name."""
        named = blocks.get(self._name)
        if not (named and named.as_pointer() == self._address):
            named = next((block for block in blocks if block.as_pointer() == self._address), None) or named
        if named:
            self._address, self._name = named.as_pointer(), named.name
        return named


class Run:
    """A bake that a button has started: it samples the scene in its frames, then its job runs in a thread."""

    def __init__(self, tree: bpy.types.NodeTree, scene: bpy.types.Scene) -> None:
        self._tree, self._scene = _Known(tree), _Known(scene)
        self.job: Optional[Job] = None
        self.cancelled = False
        self._sampled = 0.0
        self._steps: Generator[float, None, Job] = preparation(tree, scene)

    def tree(self) -> Optional[bpy.types.NodeTree]:
        """Returns its tree, or None if that was removed."""
        return self._tree.among(bpy.data.node_groups)

    def scene(self) -> Optional[bpy.types.Scene]:
        """Returns the scene in which it was started, or None if that was removed."""
        return self._scene.among(bpy.data.scenes)

    def advance(self) -> bool:
        """Samples further frames, and starts the job after the last. Returns whether the bake still runs. Raises TreeError
        if the tree is invalid."""
        if self.job:
            return self.job.running()
        end = time.perf_counter() + _STEP
        try:
            while not self.cancelled:
                self._sampled = next(self._steps)
                if time.perf_counter() >= end:
                    break
        except StopIteration as last:
            self.job = last.value
            self.job.start()
        except ReferenceError:
            raise TreeError("", "an object was removed during the bake") from None
        return not self.cancelled

    def progress(self) -> Tuple[str, float]:
        """Returns what the bake does, and the progress from 0 to 1."""
        return (self.job.title, self.job.overall()) if self.job else ("sampling objects", self._sampled)

    def cancel(self) -> None:
        """Stops sampling or cancels the job."""
        self.cancelled = True
        with suppress(ReferenceError):  # the scene may have been removed
            self._steps.close()  # back to the current frame
        if self.job:
            self.job.cancelled = True


# Running bakes that a button has started, by the name of the tree.
running: Dict[str, Run] = {}


def active_tree(context: bpy.types.Context) -> Optional[bpy.types.NodeTree]:
    """Returns the tree of the node editor, or that of the panel in the 3D view."""
    space = getattr(context, "space_data", None)
    if space and space.type == "NODE_EDITOR" and getattr(space, "edit_tree", None) and space.tree_type == TREE:
        return space.node_tree
    tree = bpy.data.node_groups.get(context.scene.curlew_tree)
    return tree if tree and tree.bl_idname == TREE else None


class CURLEW_OT_bake(bpy.types.Operator):
    """Evaluate the node tree and show its results as objects. Esc cancels"""

    bl_idname = "curlew.bake"
    bl_label = "Bake"
    bl_options = {"UNDO"}
    __annotations__ = {"tree": bpy.props.StringProperty(
        name="Tree", description="Tree to bake; empty for the one in this editor or panel"),
        "allow_writing": bpy.props.BoolProperty(
            name="Allow Writing", options={"SKIP_SAVE"},
            description="For scripts: also write files whose names came with the .blend or with an imported scene")}

    def _tree(self, context: bpy.types.Context) -> Optional[bpy.types.NodeTree]:
        tree = bpy.data.node_groups.get(self.tree) if self.tree else active_tree(context)
        return tree if tree and tree.bl_idname == TREE else None

    def execute(self, context: bpy.types.Context) -> Set[str]:
        """For scripts: returns when the bake is finished."""
        tree = self._tree(context)
        if tree is None:
            self.report({"ERROR"}, "no Curlew tree to bake: choose one, or open one in the node editor")
            return {"CANCELLED"}
        try:
            bake(tree, context.scene, self.allow_writing)
        except TreeError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, tree.message)
        return {"FINISHED"}

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Set[str]:
        """From the user interface: bakes in a thread."""
        tree = self._tree(context)
        if tree is None or bpy.app.background:
            return self.execute(context)
        if tree.name in running:
            self.report({"WARNING"}, "this tree is already being baked")
            return {"CANCELLED"}
        run = Run(tree, context.scene)
        try:
            run.advance()
        except TreeError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.tree = tree.name
        running[self.tree] = run
        self._timer = context.window_manager.event_timer_add(0.1, window=context.window)
        context.window_manager.progress_begin(0.0, 1.0)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> Set[str]:
        """Shows the progress."""
        run = running.get(self.tree)
        if run is None:  # another file was loaded
            return {"CANCELLED"}
        tree, scene = run.tree(), run.scene()
        if tree and tree.name != self.tree and tree.name not in running:
            del running[self.tree]
            self.tree = tree.name
            running[self.tree] = run
        if event.type == "ESC" or tree is None or scene is None:
            run.cancel()
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            busy = run.advance()
            if run.job and tree and scene:
                run.job.show_early(tree, scene)
        except Exception as error:  # whatever it is, the timer must not stay
            run.cancel()
            self._stop(context)
            if tree:
                tree.message = str(error)
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if busy:
            title, fraction = run.progress()
            context.window_manager.progress_update(fraction)
            say(context, f"Curlew: {title} {100 * fraction:.0f} %  (Esc cancels)")
            return {"PASS_THROUGH"}
        self._stop(context)
        return self._end(run, tree, scene)

    def _stop(self, context: bpy.types.Context) -> None:
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        say(context, None)
        del running[self.tree]

    def _end(self, run: Run, tree: Optional[bpy.types.NodeTree], scene: Optional[bpy.types.Scene]) -> Set[str]:
        if tree is None or scene is None:
            self.report({"WARNING"}, f"the {'scene' if tree else 'tree'} was removed during its bake")
            return {"CANCELLED"}
        if run.job is None:
            tree.message = "cancelled"
            return {"CANCELLED"}
        try:
            finish(tree, run.job, scene)
        except TreeError as error:
            self.report({"WARNING" if run.cancelled else "ERROR"}, str(tree.message or error))
            return {"CANCELLED"}
        self.report({"INFO"}, f"{tree.name}: {tree.message}")
        return {"FINISHED"}


def say(context: bpy.types.Context, text: Optional[str]) -> None:
    """Shows a text in the status bar and in the headers of node editors and 3D views."""
    if context.workspace:
        context.workspace.status_text_set(text)
    for area in context.screen.areas if context.screen else ():
        if area.type in {"NODE_EDITOR", "VIEW_3D"}:
            area.header_text_set(text)
            area.tag_redraw()


class CURLEW_OT_cancel(bpy.types.Operator):
    """Cancel the bake of this tree"""

    bl_idname = "curlew.cancel"
    bl_label = "Cancel Bake"
    bl_options = {"INTERNAL"}
    __annotations__ = {"tree": bpy.props.StringProperty()}

    def execute(self, context: bpy.types.Context) -> Set[str]:
        """Cancels it, unless it has ended meanwhile."""
        if self.tree in running:
            running[self.tree].cancel()
        return {"FINISHED"}


def cleared(tree: bpy.types.NodeTree, what: str, saved: bool = False) -> str:
    """Removes the bakes of a tree that nothing shows, `saved`: also those that the file on disk shows. Returns what to tell the
    user."""
    removed, on_disk, kept = cache.clear(tree, running_folders(), saved)
    return (f"{removed} {what} removed" + (f", {on_disk} kept until you save: the file on disk shows them" if on_disk else "")
            + (f", {kept} kept: other .blend files may show them" if kept else ""))


class CURLEW_OT_free_bake(bpy.types.Operator):
    """Empty the objects that this tree has baked, and delete their files"""

    bl_idname = "curlew.free_bake"
    bl_label = "Free Bake"
    bl_options = {"UNDO"}
    __annotations__ = {"tree": bpy.props.StringProperty()}

    def execute(self, context: bpy.types.Context) -> Set[str]:
        """Keeps the objects with their materials and modifiers, for the next bake."""
        tree = bpy.data.node_groups.get(self.tree) if self.tree else active_tree(context)
        if tree is None or tree.bl_idname != TREE:
            self.report({"ERROR"}, "no Curlew tree: choose one, or open one in the node editor")
            return {"CANCELLED"}
        for node in nodes_of(tree).values():
            if getattr(node, "target", None):
                results.empty(node.target)
            if hasattr(node, "kind"):
                node.baked, node.outdated = "", False
        tree.message = ""
        self.report({"INFO"}, cleared(tree, "bakes", saved=True))
        return {"FINISHED"}


class CURLEW_OT_clear_cache(bpy.types.Operator):
    """Delete earlier bakes of this tree that no object shows any more"""

    bl_idname = "curlew.clear_cache"
    bl_label = "Remove Old Bakes"

    def execute(self, context: bpy.types.Context) -> Set[str]:
        """Reports how many bakes were removed."""
        tree = active_tree(context)
        if tree is None:
            self.report({"ERROR"}, "no Curlew tree: choose one, or open one in the node editor")
            return {"CANCELLED"}
        self.report({"INFO"}, cleared(tree, "old bakes"))
        return {"FINISHED"}


class CURLEW_OT_option(bpy.types.Operator):
    """Set the option, write it as text with {expressions}, reset it to its default, or give it a socket"""

    bl_idname = "curlew.option"
    bl_label = "Option"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}
    __annotations__ = {
        "node": bpy.props.StringProperty(),
        "option": bpy.props.StringProperty(),
        "to": bpy.props.EnumProperty(items=[(name, name.title(), "") for name in ("VALUE", "TEXT", "DEFAULT", "SOCKET", "PROPERTY")]),
    }

    def execute(self, context: bpy.types.Context) -> Set[str]:
        """Changes the option on a node of the edited tree."""
        node = context.space_data.edit_tree.nodes[self.node]
        if self.to == "DEFAULT":
            node.reset_option(self.option)
        elif self.to == "SOCKET":
            node.add_value("o_" + self.option)
        elif self.to == "PROPERTY":
            node.remove_value("o_" + self.option)
        elif self.to == "VALUE":
            setattr(node, "o_" + self.option, getattr(node, "o_" + self.option))
        else:
            option = node.action.option(self.option)
            value = getattr(node, "o_" + self.option)
            shown = "{" + number_text(value) + "}" if option.type in ("real", "integer") else "{0}"
            setattr(node, "t_" + self.option, shown)
        return {"FINISHED"}


CLASSES = (CURLEW_OT_bake, CURLEW_OT_cancel, CURLEW_OT_free_bake, CURLEW_OT_clear_cache, CURLEW_OT_option)


@bpy.app.handlers.persistent
def on_load(*_: object) -> None:
    """Stops the bakes of the file that was closed."""
    for run in running.values():
        run.cancel()
    stop_all()
    running.clear()


_register, _unregister = bpy.utils.register_classes_factory(CLASSES)
_add, _remove = handlers.factory(("load_pre", on_load))


def register() -> None:
    """Registers the operators."""
    _register()
    _add()


def unregister() -> None:
    """Stops running bakes, and unregisters the operators."""
    on_load()
    _remove()
    _unregister()
