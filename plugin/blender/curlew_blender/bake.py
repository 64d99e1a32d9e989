"""Bakes: a tree becomes a program, a thread runs it, and its results become objects."""

import threading
import time
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Set

import bpy

from . import cache, library, results
from . import tree as trees
from .actions import number_text
from .nodes import TREE
from .program import Program, TreeError
from .sources import Sampled, provide, sample
from .tree import Collected

# Bakes that run, by the name of their tree.
running: Dict[str, "Job"] = {}


def frame_numbers(words: Optional[str]) -> Optional[List[int]]:
    """The frames of the words of -frames: "1-48x2 fps=24"."""
    if words is None:
        return None
    parts = words.split(" ")
    options = dict(p.split("=", 1) for p in parts[1:] if "=" in p)
    span, _, by = parts[0].partition("x")
    first, _, last = span.rpartition("-") if span.rfind("-") > 0 else (span, "", span)
    try:
        return list(range(int(first), int(last) + 1, int(by or options.get("by", "1"))))
    except ValueError:
        raise TreeError("", f"frames: '{words}' is not FIRST-LAST") from None


class Job:
    """One run of a program. Made and finished in the main thread; run() may be called in another one."""

    def __init__(self, collected: Collected, program: Program, sampled: Sampled, frames: Optional[List[int]],
                 folder: Path) -> None:
        self.collected = collected
        self.program = program
        self.frames = frames
        self.folder = folder
        self.title = ""
        self.fraction = 0.0
        self.cancelled = False
        self.error: Optional[Exception] = None
        self.report: Mapping[str, Any] = {}
        self.seconds = 0.0
        self._sampled = sampled
        self._frames_done = 0
        self._thread: Optional[threading.Thread] = None
        self._wanted = [want for want in collected.wanted if want.key in program.ages]
        self.files = {want.key: folder / (_plain(want.key) + (".$F4.npz" if frames else ".npz")) for want in self._wanted}

    def run(self) -> None:
        """Runs the program and stores what is wanted of it. Errors are kept."""
        began = time.perf_counter()
        try:
            with library.curlew().Session() as session:
                provide(session, self._sampled.meshes.items())
                session.run(self.program.text, name="tree", progress=self._progress,
                            on_frame=self._store if self.frames else None)
                if not self.frames:
                    self._store(None, session)
                self.report = session.report()
        except Exception as error:  # whatever it is, the main thread shows it
            self.error = error
        self.seconds = time.perf_counter() - began

    def start(self) -> None:
        """Runs in a thread of its own."""
        self._thread = threading.Thread(target=self.run, name="curlew bake", daemon=True)
        self._thread.start()

    def running(self) -> bool:
        """Whether the thread is still at it."""
        return self._thread is not None and self._thread.is_alive()

    def wait(self) -> None:
        """Until it is done."""
        if self._thread is not None:
            self._thread.join()

    def finish(self) -> None:
        """Makes objects of the results; throws TreeError with what has failed."""
        if self.error is not None:
            line, message = getattr(self.error, "line", None), str(self.error)
            raise TreeError(self.program.key_of(line) or "", message) from self.error
        for key, file in self.collected.files.items():
            results.volume(self.collected.nodes[key], Path(file), self.frames)
        for key, file in self.files.items():
            results.geometry(self.collected.nodes[key], file, self.frames)

    def _progress(self, title: str, fraction: float) -> bool:
        self.title, self.fraction = title, fraction
        return self.cancelled

    def overall(self) -> float:
        """From 0 to 1, as far as that is known."""
        if not self.frames:
            return self.fraction
        return min(1.0, (self._frames_done + self.fraction) / len(self.frames))

    def _store(self, frame: Optional[int], session: Any) -> None:
        for want in self._wanted:
            made = {"points": session.points, "curves": session.curves, "mesh": session.mesh}[want.kind]
            file = self.files[want.key]
            if frame is not None:
                file = file.with_name(file.name.replace("$F4", f"{frame:04d}"))
            cache.save(file, results.ARRAYS[want.kind](made(self.program.ages[want.key])))
        self._frames_done += 1


def _plain(key: str) -> str:
    return "".join(c if c.isalnum() or c in "-_" else "_" for c in key)


def prepare(tree: bpy.types.NodeTree, scene: bpy.types.Scene) -> Job:
    """The job of a tree. Throws TreeError, with the tree's nodes red; the cache folder is made last."""
    trees.clear_errors(tree)
    names: Set[str] = set()
    sequence: List[bool] = []

    def namer(key: str, name: str) -> str:
        while name in names:
            name += "_"
        names.add(name)
        return f"@/{name}{'.$F4' if sequence and sequence[0] else ''}.vdb"

    collected = Collected()
    try:
        sequence.append(tree.sequence or any(n.bl_idname == "CurlewNode_frames" and not n.mute for n in tree.nodes))
        collected = trees.collect(tree, namer)
        trees.staggered(collected)
        if not collected.wanted and not any(not n.inputs or n.action == "write" for n in collected.graph.values()):
            raise TreeError("", "nothing to do: add a result node, and connect it")
        words = trees.frames_words(tree, scene, collected)
        frames = frame_numbers(words)
        sampled = sample(scene, collected.meshes, collected.places, frames)
        for key, options in sampled.options.items():
            collected.graph[key].options.update(options)
        program = collected.program(words)
        if not program.lines:
            raise TreeError("", "nothing to do: add a result node, and connect it")
        folder = cache.new_folder(tree)
        for key, file in list(collected.files.items()):
            collected.files[key] = file.replace("@", str(folder), 1)
            collected.graph[key].words = [collected.files[key]]
        return Job(collected, collected.program(words), sampled, frames, folder)
    except OSError as error:
        trees.show_error(tree, {}, None, f"cannot write the cache: {error.strerror}: {error.filename}")
        raise TreeError("", tree.message) from error
    except TreeError as error:
        trees.show_error(tree, collected.nodes, error.key, str(error))
        raise


def finish(tree: bpy.types.NodeTree, job: Job) -> None:
    """Shows what a job has made, or what has failed on the node that it failed at."""
    try:
        job.finish()
        tree.message = f"baked in {job.seconds:.1f} s"
    except TreeError as error:
        cancelled = isinstance(job.error, library.curlew().Cancelled)
        trees.show_error(tree, job.collected.nodes, None if cancelled else error.key,
                         "cancelled" if cancelled else str(error))
        raise


def bake(tree: bpy.types.NodeTree, scene: Optional[bpy.types.Scene] = None) -> Job:
    """Bakes a tree, and comes back when it is done. Throws TreeError."""
    job = prepare(tree, scene or bpy.context.scene)
    job.run()
    finish(tree, job)
    return job


def active_tree(context: bpy.types.Context) -> Optional[bpy.types.NodeTree]:
    """The tree of the node editor, or that of the panel in the 3D view."""
    space = getattr(context, "space_data", None)
    if space and space.type == "NODE_EDITOR" and getattr(space, "edit_tree", None) and space.tree_type == TREE:
        return space.node_tree
    return getattr(context.scene, "curlew_tree", None)


class CURLEW_OT_bake(bpy.types.Operator):
    """Run the tree, and show its results as objects. Esc cancels"""

    bl_idname = "curlew.bake"
    bl_label = "Bake"
    bl_options = {"REGISTER"}
    __annotations__ = {"tree": bpy.props.StringProperty(name="Tree", description="Its name; none: the one at hand")}

    def _tree(self, context: bpy.types.Context) -> Optional[bpy.types.NodeTree]:
        tree = bpy.data.node_groups.get(self.tree) if self.tree else active_tree(context)
        return tree if tree and tree.bl_idname == TREE else None

    def execute(self, context: bpy.types.Context) -> Set[str]:
        """For scripts: comes back when it is done."""
        tree = self._tree(context)
        if tree is None:
            self.report({"ERROR"}, "there is no Curlew tree to bake")
            return {"CANCELLED"}
        try:
            bake(tree, context.scene)
        except TreeError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, tree.message)
        return {"FINISHED"}

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Set[str]:
        """From the interface: in a thread."""
        tree = self._tree(context)
        if tree is None or bpy.app.background:
            return self.execute(context)
        if tree.name in running:
            self.report({"WARNING"}, "this tree is being baked already")
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
        """Shows how far it is."""
        job = running[self.tree]
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
            finish(tree, job)
        except TreeError as error:
            self.report({"WARNING" if job.cancelled else "ERROR"}, str(tree.message or error))
            return {"CANCELLED"}
        self.report({"INFO"}, f"{tree.name}: {tree.message}")
        return {"FINISHED"}


def say(context: bpy.types.Context, text: Optional[str]) -> None:
    """In the status bar, and in the headers of node editors and 3D views."""
    if context.workspace:
        context.workspace.status_text_set(text)
    for area in context.screen.areas if context.screen else ():
        if area.type in {"NODE_EDITOR", "VIEW_3D"}:
            area.header_text_set(text)
            area.tag_redraw()


class CURLEW_OT_clear_cache(bpy.types.Operator):
    """Remove earlier bakes of the tree that nothing shows any more"""

    bl_idname = "curlew.clear_cache"
    bl_label = "Remove Old Bakes"

    def execute(self, context: bpy.types.Context) -> Set[str]:
        """Says how many there were."""
        tree = active_tree(context)
        if tree is None:
            self.report({"ERROR"}, "there is no Curlew tree")
            return {"CANCELLED"}
        self.report({"INFO"}, f"{cache.clear(tree)} old bakes removed")
        return {"FINISHED"}


class CURLEW_OT_option(bpy.types.Operator):
    """Write the option as text, which may have {expressions}; or set it back to its default"""

    bl_idname = "curlew.option"
    bl_label = "Option"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}
    __annotations__ = {
        "node": bpy.props.StringProperty(),
        "option": bpy.props.StringProperty(),
        "to": bpy.props.EnumProperty(items=[("TEXT", "Text", ""), ("DEFAULT", "Default", "")]),
    }

    def execute(self, context: bpy.types.Context) -> Set[str]:
        """On a node of the tree that is edited."""
        node = context.space_data.edit_tree.nodes[self.node]
        if self.to == "DEFAULT":
            node.reset_option(self.option)
        else:
            option = node.action.option(self.option)
            value = getattr(node, "o_" + self.option)
            shown = "{" + number_text(value) + "}" if option.type in ("real", "integer") else "{0}"
            setattr(node, "t_" + self.option, shown)
        return {"FINISHED"}


CLASSES = (CURLEW_OT_bake, CURLEW_OT_clear_cache, CURLEW_OT_option)


def register() -> None:
    """The operators."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Stops what runs, and takes them back."""
    for job in running.values():
        job.cancelled = True
        job.wait()
    running.clear()
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
