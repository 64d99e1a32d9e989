# SPDX-License-Identifier: Apache-2.0
"""Checks that large jobs use huge pages: huge_pages.py COMMAND.

Counts page faults: a huge page takes one where small pages take 512. Skipped where Linux provides no huge pages.
"""

import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SETTING = Path("/sys/kernel/mm/transparent_hugepage/enabled")
VARIABLE = "GLIBC_TUNABLES"
# A grid of 100 MB on one thread, and a file name that a shell would change.
NAME = "a 'b'  c&.png"
FLOW = ["-quiet", "-threads", "1", "-noise", "-noise", "seed=1", "-dfvn"]
JOB = [*FLOW, "-slice", "width=20", "-write", NAME, "-velocity", "dim=200"]
SMALL = [*FLOW, "-velocity", "dim=32"]


def plain():
    """Returns the environment without the variable."""
    return {name: value for name, value in os.environ.items() if name != VARIABLE}


def linker_of(command):
    """Returns the dynamic linker of a program."""
    libraries = subprocess.run(["ldd", command], capture_output=True, text=True, check=True).stdout
    return re.search(r"(/\S*/ld-linux\S*)", libraries)[1]


def faults(command, arguments, folder, **variables):
    """Returns the page faults of a run of the command."""
    environment = plain() | variables
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_minflt
    subprocess.run([command, *arguments], cwd=folder, env=environment, check=True)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_minflt - before


def environment_of(folder):
    """Returns the environment of a process; nothing while it is starting a program."""
    try:
        return (folder / "environ").read_bytes()
    except ProcessLookupError:
        return b""


def names_of_running(command):
    """Starts a command that waits for its input. Returns the name of its process, and the program that runs."""
    with subprocess.Popen([command, "-quiet", "-read", "-", "format=vdb"], env=plain(), stdin=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        folder = Path("/proc", str(process.pid))
        for _ in range(200):
            if VARIABLE.encode() in environment_of(folder):
                break
            time.sleep(0.05)
        else:
            raise SystemExit("the variable is not in the environment of the process")
        return (folder / "comm").read_text().strip(), os.readlink(folder / "exe")


def main(command):
    mode = re.search(r"\[(\w+)\]", SETTING.read_text())[1] if SETTING.exists() else "never"
    if mode == "never":
        print("skipped: the system provides no huge pages")
        return 77
    wrong = []
    with tempfile.TemporaryDirectory() as folder:
        huge = faults(command, JOB, folder) - faults(command, SMALL, folder)
        if huge > 100e6 / 4096 / 2:
            wrong.append(f"{huge:.0f} page faults for 100 MB")
        if sorted(os.listdir(folder)) != [NAME]:
            wrong.append(f"arguments were changed: wrote {os.listdir(folder)}")
        if mode == "madvise":
            # A value of the user's, here one that asks for no huge pages, is kept.
            small = faults(command, JOB, folder, **{VARIABLE: "glibc.malloc.hugetlb=0"}) - faults(command, SMALL, folder)
            print(f"page faults beyond those of a small job: {huge}, with small pages {small}")
            if small < 100e6 / 4096 / 2:
                wrong.append(f"only {small:.0f} page faults for 100 MB with small pages")
            other = Path(folder, "other_name")
            other.symlink_to(command)
            if (names := names_of_running(other)) != (other.name, os.path.realpath(command)):
                wrong.append(f"the process has another name or program: {names}")
            # The system starts the dynamic linker, and that the command. The arguments are those of the linker.
            linked = subprocess.run([linker_of(command), command, "-sphere", "-print"], env=plain(), capture_output=True, text=True, check=False)
            if "field 0: -sphere" not in linked.stdout:
                wrong.append(f"started by the dynamic linker: {linked.stdout}{linked.stderr}")
    return "\n".join(wrong) or 0


sys.exit(main(*sys.argv[1:]))
