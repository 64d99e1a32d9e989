#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Packs the Blender add-on: a legacy add-on (Blender 3.4 and later) and an extension (4.2 and later).

Both contain Curlew's wheel, with the library and its dependencies: the legacy add-on unpacked, because Blender before 4.2
has no place for wheels, the extension as a file.
https://docs.blender.org/manual/en/latest/advanced/extensions/python_wheels.html

    plugin/blender/package.py --library build/libcurlew.so --out out/
"""

import argparse
import re
import sys
import tempfile
import zipfile
from pathlib import Path
from typing import Dict, Tuple

HERE = Path(__file__).resolve().parent
ADDON = HERE / "curlew_blender"
CMAKE = HERE.parents[1] / "CMakeLists.txt"
NAME = "curlew_blender"
sys.path.insert(0, str(HERE.parents[1] / "tools" / "packages"))  # before a package of the system called wheel
import wheel  # noqa: E402

MANIFEST = """\
schema_version = "1.0.0"

id = "curlew"
version = "{version}"
name = "Curlew"
tagline = "Divergence-free flows that conform to walls"
maintainer = "The Curlew developers"
type = "add-on"
tags = ["Physics", "Node"]
blender_version_min = "4.2.0"
license = ["SPDX:GPL-3.0-or-later"]
platforms = ["linux-x64"]
wheels = ["./wheels/{wheel}"]

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


def own_files() -> Dict[str, bytes]:
    """Returns the add-on's own files."""
    paths = [*sorted(ADDON.glob("*.py")), HERE / "LICENSE"]
    return {path.name: path.read_bytes() for path in paths}


def write(path: Path, contents: Dict[str, bytes], level: int) -> None:
    """Writes a reproducible zip: it depends only on its contents and the compression level. A name that ends with a slash
    is a folder."""
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in contents.items():
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_STORED if entry.is_dir() else zipfile.ZIP_DEFLATED
            entry.external_attr = (0o40755 << 16 | 0x10) if entry.is_dir() else 0o644 << 16
            archive.writestr(entry, data, compresslevel=level)


def package(library: Path, out: Path, level: int) -> Tuple[Path, Path]:
    """Writes both packages and returns their paths."""
    if not library.is_file():
        raise FileNotFoundError(f"there is no '{library}'; build it: ninja -C build curlew_c")
    number = version()
    own = own_files()
    with tempfile.TemporaryDirectory() as folder:
        built = wheel.make(library, number, Path(folder), level)
        packed = built.read_bytes()
        with zipfile.ZipFile(built) as archive:
            unpacked = {name: archive.read(name) for name in archive.namelist()}
    manifest = MANIFEST.format(version=number, wheel=built.name)
    out.mkdir(parents=True, exist_ok=True)
    legacy, extension = out / f"{NAME}-{number}-legacy.zip", out / f"{NAME}-{number}-linux-x64.zip"
    # Before it unpacks an update, Blender removes what has an entry without a slash inside its name: the folder. Otherwise it
    # would truncate the library that it has mapped, and crash.
    write(legacy, {f"{NAME}/": b"", **{f"{NAME}/{name}": data for name, data in {**own, **unpacked}.items()}}, level)
    write(extension, {"blender_manifest.toml": manifest.encode(), **own, f"wheels/{built.name}": packed}, level)
    return legacy, extension


def main() -> int:
    """Runs the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--library", type=Path, required=True, help="libcurlew.so")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for the two zip files (default: out)")
    parser.add_argument("--level", type=int, default=9, help="compression: 0 (none) to 9 (small; the default)")
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
