# SPDX-License-Identifier: Apache-2.0
"""Runs the code of a page in a new folder, as a reader would: run.py PAGE COMMAND [LIBRARY].

Runs each command in its shell blocks that begins with curlew, also behind a pipe, or with python3 -c, or with one of OpenVDB's tools if that tool is installed. If a
library is given, also runs the Python blocks as one script, except those that need Blender (see tests/blender/pages_test.py).
Commands run with fewer points, voxels and pixels than on the page (LIMITS), because their work grows with them. Each line of a text block must be part of a line that one of these programs prints; a line of ... stands for others.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# What the Python code of README takes for granted: the arrays of a mesh, an octahedron.
GIVEN = """import numpy
points = numpy.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
faces = numpy.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
"""

COARSER = 2  # factor by which voxel sizes grow
LIMITS = {"count": 300, "rate": 200, "dim": 64, "width": 64, "height": 64, "smooth": 0, "duration": 0.3}
# Actions that are always given a size, the option, its limit, and the options that determine the size as well.
SIZED = (("mesh2ls|union", "dim", 28, "voxel="), ("lic|shade|slice|splat", "width", 64, "over="))


def blocks(text, language):
    """Returns the code blocks in a language."""
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def commands(text):
    """Yields each command in the page's shell blocks, including its continuation lines."""
    for block in blocks(text, "sh"):
        for command in re.findall(r"(?:.*\\\n)*.*\n", block):
            if re.match(r"(?:\w+ [^|]*\| )?curlew ", command):
                yield command
            elif command.startswith("python3 -c "):
                yield "/usr/bin/" + command  # Debian's, which has NumPy
            elif command.startswith(("vdb_render ", "vdb_print ")):
                if shutil.which(command.split()[0]):
                    yield command
                else:
                    print(f"skipped: there is no {command.split()[0]} here (apt-get install libopenvdb-tools)")


def reduced(command):
    """Returns the command with options within LIMITS and SIZED, and larger voxels."""

    def within(limit):
        return lambda option: f"{option[1]}={min(float(option[2]), limit or LIMITS[option[1]]):g}"

    def sized(action, size, limit, others):
        words = re.sub(rf"\b({size})=([0-9][0-9.e+]*)", within(limit), action[0])
        return words if re.search(f"{size}=|{others}", words) else words.replace(action[1], f"{action[1]} {size}={limit}", 1)

    command = re.sub(r"\bvoxel=([0-9][0-9.]*)", lambda size: f"voxel={COARSER * float(size[1]):g}", command)
    command = re.sub(rf"\b({'|'.join(LIMITS)})=([0-9][0-9.e+]*)", within(None), command)
    for actions, *size in SIZED:
        command = re.sub(rf"(?<= )(-(?:{actions}))\b(?: (?!-[a-z]).*?)?(?= -[a-z]|$)", lambda action: sized(action, *size), command,
                         flags=re.MULTILINE)
    return command


def script(text):
    """Returns the page's Python blocks, except those for Blender, as one script."""
    return "\n".join(block for block in blocks(text, "python") if not re.search(r"^import bpy", block, re.MULTILINE))


def missing(text, printed):
    """Returns the lines of the page's text blocks that are not part of a printed line."""
    shown = [line.strip() for block in blocks(text, "text") for line in block.splitlines()]
    return [line for line in shown if line not in ("", "...") and not any(line in other for other in printed)]


def main(page, curlew, library=None):
    text = Path(page).read_text()
    found = list(commands(text))
    if not found:
        return f"{page} has no commands"
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "scenes").symlink_to(ROOT / "scenes")
        environment = {**os.environ, "PATH": f"{Path(curlew).resolve().parent}:{os.environ['PATH']}"}
        program, printed = script(text), []
        if library:
            environment.update(CURLEW_LIBRARY=library, PYTHONPATH=str(ROOT / "plugin/python"), PYTHONDONTWRITEBYTECODE="1")
        if library and program:
            run = subprocess.run(["/usr/bin/python3", "-c", (GIVEN if Path(page).name == "README.md" else "") + program], cwd=folder, env=environment, capture_output=True, text=True)
            if run.returncode != 0:
                return f"the Python of {page} ended with {run.returncode}:\n{run.stderr}"
            print(run.stdout, end="")
            printed += (run.stdout + run.stderr).splitlines()
        for command in found:
            run = subprocess.run(["bash", "-o", "pipefail", "-c", reduced(command)], cwd=folder, env=environment, capture_output=True, text=True)
            if run.returncode != 0:
                return f"{reduced(command)}ended with {run.returncode}:\n{run.stderr}"
            print(reduced(command).splitlines()[0], *(line for line in run.stderr.splitlines() if "warning" in line), sep="\n    ")
            printed += (run.stdout + run.stderr).splitlines()
    return "\n".join(f"{page} shows a line that nothing prints: {line}" for line in missing(text, printed)) or 0


sys.exit(main(*sys.argv[1:]))
