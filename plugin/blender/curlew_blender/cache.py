# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of bakes: a new folder for each bake, beside the .blend. Only needs Blender for its paths.

A bake on frame change is in a folder whose name is a digest of everything that it depends on, so the content of a
folder never changes.
"""

import os
import re
import shutil
import tempfile
from pathlib import Path
from typing import AbstractSet, Callable, Dict, List, Set

import bpy
import numpy as np

FOLDER = "//curlew_cache"
_FRAME, _PART = "frame_", "part_"  # prefixes of folders for bakes on frame change: finished, and in progress


def root(tree: bpy.types.NodeTree) -> Path:
    """Returns the folder for the bakes of a tree."""
    if bpy.data.filepath:
        base = Path(bpy.path.abspath(FOLDER))
    else:
        base = Path(bpy.app.tempdir or tempfile.gettempdir()) / "curlew_cache"
    return base / (re.sub(r"[^A-Za-z0-9_-]+", "_", tree.name) or "tree")


def new_folder(tree: bpy.types.NodeTree) -> Path:
    """Creates a new folder. Raises OSError if it cannot be created."""
    base = root(tree)
    while True:
        tree.bake_number += 1
        folder = base / f"{tree.bake_number:04d}"
        if not folder.exists():
            folder.mkdir(parents=True)
            return folder


def stored(path: Path) -> str:
    """Returns a path as the .blend stores it: relative to the .blend if that is saved."""
    text = str(path)
    return bpy.path.relpath(text) if bpy.data.filepath else text


def save(path: Path, arrays: Dict[str, np.ndarray]) -> None:
    """Saves the arrays atomically."""
    part = path.with_name(path.name + ".part")
    with open(part, "wb") as file:
        np.savez(file, **arrays)
    os.replace(part, path)


def load(path: Path) -> Dict[str, np.ndarray]:
    """Loads arrays that save() has written."""
    with np.load(path) as arrays:
        return {name: arrays[name] for name in arrays.files}


def used_folders() -> Set[Path]:
    """Returns the folders whose files are in use by the open .blend."""
    paths: List[str] = [v.filepath for v in bpy.data.volumes]
    paths += [o["curlew_cache"] for o in bpy.data.objects if "curlew_cache" in o]
    return {Path(bpy.path.abspath(p)).resolve().parent for p in paths if p}


def make_once(base: Path, name: str, make: Callable[[Path], None]) -> Path:
    """Returns the folder for a frame's bake with this name. If it does not exist, `make` fills a new folder, which is
    then renamed atomically. Marks the folder as recently used. Raises OSError if it cannot be created."""
    folder = base / (_FRAME + name)
    if not folder.is_dir():
        base.mkdir(parents=True, exist_ok=True)
        part = Path(tempfile.mkdtemp(prefix=_PART, dir=base))
        try:
            make(part)
            part.rename(folder)
        except BaseException:
            shutil.rmtree(part, ignore_errors=True)
            raise
    os.utime(folder)
    return folder


def prune(base: Path, keep: int) -> None:
    """Removes bakes of frames except for the `keep` most recently used ones and those in use."""
    folders = sorted(base.glob(_FRAME + "*"), key=lambda folder: -folder.stat().st_mtime_ns)
    used = used_folders() if len(folders) > keep else set()
    for folder in folders[keep:]:
        if folder.resolve() not in used:
            shutil.rmtree(folder, ignore_errors=True)


def _is_bake(name: str) -> bool:
    return name.isdigit() or name.startswith((_FRAME, _PART))


def clear(tree: bpy.types.NodeTree, busy: AbstractSet[Path] = frozenset()) -> int:
    """Removes bakes that are no longer in use, except for busy folders. Returns the number of removed bakes."""
    base, used, removed = root(tree), used_folders() | {folder.resolve() for folder in busy}, 0
    for folder in sorted(base.iterdir()) if base.is_dir() else []:
        if folder.is_dir() and _is_bake(folder.name) and folder.resolve() not in used:
            shutil.rmtree(folder)
            removed += 1
    return removed
