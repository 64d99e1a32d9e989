#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes an archive that runs where it is unpacked: an installed tree, with all libraries beside it but those of glibc, libstdc++ and zlib.

    tools/packages/portable.py --build build --version 0.2.0 --out out/
"""

import argparse
import gzip
import shutil
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

from bundle import FOLDER, bundle_program, contained, licences, newest_symbols
from sbom import sbom

TOP = Path(__file__).resolve().parents[2]
OLDEST = {"GLIBC": (2, 34), "GLIBCXX": (3, 4, 29)}  # RHEL 9 and its relatives, the VFX platform's system since 2024


def fill(folder: Path, build: Path, version: str) -> None:
    """Makes the tree in a folder. Raises ValueError if a file needs a newer system than OLDEST."""
    subprocess.run(["cmake", "--install", build, "--prefix", folder / "prefix", "--strip"], check=True, capture_output=True)
    installed = folder / "prefix"
    bundled = bundle_program(installed / "bin" / "curlew", folder)
    library = next(installed.glob("lib*/**/libcurlew.so"))
    bundled += bundle_program(library.resolve(), folder, FOLDER)
    (folder / FOLDER / library.resolve().name).rename(folder / FOLDER / "libcurlew.so")
    # The package looks for libcurlew.so in the folders above it.
    shutil.copytree(next(installed.glob("lib*/**/dist-packages/curlew")), folder / FOLDER / "python" / "curlew")
    shutil.move(installed / "share", folder / "share")
    shutil.rmtree(installed)
    shutil.copytree(TOP / "scenes", folder / "share" / "curlew" / "scenes")
    for name in ("LICENSE", "NOTICE", "README.md"):
        shutil.copy(TOP / name, folder / name)
    packages = contained(bundled)
    for name, text in licences(packages).items():
        (folder / "share" / "licences").mkdir(exist_ok=True)
        (folder / "share" / "licences" / f"{name}.txt").write_bytes(text)
    (folder / "sbom.spdx.json").write_bytes(sbom(version, packages))
    newest = newest_symbols(path for path in folder.rglob("*") if path.is_file() and path.read_bytes()[:4] == b"\x7fELF")
    for name, version in newest.items():
        if version > OLDEST[name]:
            raise ValueError(f"a file needs {name} {version}, newer than {OLDEST[name]}")


def pack(folder: Path, path: Path, level: int) -> None:
    """Writes an archive that depends only on the folder's contents and the compression level."""
    def plain(entry: tarfile.TarInfo) -> tarfile.TarInfo:
        entry.uid = entry.gid = entry.mtime = 0
        entry.uname = entry.gname = "root"
        entry.mode = 0o755 if entry.isdir() or entry.mode & 0o100 else 0o644
        return entry

    with open(path, "wb") as file, gzip.GzipFile("", "wb", level, file, 0) as packed, \
            tarfile.open(fileobj=packed, mode="w") as archive:
        archive.add(folder, folder.name, recursive=False, filter=plain)
        for entry in sorted(folder.rglob("*")):
            archive.add(entry, Path(folder.name) / entry.relative_to(folder), recursive=False, filter=plain)


def make(build: Path, version: str, out: Path, level: int = 9) -> Path:
    """Writes the archive and returns its path."""
    name = f"curlew-{version}-linux-x86_64"
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / name).mkdir()
        fill(Path(folder) / name, build, version)
        pack(Path(folder) / name, out / f"{name}.tar.gz", level)
    return out / f"{name}.tar.gz"


def main() -> int:
    """Runs the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=Path, required=True, help="folder of the build")
    parser.add_argument("--version", required=True, help="version of the project")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for the archive (default: out)")
    given = parser.parse_args()
    try:
        print(make(given.build, given.version, given.out))
    except (OSError, ValueError, subprocess.CalledProcessError) as error:
        print(f"portable.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
