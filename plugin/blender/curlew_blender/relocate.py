# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps bakes with the .blend when that is saved: for the first time, or in another folder."""

import shutil
from contextlib import suppress
from pathlib import Path
from typing import Any, Set, Tuple

import bpy

from . import cache, handlers
from .job import running_folders

_of_others: Set[Path] = set()  # bakes in the temporary folder of files that were open before
_before: Tuple[Any, ...] = ()  # what told the open file from others before it was saved


def _moved(text: str) -> str:
    """Returns a path in the temporary folder as it will be when that is beside the .blend; others unchanged."""
    try:
        return f"{cache.FOLDER}/{Path(bpy.path.abspath(text)).relative_to(cache.temporary())}"
    except ValueError:
        return text


def _move() -> None:
    """Moves finished bakes from the temporary folder beside the .blend, which has been saved."""
    source, staying = cache.temporary(), running_folders() | _of_others
    for folder in source.glob("*/*") if source.is_dir() else ():
        target = cache.beside() / folder.relative_to(source)
        moves = folder.is_dir() and folder not in staying and not folder.name.startswith(cache.PART)
        if moves and not target.exists():
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.move(str(folder), str(target))
            with suppress(OSError):  # without the note, it is kept
                cache.note(target, bpy.data.filepath, new=True)


def _is_moving(path: Path) -> bool:
    """Returns whether a path is in the temporary folder, and nothing writes there any more."""
    return cache.temporary() in path.parents and not running_folders() & set(path.parents)


def _on_disk() -> Tuple[Any, ...]:
    """Returns the path of the open file, and numbers that change if it is saved."""
    try:
        about = Path(bpy.data.filepath).stat()
    except OSError:
        return (bpy.data.filepath,)
    return bpy.data.filepath, about.st_ino, about.st_mtime_ns


@bpy.app.handlers.persistent
def before_save(*_: object) -> None:
    """Prepares the paths for the new place of the .blend, which is not known yet. Those of the temporary folder become
    relative, because that moves. The others of objects become absolute. Blender itself changes those of volumes."""
    global _before
    _before = _on_disk()
    for volume in bpy.data.volumes:
        if volume.filepath and _is_moving(cache.absolute(volume.filepath)):
            volume.filepath = _moved(volume.filepath)
    for obj in cache.shown_by():
        path = cache.absolute(obj["curlew_cache"])
        moves = not bpy.data.filepath and _is_moving(path)
        obj["curlew_cache"] = _moved(str(path)) if moves else str(path)
    if bpy.data.filepath:
        _move()
        for obj in cache.shown_by():
            obj["curlew_cache"] = str(cache.absolute(obj["curlew_cache"]))


@bpy.app.handlers.persistent
def after_save(*given: object) -> None:
    """Moves the bakes of a file that had not been saved before, makes paths relative again, and notes which bakes the file
    shows. Newer Blenders give the path that was saved. In older ones, it was a copy if the open file has not changed."""
    if bpy.data.filepath:
        _move()
    else:  # a copy was saved, or saving has failed
        for volume in bpy.data.volumes:
            if volume.filepath.startswith(cache.FOLDER):
                volume.filepath = str(cache.absolute(volume.filepath))
    for obj in cache.shown_by():
        obj["curlew_cache"] = cache.stored(cache.absolute(obj["curlew_cache"]))
    if bpy.data.filepath:
        path = given[0] if given and isinstance(given[0], str) else ""
        if path or _on_disk() != _before:
            cache.note_saved(path or bpy.data.filepath)
        else:
            cache.note_shown(cache.COPY)


@bpy.app.handlers.persistent
def after_load(*_: object) -> None:
    """Leaves the bakes of a file that was open before, and never saved, where they are. Notes which bakes the file shows, as
    it may be a copy, or the file of an earlier release."""
    cache.note_shown(bpy.data.filepath)
    cache.remember_saved()
    used = cache.used_folders()
    _of_others.clear()
    _of_others.update(folder for folder in cache.temporary().glob("*/*") if folder.resolve() not in used)


register, unregister = handlers.factory(("save_pre", before_save), ("save_post", after_save), ("load_post", after_load))
