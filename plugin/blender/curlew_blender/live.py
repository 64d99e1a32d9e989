# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake on Frame Change: a tree with this setting is baked for each frame that the scene changes to.

It bakes result nodes only. A tree from a foreign .blend must not write files just because the frame changes, so nodes that
write files of their own run only in a bake that the user starts.

In the user interface, a thread bakes and a timer shows its results. Only the newest frame is baked; the bake of an
older frame is cancelled. While Blender renders, or if it runs without a user interface, the frame change waits for the
bake. A render from the user interface calls the handlers in its own thread, so they bake there, and hand the rest to
the main thread.
"""

import atexit
import hashlib
import json
import os
import sys
import threading
from pathlib import Path
from typing import Any, Dict, List, Optional

import bpy

from . import bake, cache, handlers, keyframes, library, nodes, texts
from . import tree as trees
from .actions import TreeError
from .job import Job, Plan, plan_of
from .main_thread import in_main_thread

SEQUENCE_WINS = "this tree is a sequence: it shows its baked frames and does not bake on frame change"
_PERIOD = 0.02  # seconds between checks of the threads
_AT_ONCE = 0.005  # seconds to wait for results that are in the cache

_waiting: Dict[str, str] = {}  # scenes whose current frame is to be baked next, by tree name
_jobs: Dict[str, "FrameJob"] = {}  # running jobs, by tree name
_rendering = False
_sessions = library.Sessions()
atexit.register(_sessions.keep, {})


class FrameJob(Job):
    """The bake of a frame, taken from the cache if available."""

    def __init__(self, plan: Plan, base: Path, scene: bpy.types.Scene) -> None:
        super().__init__(plan, base, _sessions)
        self.scene = scene.name
        self.frame = scene.frame_current
        self._blend = bpy.data.filepath

    def make(self) -> None:
        """Writes the result files unless they exist."""
        base = self.folder

        def fill(folder: Path) -> None:
            self.folder = folder
            super(FrameJob, self).make()

        self.folder = cache.make_once(base, digest(self.plan), fill, self._blend)


def digest(plan: Plan) -> str:
    """Returns a digest of everything that a bake depends on: the graph, the meshes, and the files that it reads."""
    result = hashlib.blake2b(digest_size=16)
    frame = plan.graph.get("moment", {"frame": 1})["frame"]
    result.update(f"{library.curlew().version()}\n{json.dumps(plan.graph)}".encode())
    for name, mesh in sorted(plan.meshes.items()):
        for array in mesh.all():
            result.update(f"{name} {array.shape}".encode())
            result.update(array)
    for node in plan.graph["nodes"]:
        for text in (*node["words"], *node["options"].values()) if node["action"] != "write" else ():
            for path in filter(os.path.isfile, texts.files(text, frame)):
                about = os.stat(path)
                result.update(f"{path} {about.st_size} {about.st_mtime_ns}".encode())
    return result.hexdigest()


def synchronous() -> bool:
    """Returns whether a frame change waits for its bake. It does not if the user changes the frame during a render."""
    beside = threading.current_thread() is threading.main_thread() and bpy.app.is_job_running("RENDER")
    return bpy.app.background or (_rendering and not beside)


def idle() -> bool:
    """Returns whether all requested frames have been baked."""
    return not _waiting and not _jobs


@in_main_thread
def _trees() -> List[str]:
    """Returns the names of the trees to bake on frame change. Tells the user if a tree is a sequence, which is not baked
    in this way."""
    names = []
    for tree in [t for t in bpy.data.node_groups if t.bl_idname == nodes.TREE and t.bake_on_frame]:
        if not trees.is_sequence(tree):
            names.append(tree.name)
        elif tree.message != SEQUENCE_WINS:
            tree.message = SEQUENCE_WINS
    return names


def _tree(name: str) -> Optional[bpy.types.NodeTree]:
    tree = bpy.data.node_groups.get(name)
    return tree if tree and tree.bl_idname == nodes.TREE and tree.bake_on_frame else None


@in_main_thread
def _job_of(name: str, scene: bpy.types.Scene) -> Optional[FrameJob]:
    """Returns the job of a tree for the scene's frame. Returns None if there is no such tree, or if it is invalid, which
    its nodes then show."""
    tree = _tree(name)
    if tree is None:
        return None
    # Uses the view layer's dependency graph, as for any bake. That of a render lacks objects that are hidden in
    # renders.
    layer = bpy.context.view_layer if bpy.context.scene == scene else scene.view_layers[0]
    layer.update()
    _sessions.keep(bpy.data.node_groups)
    try:
        return FrameJob(plan_of(tree, scene, layer.depsgraph, only_results=True), cache.root(tree), scene)
    except TreeError as error:
        _fail(tree, scene, error)
        return None


@in_main_thread
def _show(name: str, job: FrameJob) -> None:
    """Shows the results of a job, unless its tree or scene no longer exists."""
    tree, scene = _tree(name), bpy.data.scenes.get(job.scene)
    if tree is None or scene is None:
        return
    try:
        job.finish(tree, scene)
    except TreeError as error:
        _fail(tree, scene, error)
        return
    trees.clear_errors(tree)
    tree.message = f"frame {job.frame} baked in {job.seconds:.2f} s"
    cache.prune(cache.root(tree), tree.keep_frames)


def _fail(tree: bpy.types.NodeTree, scene: bpy.types.Scene, error: TreeError) -> None:
    """Shows the error on the node; without a user interface, also prints it once."""
    if bpy.app.background and tree.message != str(error):
        print(f"Curlew: tree '{tree.name}', frame {scene.frame_current}: {error}", file=sys.stderr)
    trees.show_error(tree, error)


def _now(name: str, scene: bpy.types.Scene) -> None:
    _waiting.pop(name, None)
    if name in _jobs:
        _jobs.pop(name).stop()
    job = _job_of(name, scene)
    if job:
        job.run()
        _show(name, job)


def _soon(name: str, scene: bpy.types.Scene) -> None:
    _waiting[name] = scene.name
    if name in _jobs:
        _jobs[name].cancelled = True
    if not bpy.app.timers.is_registered(step):
        bpy.app.timers.register(step, first_interval=0.0)


def step() -> Optional[float]:
    """The timer: shows finished bakes and starts waiting ones."""
    if _rendering:
        return _PERIOD
    _take_over()
    for name in [name for name in _waiting if name not in _jobs and name not in bake.running]:
        scene = bpy.data.scenes.get(_waiting.pop(name))
        job = _job_of(name, scene) if scene else None
        if job:
            _jobs[name] = job
            job.start()
            job.wait(_AT_ONCE)
    _take_over()
    return None if idle() else _PERIOD


def _take_over() -> None:
    for name in [name for name, job in _jobs.items() if not job.running()]:
        job = _jobs.pop(name)
        if not job.cancelled:
            _show(name, job)


@in_main_thread
def _follow_keyframes(scene: bpy.types.Scene) -> None:
    for tree in [t for t in bpy.data.node_groups if t.bl_idname == nodes.TREE]:
        keyframes.follow(tree, scene.frame_current)


@bpy.app.handlers.persistent
def on_frame(scene: bpy.types.Scene, *_: Any) -> None:
    """Bakes the frame. Does not bake the moments between frames that motion blur samples."""
    if scene.frame_subframe:
        return
    _follow_keyframes(scene)
    on_change(scene)


@bpy.app.handlers.persistent
def on_change(scene: bpy.types.Scene, *_: Any) -> None:
    """Handles a frame change or an undo, after which objects may show the results of another frame."""
    for name in _trees():
        (_now if synchronous() else _soon)(name, scene)


@bpy.app.handlers.persistent
def on_load(*_: Any) -> None:
    """Discards the jobs of the previous file."""
    global _rendering
    _rendering = False
    _waiting.clear()
    for job in _jobs.values():
        job.stop()
    _jobs.clear()
    _sessions.keep({})


@bpy.app.handlers.persistent
def on_render(scene: bpy.types.Scene, *_: Any) -> None:
    """Makes the results of the frame available when a render begins."""
    global _rendering
    _rendering = True
    for name in {*_waiting, *_jobs}:
        _now(name, scene)


@bpy.app.handlers.persistent
def on_rendered(*_: Any) -> None:
    """Handles the end of a render."""
    global _rendering
    _rendering = False


register, _remove = handlers.factory(
    ("frame_change_post", on_frame), ("undo_post", on_change), ("redo_post", on_change), ("load_pre", on_load),
    ("render_init", on_render), ("render_complete", on_rendered), ("render_cancel", on_rendered))


def unregister() -> None:
    """Unregisters the handlers and stops running jobs."""
    _remove()
    on_load()
    if bpy.app.timers.is_registered(step):
        bpy.app.timers.unregister(step)
