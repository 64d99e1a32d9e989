"""One bake: a tree becomes a program, the library runs it, and its results become objects."""

import atexit
import threading
import time
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Set, Tuple

import bpy

from . import cache, keyframes, library, results
from . import tree as trees
from .actions import quoted
from .program import Program, TreeError
from .sources import Sampled, provide, sample
from .tree import Collected

_HERE = "@"  # stands for the folder of a bake, until there is one
_started: List["Job"] = []


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


def cache_error(error: OSError) -> TreeError:
    """A cache that cannot be written."""
    return TreeError("", f"cannot write the cache: {error.strerror}: {error.filename}")


class Plan:
    """What a bake needs of Blender. Made in the main thread."""

    def __init__(self, collected: Collected, words: Optional[str], sampled: Sampled, frames: Optional[List[int]]) -> None:
        self.program: Program = collected.program(words)
        self.sampled = sampled
        self.frames = frames
        self.volumes = collected.files
        self.wanted = [want for want in collected.wanted if want.key in self.program.ages]
        self.kinds = {**{key: "grid" for key in self.volumes}, **{want.key: want.kind for want in self.wanted}}

    def text(self, folder: Path) -> str:
        """The program, with its volumes in a folder."""
        lines = list(self.program.lines)
        for k, key in enumerate(self.program.keys):
            if key in self.volumes:
                file = self.volumes[key]
                lines[k] = lines[k].replace(quoted(file), quoted(file.replace(_HERE, str(folder), 1)), 1)
        return "".join(line + "\n" for line in lines)

    def file(self, key: str, folder: Path) -> Path:
        """Where a result is stored; of a sequence with `$F4` in its name."""
        if key in self.volumes:
            return Path(self.volumes[key].replace(_HERE, str(folder), 1))
        name = "".join(c if c.isalnum() or c in "-_" else "_" for c in key)
        return folder / (name + (".$F4.npz" if self.frames else ".npz"))


class Job:
    """One run of a plan. Made and finished in the main thread; run() may be called in another one, and needs no Blender."""

    def __init__(self, plan: Plan, folder: Path) -> None:
        self.folder = folder
        self.title = ""
        self.fraction = 0.0
        self.cancelled = False
        self.error: Optional[Exception] = None
        self.report: Mapping[str, Any] = {}
        self.seconds = 0.0
        self.plan = plan
        self._frames_done = 0
        self._thread: Optional[threading.Thread] = None

    def run(self) -> None:
        """Runs the program and stores what is wanted of it. Errors are kept."""
        began = time.perf_counter()
        try:
            self.make()
        except Exception as error:  # whatever it is, the main thread shows it
            self.error = error
        self.seconds = time.perf_counter() - began

    def make(self) -> None:
        """Makes the files."""
        with library.curlew().Session() as session:
            provide(session, self.plan.sampled.meshes.items())
            session.run(self.plan.text(self.folder), name="tree", progress=self._progress,
                        on_frame=self._store if self.plan.frames else None)
            if not self.plan.frames:
                self._store(None, session)
            self.report = session.report()

    def start(self) -> None:
        """Runs in a thread of its own."""
        self._thread = threading.Thread(target=self.run, name="curlew bake", daemon=True)
        _started[:] = [job for job in _started if job.running()] + [self]
        self._thread.start()

    def running(self) -> bool:
        """Whether the thread is still at it."""
        return self._thread is not None and self._thread.is_alive()

    def stop(self) -> None:
        """Cancels it, and waits until it is done."""
        self.cancelled = True
        self.wait()

    def wait(self, seconds: Optional[float] = None) -> None:
        """Until it is done, or for so long."""
        if self._thread is not None:
            self._thread.join(seconds)

    def finish(self, tree: bpy.types.NodeTree, scene: bpy.types.Scene) -> None:
        """Makes objects of the results, for the nodes that are still there; throws TreeError with what has failed."""
        if self.error is not None:
            if isinstance(self.error, OSError):
                raise cache_error(self.error) from self.error
            line = getattr(self.error, "line", None)
            raise TreeError(self.plan.program.key_of(line) or "", str(self.error)) from self.error
        nodes = trees.nodes_of(tree)
        for key, kind in self.plan.kinds.items():
            node = nodes.get(key)
            if getattr(node, "kind", "") == kind:
                try:
                    results.show_result(node, self.plan.file(key, self.folder), self.plan.frames, scene)
                except RuntimeError as error:
                    raise TreeError(key, str(error)) from error

    def _progress(self, title: str, fraction: float) -> bool:
        self.title, self.fraction = title, fraction
        return self.cancelled

    def overall(self) -> float:
        """From 0 to 1, as far as that is known."""
        if not self.plan.frames:
            return self.fraction
        return min(1.0, (self._frames_done + self.fraction) / len(self.plan.frames))

    def _store(self, frame: Optional[int], session: Any) -> None:
        for want in self.plan.wanted:
            made = {"points": session.points, "curves": session.curves, "mesh": session.mesh}[want.kind]
            file = self.plan.file(want.key, self.folder)
            if frame is not None:
                file = file.with_name(file.name.replace("$F4", f"{frame:04d}"))
            cache.save(file, results.ARRAYS[want.kind](made(self.plan.program.ages[want.key])))
        self._frames_done += 1


def running_folders() -> Set[Path]:
    """Where threads are writing."""
    return {job.folder for job in _started if job.running()}


def stop_all() -> None:
    """Ends all threads."""
    for job in _started:
        job.cancelled = True
    for job in _started:
        job.wait()
    _started.clear()


atexit.register(stop_all)


def in_frames(collected: Collected, scene: bpy.types.Scene, words: Optional[str],
              depsgraph: Optional[bpy.types.Depsgraph] = None) -> Tuple[Sampled, Optional[List[int]]]:
    """Gives the nodes what objects, keyframes and, in a still, the moment say; returns the meshes, and the frames of a
    sequence. Throws TreeError."""
    frames = frame_numbers(words)
    sampled = sample(scene, collected.meshes, collected.places, frames, depsgraph)
    keyed = keyframes.over_frames(collected.nodes, frames, scene.frame_current) if frames else {}
    for changed in (keyed, sampled.options):
        for key, options in changed.items():
            collected.graph[key].options.update(options)
    if frames is None:
        trees.hold(collected, scene)
    return sampled, frames


def plan_of(tree: bpy.types.NodeTree, scene: bpy.types.Scene, depsgraph: Optional[bpy.types.Depsgraph] = None) -> Plan:
    """What a tree says now. `depsgraph`: the one to ask for objects, if not that of the context. Throws TreeError."""
    names: Set[str] = set()
    ending = ".$F4.vdb" if trees.is_sequence(tree) else ".vdb"

    def namer(key: str, name: str) -> str:
        while name in names:
            name += "_"
        names.add(name)
        return f"{_HERE}/{name}{ending}"

    collected = trees.collect(tree, namer)
    trees.staggered(collected)
    nothing = TreeError("", "nothing to do: add a result node, and connect it")
    if not collected.wanted and not any(not n.inputs or n.action == "write" for n in collected.graph.values()):
        raise nothing
    words = trees.frames_words(tree, scene, collected)
    sampled, frames = in_frames(collected, scene, words, depsgraph)
    plan = Plan(collected, words, sampled, frames)
    if not plan.program.lines:
        raise nothing
    return plan


def prepare(tree: bpy.types.NodeTree, scene: bpy.types.Scene) -> Job:
    """The job of a tree, in a new folder. Throws TreeError, with the tree's nodes red."""
    trees.clear_errors(tree)
    try:
        return Job(plan_of(tree, scene), cache.new_folder(tree))
    except OSError as error:
        failed = cache_error(error)
        trees.show_error(tree, failed)
        raise failed from error
    except TreeError as error:
        trees.show_error(tree, error)
        raise


def finish(tree: bpy.types.NodeTree, job: Job, scene: bpy.types.Scene) -> None:
    """Shows what a job has made, or what has failed on the node that it failed at."""
    try:
        job.finish(tree, scene)
        tree.message = f"baked in {job.seconds:.1f} s"
    except TreeError as error:
        if isinstance(job.error, library.curlew().Cancelled):
            tree.message = "cancelled"
        else:
            trees.show_error(tree, error)
        raise


def bake(tree: bpy.types.NodeTree, scene: Optional[bpy.types.Scene] = None) -> Job:
    """Bakes a tree, and comes back when it is done. Throws TreeError."""
    scene = scene or bpy.context.scene
    job = prepare(tree, scene)
    job.run()
    finish(tree, job, scene)
    return job
