# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake: converts a tree to a graph, lets the library evaluate it, and turns the results into objects."""

import atexit
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Dict, Generator, List, Mapping, Optional, Set, Tuple, TypeVar

import bpy

from . import cache, keyframes, library, outdated, results, writing
from . import tree as trees
from .actions import TreeError
from .sources import ObjectArrays, sample
from .texts import plain
from .tree import Collected, Graph

_HERE = "@"  # placeholder for the folder of a bake
_started: List["Job"] = []


def frame_numbers(said: Optional[Mapping[str, Any]]) -> Optional[List[int]]:
    """Returns the frames of {"words": ["1-48x2"], …}. Raises TreeError if the range is invalid."""
    if said is None:
        return None
    span, _, by = said["words"][0].partition("x")
    first, _, last = span.rpartition("-") if span.rfind("-") > 0 else (span, "", span)
    try:
        return list(range(int(first), int(last) + 1, int(by or said["options"].get("by", "1"))))
    except ValueError:
        raise TreeError("", f"frames: '{said['words'][0]}' is not a range FIRST-LAST") from None


def cache_error(error: OSError) -> TreeError:
    """Returns the error for a cache that cannot be written."""
    return TreeError("", f"cannot write the cache: {error.strerror}: {error.filename}")


@dataclass
class Plan:
    """The data that a bake needs from Blender. Created in the main thread."""

    tree: str
    graph: Graph
    meshes: Dict[str, ObjectArrays]  # and curves
    frames: Optional[List[int]]
    volumes: Dict[str, str]  # files, by the keys of results
    wanted: Dict[str, Tuple[str, str]]  # kinds and links of the other results, by key
    shift: int = 0  # what to subtract from a frame of the graph to get that of the scene
    first: int = 0  # first frame of the scene that is shown; those before it only fill the scene
    settings: Dict[str, str] = field(default_factory=dict)  # digests of what the results depend on, by key

    def shown(self) -> List[int]:
        """Returns the frames of the scene that have results; empty if this is not a sequence."""
        return [frame - self.shift for frame in self.frames or () if frame - self.shift >= self.first]

    def graph_in(self, folder: Path) -> Graph:
        """Returns the graph with its volumes written to this folder."""
        place = plain(str(folder))
        return {**self.graph, "nodes": [
            {**node, "words": [self.volumes[node["name"]].replace(_HERE, place, 1)]} if node["name"] in self.volumes else node
            for node in self.graph["nodes"]]}

    def file(self, key: str, folder: Path) -> Path:
        """Returns the file of a result; for a sequence, with `$F4` in its name."""
        if key in self.volumes:
            return Path(self.volumes[key].replace(_HERE, str(folder), 1))
        name = "".join(c if c.isalnum() or c in "-_" else "_" for c in key)
        return folder / (name + (".$F4.npz" if self.frames else ".npz"))


class Job:
    """One run of a plan. Created and finished in the main thread; run() may be called in another thread and does not
    use Blender."""

    def __init__(self, plan: Plan, folder: Path, sessions: Optional[library.Sessions] = None) -> None:
        self.folder = folder
        self.title = ""
        self.fraction = 0.0
        self.cancelled = False
        self.error: Optional[Exception] = None
        self.report: Mapping[str, Any] = {}
        self.seconds = 0.0
        self.plan = plan
        self._sessions = sessions  # sessions whose values are reused; None: a new session
        self._frames_begun = self._frames_done = 0  # evaluated, and stored
        self._early: Set[str] = set()  # results that were shown before the end
        self._thread: Optional[threading.Thread] = None

    def run(self) -> None:
        """Evaluates the graph and stores the results. Keeps an exception for finish()."""
        began = time.perf_counter()
        try:
            self.make()
        except Exception as error:  # the main thread reports it
            self.error = error
        self.seconds = time.perf_counter() - began

    def make(self) -> None:
        """Writes the result files."""
        sessions = self._sessions or library.Sessions()
        with sessions.of(self.plan.tree, self.plan.meshes) as session:
            session.run_graph(self.plan.graph_in(self.folder), name="tree", progress=self._progress,
                              on_frame=self._store if self.plan.frames else None)
            if not self.plan.frames:
                self._store(None, session)
            self.report = session.report()
        self._fill()

    def _fill(self) -> None:
        """Repeats the volumes of a sequence with a step in the frames between, as Blender needs a file for each."""
        frames = self.plan.frames or []
        for key in self.plan.volumes if len(frames) > 1 and frames[1] - frames[0] > 1 else ():
            file = self.plan.file(key, self.folder)
            for frame in range(frames[0], frames[-1]):
                before = frame - (frame - frames[0]) % (frames[1] - frames[0])
                if before != frame:
                    cache.repeat(file.with_name(file.name.replace("$F4", f"{before:04d}")),
                                 file.with_name(file.name.replace("$F4", f"{frame:04d}")))

    def start(self) -> None:
        """Starts run() in a new thread."""
        self._thread = threading.Thread(target=self.run, name="curlew bake", daemon=True)
        _started[:] = [job for job in _started if job.running()] + [self]
        self._thread.start()

    def running(self) -> bool:
        """Returns whether the thread is still running."""
        return self._thread is not None and self._thread.is_alive()

    def stop(self) -> None:
        """Cancels the job and waits for its thread."""
        self.cancelled = True
        self.wait()

    def wait(self, seconds: Optional[float] = None) -> None:
        """Waits until the thread ends, at most for a number of seconds."""
        if self._thread is not None:
            self._thread.join(seconds)

    def finish(self, tree: bpy.types.NodeTree, scene: bpy.types.Scene) -> None:
        """Turns the results into objects, for nodes that still exist. Raises TreeError if the job has failed."""
        if self.error is not None:
            if isinstance(self.error, OSError):
                raise cache_error(self.error) from self.error
            if "needs actions after it" in str(self.error):
                raise TreeError("", "nothing in this tree changes with time: turn Sequence off") from self.error
            key = getattr(self.error, "key", None) or getattr(self.error, "node", None) or ""
            raise TreeError(key, library.text_of(self.error) if key else str(self.error)) from self.error
        self._show(tree, scene, self.plan.shown(), self._kinds())
        found = trees.nodes_of(tree)
        for key in self._kinds():
            if key in found:
                found[key].baked = self.plan.settings.get(key, "")
        outdated.refresh(tree, scene)

    def _kinds(self) -> Dict[str, str]:
        return {**dict.fromkeys(self.plan.volumes, "grid"), **{key: kind for key, (kind, _) in self.plan.wanted.items()}}

    def _show(self, tree: bpy.types.NodeTree, scene: bpy.types.Scene, frames: List[int], kinds: Mapping[str, str]) -> None:
        nodes = trees.nodes_of(tree)
        for key, kind in kinds.items():
            node = nodes.get(key)
            if getattr(node, "kind", "") == kind:
                try:
                    results.show_result(node, self.plan.file(key, self.folder), frames, scene, self.plan.shift)
                except RuntimeError as error:
                    raise TreeError(key, str(error)) from error

    def show_early(self, tree: bpy.types.NodeTree, scene: bpy.types.Scene) -> None:
        """Shows the frames of a sequence that are stored already, for nodes without an object: the first one while the
        job runs, all after it was cancelled. Others keep what they show. Raises TreeError if that fails."""
        frames = self.plan.shown()[:self._frames_done]
        if not frames or (self._early and self.running()):
            return
        if not self._early:
            self._early = {key for key in self._kinds() if getattr(trees.nodes_of(tree).get(key), "target", self) is None}
        kinds = {key: kind for key, kind in self._kinds().items() if key in self._early}
        self._show(tree, scene, frames[:1] if self.running() else frames, kinds)

    def _progress(self, title: str, fraction: float) -> bool:
        self.title, self.fraction = title, fraction
        return self.cancelled

    def overall(self) -> float:
        """Returns the overall progress from 0 to 1, as far as it is known."""
        if not self.plan.frames:
            return self.fraction
        return min(1.0, (self._frames_begun + self.fraction) / len(self.plan.frames))

    def _store(self, frame: Optional[int], session: Any) -> None:
        self._frames_begun += 1
        if frame is not None and frame - self.plan.shift < self.plan.first:
            return
        for key, (kind, link) in self.plan.wanted.items():
            file = self.plan.file(key, self.folder)
            if frame is not None:
                file = file.with_name(file.name.replace("$F4", f"{frame - self.plan.shift:04d}"))
            try:
                made = {"points": session.points, "curves": session.curves, "mesh": session.mesh}[kind](link)
            except library.curlew().Error as error:
                raise TreeError(key, library.text_of(error)) from error
            cache.save(file, results.ARRAYS[kind](made))
        self._frames_done += 1


def running_folders() -> Set[Path]:
    """Returns the folders to which threads are writing."""
    return {job.folder for job in _started if job.running()}


def stop_all() -> None:
    """Stops all threads."""
    for job in _started:
        job.cancelled = True
    for job in _started:
        job.wait()
    _started.clear()


atexit.register(stop_all)


T = TypeVar("T")
Planning = Generator[float, None, Plan]  # yields the progress, returns the plan


def finished(steps: Generator[float, None, T]) -> T:
    """Runs a generator to its end. Returns its result."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


def planned(tree: bpy.types.NodeTree, scene: bpy.types.Scene, collected: Collected,
            depsgraph: Optional[bpy.types.Depsgraph] = None, still: bool = False) -> Planning:
    """Returns the plan for a collected tree, including the values from objects and keyframes. Raises TreeError if the
    tree is invalid."""
    said = None if still else trees.frames_of(tree, scene, collected)
    frames = frame_numbers(said)
    keyframes.check(collected)
    shift = trees.shift_of(tree, scene, collected)
    sampled = yield from sample(scene, collected.meshes, collected.places, frames, shift, depsgraph)
    keyed = keyframes.over_frames(collected, frames, scene.frame_current, shift) if frames else {}
    for node in collected.graph.values():
        if node["action"] == "read" and node["words"][0] in sampled.still:
            node["words"] = [sampled.still[node["words"][0]]]
    for changed in (keyed, sampled.options):
        for key, options in changed.items():
            collected.graph[key]["options"].update(options)
    graph = collected.document(scene, said)
    first = scene.frame_start if frames and not (collected.frames or {}).get("words") else frames[0] if frames else 0
    return Plan(tree.name, graph, sampled.meshes, frames, collected.files, collected.wanted, shift, first)


def plan_of(tree: bpy.types.NodeTree, scene: bpy.types.Scene, depsgraph: Optional[bpy.types.Depsgraph] = None,
            only_results: bool = False) -> Plan:
    """Like planning_of(), in one step."""
    return finished(planning_of(tree, scene, depsgraph, only_results))


def planning_of(tree: bpy.types.NodeTree, scene: bpy.types.Scene, depsgraph: Optional[bpy.types.Depsgraph] = None,
                only_results: bool = False, allow_writing: bool = False) -> Planning:
    """Makes the plan for the current state of a tree. `depsgraph`: the dependency graph to use for objects, if not
    that of the scene. `only_results`: leave out nodes that write files of their own (Write, Report, …). `allow_writing`: let those
    write where writing.check() would refuse it. Raises TreeError if the tree is invalid."""
    names: Set[str] = set()
    ending = ".$F4.vdb" if trees.is_sequence(tree) else ".vdb"

    def namer(key: str, name: str) -> str:
        while name in names:
            name += "_"
        names.add(name)
        return f"{_HERE}/{name}{ending}"

    results_of_tree = [key for key, node in trees.nodes_of(tree).items() if hasattr(node, "kind")]
    collected = trees.collect(tree, namer, results_of_tree if only_results else None)
    trees.staggered(collected)
    if not allow_writing:
        writing.check(collected.reached)
    if not collected.graph and not collected.wanted:
        raise TreeError("", "nothing to do: add a result node and connect it")
    settings = outdated.settings(tree, scene, collected)
    plan = yield from planned(tree, scene, collected, depsgraph)
    plan.settings = settings
    return plan


def preparation(tree: bpy.types.NodeTree, scene: bpy.types.Scene,
                allow_writing: bool = False) -> Generator[float, None, Job]:
    """Yields the progress, and returns the job for a tree, with a new folder. Raises TreeError and marks the node red if
    the tree is invalid."""
    trees.clear_errors(tree)
    try:
        plan = yield from planning_of(tree, scene, allow_writing=allow_writing)
        return Job(plan, cache.new_folder(tree))
    except OSError as error:
        failed = cache_error(error)
        trees.show_error(tree, failed)
        raise failed from error
    except TreeError as error:
        trees.show_error(tree, error)
        raise


def prepare(tree: bpy.types.NodeTree, scene: bpy.types.Scene, allow_writing: bool = False) -> Job:
    """Like preparation(), in one step."""
    return finished(preparation(tree, scene, allow_writing))


def finish(tree: bpy.types.NodeTree, job: Job, scene: bpy.types.Scene) -> None:
    """Shows the results of a job, or its error on the node that failed."""
    try:
        job.finish(tree, scene)
        tree.message = f"baked in {job.seconds:.1f} s, {cache.size_text(job.folder)}"
    except TreeError as error:
        if isinstance(job.error, library.curlew().Cancelled):
            tree.message = "cancelled"
        else:
            trees.show_error(tree, error)
        raise


def bake(tree: bpy.types.NodeTree, scene: Optional[bpy.types.Scene] = None, allow_writing: bool = False) -> Job:
    """Bakes a tree and returns when it is finished. `allow_writing`: as for planning_of(). Raises TreeError if it fails."""
    scene = scene or bpy.context.scene
    job = prepare(tree, scene, allow_writing)
    job.run()
    finish(tree, job, scene)
    return job
