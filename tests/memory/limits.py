# SPDX-License-Identifier: Apache-2.0
"""Runs commands with too little address space (ulimit -v): limits.py COMMAND ROOT.

Each must work, or fail with exit code 1, one line that starts with "curlew: ", and no file left behind. Finds for each
command the least limit with which it works, and then tries limits just below, where memory ends late. Also tries limits where memory
ends while the command starts. With still less, libraries end the program before the command begins. Skipped with Debian's shared
OpenVDB: its log4cplus starts threads then, and ends the program if there is no memory for them.
"""

import os
import resource
import subprocess
import sys
import tempfile
from bisect import bisect_left
from pathlib import Path

MIB = 1 << 20
ROOM, LITTLE = 180, 100  # MiB beyond what the command needs to begin: enough for all cases (Embree 4 takes 160), and not for MANY
FLOW = "-noise -noise seed=1 -dfvn speed=1 "
MESH = "-read {root}/scenes/spot.obj "
COARSE = "-read coarse.ply "
PREPARE = (FLOW + "-velocity dim=48 -write given.vdb", MESH + "-mesh2ls dim=20 -ls2mesh -write coarse.ply")
CASES = {
    "mesh2ls": MESH + "-mesh2ls dim=90 -write out.vdb",
    "ls2mesh": MESH + "-mesh2ls dim=48 -ls2mesh adaptivity=0 -write out.ply",
    "advectLevelSet": FLOW + MESH + "-mesh2ls dim=18 -advectLevelSet duration=0.02 -write out.vdb",
    "union": COARSE + "-mesh2ls dim=24 " + COARSE + "-move translate=0.2,0,0 -mesh2ls dim=24 -union -write out.vdb",
    "velocity": FLOW + "-velocity dim=60 staggered=1 -write codec=zip out.vdb",
    "flow of a grid": FLOW + "-velocity dim=24 -flow exact=1 -scatter count=1e3 -advect steps=2 -write out.vdb",
    "points": "-scatter count=2e5 box=-1,-1,-1,1,1,1 -write out.vdb",
    "shade": MESH + "-shade width=100 -write out.png",
    "picture": FLOW + "-lic width=160 -write out.exr",
    "read": "-read given.vdb -write out.vdb",
}
# More points than fit into LITTLE, in one piece.
MANY = "-scatter count=4e6 box=-1,-1,-1,1,1,1 part=each/{} -write p.$P.vdb"
SHARES = (0.95, 0.8)


def limited(words, folder, limit):
    """Runs a program with a limit in MiB."""

    def limit_process():
        resource.setrlimit(resource.RLIMIT_AS, (limit * MIB, limit * MIB))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    # The limit is one of address space, of which glibc takes 64 MiB for each arena, and how many it makes depends on chance.
    environment = {**os.environ, "MALLOC_ARENA_MAX": "1"}
    return subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=60, preexec_fn=limit_process, env=environment)


def run(command, arguments, folder, limit):
    """Runs the command with a limit in MiB. Returns whether it worked, and what is wrong."""
    before = set(os.listdir(folder))
    done = limited([command, "-quiet", "-threads", "2", *arguments.split()], folder, limit)
    left = set(os.listdir(folder)) - before
    for name in left:
        (Path(folder) / name).unlink()
    lines = done.stderr.strip().splitlines()
    if done.returncode == 0:
        return True, ""
    if done.returncode != 1:
        return False, f"exit code {done.returncode}: {done.stderr.strip()[:200]}"
    if len(lines) != 1 or not lines[0].startswith("curlew: "):
        return False, f"not one line: {done.stderr.strip()[:300]}"
    return False, f"left {', '.join(sorted(left))}" if left else ""


def main(command, root):
    if "libopenvdb" in subprocess.run(["ldd", command], capture_output=True, text=True, check=True).stdout:
        print("skipped: links the shared OpenVDB; ./dev test links it statically")
        return 77
    wrong = []
    with tempfile.TemporaryDirectory() as folder:
        for arguments in PREPARE:
            subprocess.run([command, "-quiet", *arguments.format(root=root).split()], cwd=folder, check=True)
        # One MiB more, as the addresses of libraries vary from run to run.
        begins = 1 + bisect_left(range(1000), True, key=lambda limit: limited([command, "-v"], folder, limit).returncode in (0, 1))
        most = begins + ROOM
        for limit in range(begins, begins + 10):
            problem = run(command, CASES["velocity"], folder, limit)[1]
            if problem:
                wrong.append(f"the start with {limit} MiB: {problem}")
        for parts, fits in (1, False), (20, True):
            works, problem = run(command, MANY.format(parts), folder, begins + LITTLE)
            if works != fits or problem:
                wrong.append(f"4e6 points in {parts} parts with {begins + LITTLE} MiB: {problem or f'works: {works}'}")
        for name, arguments in CASES.items():
            tried = []

            def attempt(limit):
                works, problem = run(command, arguments.format(root=root), folder, limit)
                tried.append(limit)
                if problem:
                    wrong.append(f"{name} with {limit} MiB: {problem}")
                return works

            if not attempt(most):
                wrong.append(f"{name} does not work with {most} MiB")
                continue
            low, high = begins, most
            while high - low > 30:
                middle = (low + high) // 2
                low, high = (low, middle) if attempt(middle) else (middle, high)
            for share in SHARES:
                attempt(max(int(share * high), begins))
            print(f"{name}: works with {high} MiB; tried {len(tried)} limits", flush=True)
    return "\n".join(wrong) or 0


sys.exit(main(*sys.argv[1:]))
