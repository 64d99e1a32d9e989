# SPDX-License-Identifier: Apache-2.0
"""Runs every command of a page that begins with curlew, in a fresh folder, as a reader would: run.py PAGE COMMAND."""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def commands(text):
    """Each command of the page's shell blocks, its continued lines joined by the shell."""
    for block in re.findall(r"^```sh\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        for command in re.findall(r"(?:.*\\\n)*.*\n", block):
            if command.startswith("curlew "):
                yield command


def main(page, curlew):
    found = list(commands(Path(page).read_text()))
    if not found:
        return f"{page} has no commands"
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "scenes").symlink_to(ROOT / "scenes")
        path = f"{Path(curlew).resolve().parent}:{os.environ['PATH']}"
        for command in found:
            run = subprocess.run(["bash", "-c", command], cwd=folder, env={**os.environ, "PATH": path}, capture_output=True, text=True)
            if run.returncode != 0:
                return f"{command}ended with {run.returncode}:\n{run.stderr}"
            print(command.splitlines()[0], *(line for line in run.stderr.splitlines() if "warning" in line), sep="\n    ")
    return 0


sys.exit(main(*sys.argv[1:]))
