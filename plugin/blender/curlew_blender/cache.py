"""Files of bakes: a new folder for each, beside the .blend. Needs no Blender but for its paths."""

import os
import re
import shutil
import tempfile
from pathlib import Path
from typing import Any, Dict, List, Set

import bpy
import numpy as np

FOLDER = "//curlew_cache"


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


def save(path: Path, arrays: Dict[str, Any]) -> None:
    """The arrays that there are (None is left out), whole or not at all."""
    part = path.with_name(path.name + ".part")
    with open(part, "wb") as file:
        np.savez(file, **{name: array for name, array in arrays.items() if array is not None})
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


def clear(tree: bpy.types.NodeTree) -> int:
    """Removes the bakes that nothing shows any more; returns how many."""
    base, used, removed = root(tree), used_folders(), 0
    for folder in sorted(base.iterdir()) if base.is_dir() else []:
        if folder.is_dir() and folder.name.isdigit() and folder.resolve() not in used:
            shutil.rmtree(folder)
            removed += 1
    return removed
