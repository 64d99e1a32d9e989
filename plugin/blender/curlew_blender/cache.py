# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of bakes: a new folder for each, beside the .blend. Needs no Blender but for its paths.

Bakes on frame change are in folders named after all that they depend on, so that what is in a folder never changes.
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
_FRAME, _PART = "frame_", "part_"  # folders of bakes on frame change, and what they are while they are made


def root(tree: bpy.types.NodeTree) -> Path:
    """Where the bakes of a tree are."""
    if bpy.data.filepath:
        base = Path(bpy.path.abspath(FOLDER))
    else:
        base = Path(bpy.app.tempdir or tempfile.gettempdir()) / "curlew_cache"
    return base / (re.sub(r"[^A-Za-z0-9_-]+", "_", tree.name) or "tree")


def new_folder(tree: bpy.types.NodeTree) -> Path:
    """A folder that was not there. OSError where it cannot be made."""
    base = root(tree)
    while True:
        tree.bake_number += 1
        folder = base / f"{tree.bake_number:04d}"
        if not folder.exists():
            folder.mkdir(parents=True)
            return folder


def stored(path: Path) -> str:
    """A path as the .blend has it: relative to it where it can be."""
    text = str(path)
    return bpy.path.relpath(text) if bpy.data.filepath else text


def save(path: Path, arrays: Dict[str, np.ndarray]) -> None:
    """The arrays, whole or not at all."""
    part = path.with_name(path.name + ".part")
    with open(part, "wb") as file:
        np.savez(file, **arrays)
    os.replace(part, path)


def load(path: Path) -> Dict[str, np.ndarray]:
    """What save() has written."""
    with np.load(path) as arrays:
        return {name: arrays[name] for name in arrays.files}


def used_folders() -> Set[Path]:
    """Folders whose files the open .blend shows."""
    paths: List[str] = [v.filepath for v in bpy.data.volumes]
    paths += [o["curlew_cache"] for o in bpy.data.objects if "curlew_cache" in o]
    return {Path(bpy.path.abspath(p)).resolve().parent for p in paths if p}


def make_once(base: Path, name: str, make: Callable[[Path], None]) -> Path:
    """The folder of frames' bakes that has this name; where there is none yet, `make` fills it, and it is there whole or
    not at all. What is used stays longest. OSError where it cannot be made."""
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
    """Removes the bakes of frames but for those used last, and those that something shows."""
    folders = sorted(base.glob(_FRAME + "*"), key=lambda folder: -folder.stat().st_mtime_ns)
    used = used_folders() if len(folders) > keep else set()
    for folder in folders[keep:]:
        if folder.resolve() not in used:
            shutil.rmtree(folder, ignore_errors=True)


def _is_bake(name: str) -> bool:
    return name.isdigit() or name.startswith((_FRAME, _PART))


def clear(tree: bpy.types.NodeTree, busy: AbstractSet[Path] = frozenset()) -> int:
    """Removes the bakes that nothing shows any more, but for the folders that are busy; returns how many."""
    base, used, removed = root(tree), used_folders() | {folder.resolve() for folder in busy}, 0
    for folder in sorted(base.iterdir()) if base.is_dir() else []:
        if folder.is_dir() and _is_bake(folder.name) and folder.resolve() not in used:
            shutil.rmtree(folder)
            removed += 1
    return removed
