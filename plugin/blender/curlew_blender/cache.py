# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of bakes: a new folder for each bake, beside the .blend. Only needs Blender for its paths.

A bake on frame change is in a folder whose name is a digest of everything that it depends on, so the content of a
folder never changes.

Several .blend files may show the same bake, such as the versions of a shot that Save As has made. So the folder of a bake
notes which do, and a file deletes no bake that another one may show.
"""

import os
import re
import secrets
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import AbstractSet, Any, Callable, Dict, List, Optional, Set, Tuple

import bpy
import numpy as np

_NAME = "curlew_cache"
FOLDER = "//" + _NAME
_FRAME, PART = "frame_", "part_"  # prefixes of folders for bakes on frame change: finished, and in progress
_TEXT: Dict[str, Any] = {"encoding": "utf-8", "errors": "surrogateescape"}  # paths may have any bytes
_USERS = "used_by.txt"  # lists the .blend files that may show a bake, relative to the folder of the bake
COPY = "*"  # in that list: a copy of a .blend, whose path is not known
_saved: Set[Path] = set()  # folders of the bakes that the .blend showed when it was opened or saved, and so shows on disk


def temporary() -> Path:
    """Returns the folder for the bakes of files that have not been saved."""
    return Path(bpy.app.tempdir or tempfile.gettempdir()) / _NAME


def beside() -> Path:
    """Returns the folder for the bakes of the open file."""
    return Path(bpy.path.abspath(FOLDER)) if bpy.data.filepath else temporary()


def root(tree: bpy.types.NodeTree) -> Path:
    """Returns the folder for the bakes of a tree."""
    return beside() / (re.sub(r"[^A-Za-z0-9_-]+", "_", tree.name) or "tree")


def new_folder(tree: bpy.types.NodeTree) -> Path:
    """Creates a new folder. Raises OSError if it cannot be created."""
    base = root(tree)
    while True:
        tree.bake_number += 1
        folder = base / f"{tree.bake_number:04d}"
        if not bpy.data.filepath:  # moves beside the file when it is saved, where other bakes may be
            folder = folder.with_name(f"{folder.name}-{secrets.token_hex(4)}")
        if not folder.exists():
            folder.mkdir(parents=True)
            note(folder, bpy.data.filepath, new=True)
            return folder


def stored(path: Path) -> str:
    """Returns a path as the .blend stores it: relative to the .blend if that is saved."""
    text = str(path)
    return bpy.path.relpath(text) if bpy.data.filepath else text


def absolute(text: str) -> Path:
    """Returns the path of files that a .blend has stored. If their folder no longer exists, they are looked for in the
    cache beside the .blend, which may have been moved together with it."""
    if text.startswith("//") and not bpy.data.filepath:  # a file that is just being saved for the first time
        return temporary().parent / text[2:]
    path = Path(bpy.path.abspath(text))
    if not path.parent.is_dir() and _NAME in path.parts:
        tail = path.parts[len(path.parts) - path.parts[::-1].index(_NAME):]
        moved = beside().joinpath(*tail)
        if moved.parent.is_dir():
            return moved
    return path


def shown_by() -> List[bpy.types.Object]:
    """Returns the objects that show files of the cache other than volumes."""
    return [obj for obj in bpy.data.objects if obj.get("curlew_cache")]


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


def repeat(file: Path, name: Path) -> None:
    """Gives a file a second name: a hard link, or a copy where there are none, as on exFAT and some network shares."""
    try:
        os.link(file, name)
    except OSError:
        shutil.copyfile(file, name)


def load_grids(volume: bpy.types.Volume) -> bool:
    """Loads the file of a volume. Returns whether it could be read."""
    for _ in range(2):  # an error of the previous file stays until a file has been loaded
        volume.grids.unload()
        if volume.grids.load():
            return True
    return False


def size_text(folder: Path) -> str:
    """Returns the size of the files in a folder as a text. Counts a file with several names once."""
    files = {(about.st_dev, about.st_ino): about.st_size for about in (path.stat() for path in folder.glob("*"))}
    size = sum(files.values()) / 2**20
    return f"{size:.1f} MiB" if size < 1024 else f"{size / 1024:.1f} GiB"


def used_folders() -> Set[Path]:
    """Returns the folders whose files are in use by the open .blend."""
    paths = [v.filepath for v in bpy.data.volumes] + [obj["curlew_cache"] for obj in shown_by()]
    return {absolute(path).resolve().parent for path in paths if path}


def _is_in(path: Path, folder: Path) -> bool:
    return folder.resolve() in path.resolve().parents


def _users(folder: Path) -> Optional[Set[str]]:
    """Returns the .blend files that may show a bake; None if that is not known, because the last release has made it."""
    try:
        return set((folder / _USERS).read_text(**_TEXT).splitlines())
    except OSError:
        return None


def _from(folder: Path, blend: str) -> str:
    """Returns the path of a .blend relative to the folder of a bake, because both may move together."""
    if blend == COPY:
        return COPY
    try:
        return os.path.relpath(os.path.realpath(blend), folder.resolve())
    except ValueError:  # on another drive
        return os.path.realpath(blend)


def note(folder: Path, blend: str, shows: bool = True, new: bool = False) -> None:
    """Notes in the folder of a bake that a saved .blend, or a COPY, may show it, or no longer shows it. If a folder that is not
    new has no list, other files may show it as well. Raises OSError if the note cannot be written."""
    if not blend or _is_in(folder, temporary()):
        return
    known = _users(folder)
    before = {COPY} if known is None and not new else known or set()
    after = before | {_from(folder, blend)} if shows else before - {_from(folder, blend)}
    if after != before or (shows and known is None):
        part = folder / (_USERS + ".part")
        part.write_text("".join(f"{user}\n" for user in sorted(after)), **_TEXT)
        part.replace(folder / _USERS)


def note_shown(blend: str) -> None:
    """Notes in the folders of the bakes that the open .blend shows that it, or its COPY, does."""
    for folder in used_folders():
        if folder.parent.parent.name == _NAME and _is_bake(folder.name) and folder.is_dir():
            with suppress(OSError):  # a folder that cannot be written is not deleted either
                note(folder, blend)


def remember_saved() -> None:
    """Notes which bakes the open .blend shows, because it has just been read from disk or written there."""
    _saved.clear()
    _saved.update(used_folders())


def note_saved(blend: str) -> None:
    """Notes in the folders of all bakes near by whether the .blend that was saved shows them."""
    note_shown(blend)
    if os.path.realpath(blend) == os.path.realpath(bpy.data.filepath):  # not a copy
        remember_saved()
    used = used_folders()
    for base in {beside().resolve(), *(folder.parents[1] for folder in used if folder.parents[1].name == _NAME)}:
        for folder in {path.parent for path in base.glob(f"*/*/{_USERS}")}:
            with suppress(OSError):
                note(folder, blend, folder in used)


def _may_be_shown_by_others(folder: Path) -> bool:
    """Returns whether another .blend that exists may show a bake."""
    if _is_in(folder, temporary()):
        return False
    users = _users(folder)
    own = _from(folder, bpy.data.filepath) if bpy.data.filepath else ""
    return users is None or any(user == COPY or (user != own and (folder.resolve() / user).exists()) for user in users)


def make_once(base: Path, name: str, make: Callable[[Path], None], blend: str) -> Path:
    """Returns the folder for a frame's bake with this name. If it does not exist, `make` fills a new folder, which is
    then renamed atomically. Marks the folder as recently used. `blend`: the open .blend; "" if it was never saved. Raises
    OSError if the folder cannot be created."""
    folder = base / (_FRAME + name)
    if not folder.is_dir():
        base.mkdir(parents=True, exist_ok=True)
        part = Path(tempfile.mkdtemp(prefix=PART, dir=base))
        try:
            note(part, blend, new=True)
            make(part)
            part.rename(folder)
        except BaseException:
            shutil.rmtree(part, ignore_errors=True)
            raise
    os.utime(folder)
    return folder


def prune(base: Path, keep: int) -> None:
    """Removes bakes of frames except for the `keep` most recently used ones, those in use, those that the .blend on disk shows,
    and those that another .blend may show."""
    folders = sorted(base.glob(_FRAME + "*"), key=lambda folder: -folder.stat().st_mtime_ns)
    used = used_folders() | _saved if len(folders) > keep else set()
    for folder in folders[keep:]:
        if folder.resolve() not in used and not _may_be_shown_by_others(folder):
            shutil.rmtree(folder, ignore_errors=True)


def _is_bake(name: str) -> bool:
    return bool(re.fullmatch(r"\d+(-[0-9a-f]+)?", name)) or name.startswith((_FRAME, PART))


def clear(tree: bpy.types.NodeTree, busy: AbstractSet[Path] = frozenset(), saved: bool = False) -> Tuple[int, int, int]:
    """Removes bakes that are no longer in use, except for busy folders, those that the .blend on disk shows (unless `saved`), and
    those that another .blend may show. Returns the numbers of bakes that were removed, kept for the .blend on disk, and kept for
    others."""
    base, used = root(tree), used_folders() | {folder.resolve() for folder in busy}
    removed = on_disk = kept = 0
    for folder in sorted(base.iterdir()) if base.is_dir() else []:
        if not folder.is_dir() or not _is_bake(folder.name) or folder.resolve() in used:
            continue
        if folder.resolve() in _saved and not saved:
            on_disk += 1
        elif _may_be_shown_by_others(folder):
            kept += 1
        else:
            shutil.rmtree(folder)
            removed += 1
    return removed, on_disk, kept
