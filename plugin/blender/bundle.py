# SPDX-License-Identifier: GPL-3.0-or-later
"""Bundles the shared libraries that a library needs and a machine may lack, as copies that find each other."""

import re
import shutil
import subprocess
from pathlib import Path
from typing import Dict, List

# Libraries that every Linux desktop provides in a suitable version.
_BASE = re.compile(r"(linux-vdso|ld-linux-x86-64|lib(c|m|dl|rt|pthread|gcc_s|stdc\+\+|z))\.")
FOLDER = "lib"  # beside the library


def _run(*words: object) -> str:
    try:
        done = subprocess.run([str(w) for w in words], capture_output=True, text=True, check=False)
    except FileNotFoundError:
        raise ValueError(f"{words[0]} is not installed; ./dev plugin installs what is needed") from None
    if done.returncode != 0:
        raise ValueError(f"{words[0]} failed: {done.stderr.strip() or done.stdout.strip()}")
    return done.stdout


def needed(library: Path) -> Dict[str, Path]:
    """Returns the paths of all direct and indirect dependencies, by soname."""
    found = {}
    for line in _run("ldd", library).splitlines():
        name, arrow, rest = line.strip().partition(" => ")
        if not arrow or _BASE.match(name):
            continue
        path = rest.partition(" (")[0]
        if path == "not found":
            raise ValueError(f"'{library}' needs {name}, which is not installed")
        found[name] = Path(path).resolve()
    return found


def _bundled(soname: str) -> str:
    """Returns a library's name in the bundle. It differs from the usual one, so that another build of the library that
    the host has already loaded is not used instead."""
    return f"curlew-{soname}"


def _connect(copy: Path, where: str) -> None:
    """Makes a copy search for its dependencies in the bundle."""
    _run("patchelf", "--set-rpath", where, copy)
    for name in _run("patchelf", "--print-needed", copy).split():
        if not _BASE.match(name):
            _run("patchelf", "--replace-needed", name, _bundled(name), copy)


def bundle(library: Path, folder: Path) -> List[Path]:
    """Copies the library into a folder, and its dependencies into FOLDER in that folder. Returns all copies."""
    (folder / FOLDER).mkdir(parents=True)
    copies = [Path(shutil.copy(library, folder / "libcurlew.so"))]
    _connect(copies[0], f"$ORIGIN/{FOLDER}")
    for soname, path in sorted(needed(library).items()):
        copy = Path(shutil.copy(path, folder / FOLDER / _bundled(soname)))
        _run("patchelf", "--set-soname", copy.name, copy)
        _connect(copy, "$ORIGIN")
        copies.append(copy)
    command = library.parent / "curlew"  # reads untrusted files in a separate process
    if command.is_file():
        copies.append(Path(shutil.copy(command, folder / command.name)))
        _connect(copies[-1], f"$ORIGIN/{FOLDER}")
    return copies


def licences(library: Path) -> Dict[str, bytes]:
    """Returns the licences of the bundled libraries, by Debian package name."""
    texts = {}
    for soname, path in needed(library).items():
        owners = _run("dpkg-query", "--search", f"*/{path.name}").splitlines()
        package = next((o.split(":")[0] for o in owners if o.endswith(f"/{path.name}")), None)
        text = Path("/usr/share/doc") / (package or "-") / "copyright"
        if not text.is_file():
            raise ValueError(f"no licence is known for {soname}, {path}")
        texts[str(package)] = text.read_bytes()
    return texts
