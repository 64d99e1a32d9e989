# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators for bakes. If started from the user interface, a thread runs the library and the headers show its
progress."""

from typing import Dict, Optional, Set

import bpy

from . import cache
from .actions import TreeError, number_text
from .job import Job, bake, finish, prepare, running_folders, stop_all
from .nodes import TREE

# Running bakes that a button has started, by the name of the tree.
running: Dict[str, Job] = {}


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
    bl_options = {"REGISTER"}
    __annotations__ = {"tree": bpy.props.StringProperty(name="Tree", description="Tree to bake; empty for the one in this editor or panel")}

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
            bake(tree, context.scene)
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
        try:
            job = prepare(tree, context.scene)
        except TreeError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.tree = tree.name
        running[self.tree] = job
        job.start()
        self._timer = context.window_manager.event_timer_add(0.1, window=context.window)
        context.window_manager.progress_begin(0.0, 1.0)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> Set[str]:
        """Shows the progress."""
        job = running.get(self.tree)
        if job is None:  # another file was loaded
            return {"CANCELLED"}
        if event.type == "ESC":
            job.cancelled = True
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if job.running():
            context.window_manager.progress_update(job.overall())
            say(context, f"Curlew: {job.title} {100 * job.overall():.0f} %  (Esc cancels)")
            return {"PASS_THROUGH"}
        return self._end(context, job)

    def _end(self, context: bpy.types.Context, job: Job) -> Set[str]:
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        say(context, None)
        del running[self.tree]
        tree = bpy.data.node_groups.get(self.tree)
        if tree is None:
            return {"CANCELLED"}
        try:
            finish(tree, job, context.scene)
        except TreeError as error:
            self.report({"WARNING" if job.cancelled else "ERROR"}, str(tree.message or error))
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
        self.report({"INFO"}, f"{cache.clear(tree, running_folders())} old bakes removed")
        return {"FINISHED"}


class CURLEW_OT_option(bpy.types.Operator):
    """Set the option, write it as text with {expressions}, or reset it to its default"""

    bl_idname = "curlew.option"
    bl_label = "Option"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}
    __annotations__ = {
        "node": bpy.props.StringProperty(),
        "option": bpy.props.StringProperty(),
        "to": bpy.props.EnumProperty(items=[("VALUE", "Value", ""), ("TEXT", "Text", ""), ("DEFAULT", "Default", "")]),
    }

    def execute(self, context: bpy.types.Context) -> Set[str]:
        """Changes the option on a node of the edited tree."""
        node = context.space_data.edit_tree.nodes[self.node]
        if self.to == "DEFAULT":
            node.reset_option(self.option)
        elif self.to == "VALUE":
            setattr(node, "o_" + self.option, getattr(node, "o_" + self.option))
        else:
            option = node.action.option(self.option)
            value = getattr(node, "o_" + self.option)
            shown = "{" + number_text(value) + "}" if option.type in ("real", "integer") else "{0}"
            setattr(node, "t_" + self.option, shown)
        return {"FINISHED"}


CLASSES = (CURLEW_OT_bake, CURLEW_OT_clear_cache, CURLEW_OT_option)


@bpy.app.handlers.persistent
def on_load(*_: object) -> None:
    """Stops the bakes of the file that was closed."""
    stop_all()
    running.clear()


_register, _unregister = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Registers the operators."""
    _register()
    bpy.app.handlers.load_pre.append(on_load)


def unregister() -> None:
    """Stops running bakes, and unregisters the operators."""
    on_load()
    bpy.app.handlers.load_pre.remove(on_load)
    _unregister()
