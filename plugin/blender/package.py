#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Packs the Blender add-on: a legacy add-on (Blender 3.4 and later) and an extension (4.2 and later).

The packages contain the library and its dependencies, except for the C and C++ runtime libraries and zlib.

    plugin/blender/package.py --library build/libcurlew.so --out out/
"""

import argparse
import re
import sys
import tempfile
import zipfile
from pathlib import Path
from typing import Dict, Iterator, Tuple

HERE = Path(__file__).resolve().parent
ADDON = HERE / "curlew_blender"
PYTHON = HERE.parent / "python" / "curlew"
CMAKE = HERE.parents[1] / "CMakeLists.txt"
NAME = "curlew_blender"
sys.path.append(str(HERE.parents[1] / "tools" / "packages"))
from bundle import bundle, contained, licences, needed  # noqa: E402
from sbom import sbom  # noqa: E402

MANIFEST = """\
schema_version = "1.0.0"

id = "{name}"
version = "{version}"
name = "Curlew"
tagline = "Divergence-free flows that conform to walls"
maintainer = "The Curlew developers"
type = "add-on"
tags = ["Physics", "Node"]
blender_version_min = "4.2.0"
license = ["SPDX:GPL-3.0-or-later"]
platforms = ["linux-x64"]

[permissions]
files = "Writes bakes beside the .blend file, and exported scenes"
"""


def version() -> str:
    """Returns the project's version. Raises ValueError if the version in bl_info differs."""
    found = re.search(r"project\(curlew VERSION ([0-9.]+)", CMAKE.read_text())
    text = found[1] if found else ""
    told = re.search(r'"version": \(([0-9, ]+)\)', (ADDON / "__init__.py").read_text())
    if not told or told[1].replace(", ", ".") != text:
        raise ValueError(f"the version in bl_info differs from the project's, {text}")
    return text


def files(library: Path) -> Iterator[Tuple[str, bytes]]:
    """Yields all files of the add-on, relative to its folder."""
    for path in sorted(ADDON.glob("*.py")):
        yield path.name, path.read_bytes()
    for path in sorted(p for p in PYTHON.iterdir() if p.suffix == ".py" or p.name == "py.typed"):
        yield f"curlew/{path.name}", path.read_bytes()
    with tempfile.TemporaryDirectory() as folder:
        for copy in bundle(library, Path(folder)):
            yield f"curlew/{copy.relative_to(folder)}", copy.read_bytes()
    packages = contained(needed(library).values())
    for name, text in licences(packages).items():
        yield f"curlew/licences/{name}.txt", text
    yield "curlew/sbom.spdx.json", sbom(version(), packages)


def write(path: Path, contents: Dict[str, bytes], level: int) -> None:
    """Writes a reproducible zip: it depends only on its contents and the compression level."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=level) as archive:
        for name, data in contents.items():
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, data)


def package(library: Path, out: Path, level: int) -> Tuple[Path, Path]:
    """Writes both packages and returns their paths."""
    if not library.is_file():
        raise FileNotFoundError(f"there is no '{library}'; build it: ninja -C build curlew_c")
    number = version()
    contents = dict(files(library))
    out.mkdir(parents=True, exist_ok=True)
    legacy, extension = out / f"{NAME}-{number}-legacy.zip", out / f"{NAME}-{number}-linux-x64.zip"
    write(legacy, {f"{NAME}/{name}": data for name, data in contents.items()}, level)
    write(extension, {"blender_manifest.toml": MANIFEST.format(name=NAME, version=number).encode(), **contents}, level)
    return legacy, extension


def main() -> int:
    """Runs the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--library", type=Path, required=True, help="libcurlew.so")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for the two zip files (default: out)")
    parser.add_argument("--level", type=int, default=9, help="compression: 1 (fast) to 9 (small; the default)")
    given = parser.parse_args()
    try:
        for path in package(given.library, given.out, given.level):
            print(path)
    except (OSError, ValueError) as error:
        print(f"package.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
