# SPDX-License-Identifier: Apache-2.0
"""Packs both Blender add-ons and the wheel in them, once for all tests of packages: pack.py SOURCE_DIR LIBRARY FOLDER."""

import subprocess
import sys
import zipfile
from pathlib import Path

source, library, folder = (Path(argument) for argument in sys.argv[1:])
for pattern in ("*.zip", "*.whl"):
    for old in folder.glob(pattern):
        old.unlink()
subprocess.run([sys.executable, "-B", source / "plugin/blender/package.py", "--library", library, "--out", folder, "--level", "0"],
               check=True)
with zipfile.ZipFile(next(folder.glob("*-linux-x64.zip"))) as extension:
    name = next(name for name in extension.namelist() if name.endswith(".whl"))
    (folder / Path(name).name).write_bytes(extension.read(name))
