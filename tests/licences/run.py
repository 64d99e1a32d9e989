# SPDX-License-Identifier: Apache-2.0
"""Checks that every source file has the line SPDX-License-Identifier: run.py ROOT."""

import re
import sys
from pathlib import Path

SOURCES = {".c", ".cmake", ".cpp", ".h", ".py", ".sbatch", ".sh"}
FOLDERS = ("bench", "cmake", "include", "plugin", "scenes", "src", "tests", "tools")


def main(root):
    root = Path(root)
    files = [root / "CMakeLists.txt", root / "dev"]
    for folder in FOLDERS:
        files += [p for p in (root / folder).rglob("*") if p.suffix in SOURCES or p.name == "CMakeLists.txt"]
    wrong = []
    for path in files:
        name = path.relative_to(root).as_posix()
        wanted = "GPL-3.0-or-later" if name.startswith("plugin/blender/") else "Apache-2.0"
        found = re.search(r"SPDX-License-Identifier: (\S+)", path.read_text(encoding="utf-8")[:200])
        if not found or found[1] != wanted:
            wrong.append(f"{name}: its first line is not 'SPDX-License-Identifier: {wanted}'")
    return "\n".join(wrong) or 0


sys.exit(main(sys.argv[1]))
