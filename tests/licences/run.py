# SPDX-License-Identifier: Apache-2.0
"""Checks that every file that can hold a comment has the line SPDX-License-Identifier: run.py ROOT."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

DATA = {".csv", ".gif", ".glb", ".json", ".obj", ".png", ".svg"}  # pictures, models and measurements
WITHOUT = {"LICENSE", "NOTICE", "py.typed"}  # licences themselves, and a file that must be empty


def files(root):
    """Returns the files of the checkout, or of an exported copy of it that has not been built."""
    git = shutil.which("git")
    listed = git and subprocess.run([git, "-C", root, "ls-files", "-z"], capture_output=True, text=True, check=False).stdout
    if listed:
        return [path for path in map(root.joinpath, listed.split("\0")[:-1]) if path.is_file()]
    return [Path(folder) / name for folder, folders, names in os.walk(root) for name in names
            if Path(folder).relative_to(root).parts[:1] not in {("build",), ("out",)} and "__pycache__" not in folder]


def main(root):
    wrong = []
    found = [path for path in files(Path(root)) if path.suffix not in DATA and path.name not in WITHOUT]
    for path in found:
        name = path.relative_to(root).as_posix()
        wanted = "GPL-3.0-or-later" if name.startswith("plugin/blender/") else "Apache-2.0"
        told = re.search(r"SPDX-License-Identifier: (\S+)", path.read_text(encoding="utf-8")[:200])
        if not told or told[1] != wanted:
            wrong.append(f"{name}: its first line is not 'SPDX-License-Identifier: {wanted}'")
    print(f"licences: {len(found)} files")
    return "\n".join(wrong) or 0


sys.exit(main(sys.argv[1]))
