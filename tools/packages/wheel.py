#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes a Python wheel with the library, its dependencies and the reader process inside.

    tools/packages/wheel.py --library build/libcurlew.so --version 0.2.0 --out out/

https://packaging.python.org/en/latest/specifications/binary-distribution-format/
"""

import argparse
import base64
import hashlib
import stat
import sys
import tempfile
import zipfile
from pathlib import Path
from typing import Dict

from bundle import bundle, contained, licences, needed, newest_symbols
from sbom import sbom

TOP = Path(__file__).resolve().parents[2]

METADATA = """\
Metadata-Version: 2.1
Name: curlew
Version: {version}
Summary: Divergence-free vector noise (DFVN): procedural velocity fields that respect boundaries
License: Apache-2.0
Classifier: License :: OSI Approved :: Apache Software License
Classifier: Operating System :: POSIX :: Linux
Classifier: Programming Language :: Python :: 3
Requires-Python: >=3.8
Requires-Dist: numpy
Description-Content-Type: text/markdown

{description}
"""
WHEEL = """\
Wheel-Version: 1.0
Generator: curlew {version}
Root-Is-Purelib: false
Tag: {tag}
"""


def platform_tag(files) -> str:
    """Returns the platform of binary files: the oldest glibc that they run on (PEP 600). Distributions with glibc 2.35
    have the libstdc++ of GCC 12, and those with 2.34 may have that of GCC 11, whose newest symbols are 3.4.29."""
    newest = newest_symbols(files)
    minor = newest["GLIBC"][1]
    if newest.get("GLIBCXX", ()) > (3, 4, 29):
        minor = max(minor, 35)
    return f"manylinux_2_{minor}_x86_64"


def description() -> str:
    """Returns the documentation of the package, for its page in an index."""
    text = (TOP / "plugin/python/curlew/__init__.py").read_text()
    return text.split('"""')[1].strip()


def contents(library: Path, version: str) -> Dict[str, bytes]:
    """Returns the files of the wheel but its RECORD, by name, and puts the tag into WHEEL."""
    files = {}
    package = TOP / "plugin/python/curlew"
    for path in sorted(p for p in package.iterdir() if p.suffix == ".py" or p.name == "py.typed"):
        files[f"curlew/{path.name}"] = path.read_bytes()
    with tempfile.TemporaryDirectory() as folder:
        copies = bundle(library, Path(folder))
        tag = f"py3-none-{platform_tag(copies)}"
        for copy in copies:
            files[f"curlew/{copy.relative_to(folder)}"] = copy.read_bytes()
    info = f"curlew-{version}.dist-info"
    packages = contained(needed(library).values())
    files[f"{info}/METADATA"] = METADATA.format(version=version, description=description()).encode()
    files[f"{info}/WHEEL"] = WHEEL.format(version=version, tag=tag).encode()
    for name in ("LICENSE", "NOTICE"):
        files[f"{info}/licenses/{name}"] = (TOP / name).read_bytes()
    for name, text in licences(packages).items():
        files[f"{info}/licenses/{name}.txt"] = text
    files[f"{info}/sboms/curlew.spdx.json"] = sbom(version, packages)
    return files


def record(files: Dict[str, bytes], name: str) -> bytes:
    """Returns the list of all files with their digests."""
    lines = []
    for file, data in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        lines.append(f"{file},sha256={digest},{len(data)}")
    return ("\n".join([*lines, f"{name},,"]) + "\n").encode()


def make(library: Path, version: str, out: Path, level: int = 9) -> Path:
    """Writes the wheel, which depends only on its contents and the compression level, and returns its path."""
    files = contents(library, version)
    info = f"curlew-{version}.dist-info"
    tag = files[f"{info}/WHEEL"].decode().split("Tag: ")[1].strip()
    files[f"{info}/RECORD"] = record(files, f"{info}/RECORD")
    out.mkdir(parents=True, exist_ok=True)
    path = out / f"curlew-{version}-{tag}.whl"
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            # pip keeps the permission to execute of regular files only.
            entry.external_attr = (stat.S_IFREG | (0o755 if name == "curlew/curlew" else 0o644)) << 16
            archive.writestr(entry, data, compresslevel=level)
    return path


def main() -> int:
    """Runs the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--library", type=Path, required=True, help="libcurlew.so")
    parser.add_argument("--version", required=True, help="version of the project")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for the wheel (default: out)")
    given = parser.parse_args()
    try:
        print(make(given.library, given.version, given.out))
    except (OSError, ValueError) as error:
        print(f"wheel.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
