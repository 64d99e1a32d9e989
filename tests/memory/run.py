# SPDX-License-Identifier: Apache-2.0
"""Compares the memory that actions estimate before they start with the memory that they use: run.py COMMAND ROOT.

Prints a table. An estimate counts as wrong if it differs from the measured peak by more than a factor of 1.5. Both are
relative to the memory in use before the first estimate.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

FACTOR = 1.5
FLOW = "-noise -noise seed=1 -dfvn speed=1 "
MESH = "-read {root}/scenes/spot.obj "
POINTS = "-scatter count=7e5 box=-1,-1,-1,1,1,1 "
FEWER = "-scatter count=4e5 box=-1,-1,-1,1,1,1 "
PREPARE = {
    "points.vdb": POINTS + "-write points.vdb",
    "points.ply": POINTS + "-write points.ply",
    "points.csv": "-scatter count=6e5 box=-1,-1,-1,1,1,1 -write points.csv",
    "points.bgeo": POINTS + "-write points.bgeo",
    "mesh.ply": MESH + "-mesh2ls dim=250 -ls2mesh adaptivity=0 -write mesh.ply mesh.obj",
    "velocity.vdb": FLOW + "-velocity dim=150 -write velocity.vdb velocity.nvdb",
    "image.exr": "-noise -slice width=1000 -write image.exr image.png",
    "small.png": "-noise -slice width=280 -write small.png",
}
CASES = {
    "mesh2ls": MESH + "-mesh2ls dim=200",
    "mesh2ls, wide band": MESH + "-mesh2ls dim=60 halfWidth=20",
    "velocity": FLOW + "-velocity dim=140",
    "velocity, staggered": FLOW + "-velocity dim=140 staggered=1",
    "velocity, density and potentials": FLOW + "-velocity dim=120 density=1 potentials=1",
    "scatter": POINTS,
    "jitter": "-jitter count=3e5",
    "advect with pathlines": FLOW + "-scatter count=15000 -advect steps=100 pathlines=1",
    "trace": FLOW + "-scatter count=12000 -trace maxLength=2",
    "ls2mesh": MESH + "-mesh2ls dim=190 -ls2mesh",
    "spacing": FEWER + "-spacing",
    "read points.vdb": "-read points.vdb",
    "read points.ply": "-read points.ply",
    "read points.csv": "-read points.csv",
    "slice": "-noise -slice width=1800",
    "splat": FEWER + "-splat width=1600 height=1200",
    "spectrum": FLOW + "-velocity dim=90 -spectrum",
    "advectGrid": FLOW + "-sphere radius=0.5 -velocity dim=64 -advectGrid grid=0 duration=0.1",
    "advect": FLOW + POINTS + "-advect steps=1",
    "advectLevelSet": FLOW + MESH + "-mesh2ls dim=40 -advectLevelSet duration=0.02",
    "advectLevelSet by WENO5": FLOW + MESH + "-mesh2ls dim=110 -advectLevelSet duration=0.001 method=weno5",
    "union": MESH + "-mesh2ls dim=44 " + MESH + "-move translate=0.2,0,0 -mesh2ls dim=44 -union",
    "bake": "-noise -bake dim=250 box=-1,-1,-1,1,1,1",
    "field of a grid": "-noise -bake dim=200 box=-1,-1,-1,1,1,1 -field -slice width=50",
    "flow of a grid": FLOW + "-velocity dim=36 -flow exact=1 -slice width=30",
    "velocity displaced by a wall": "-frames 1-1 -sphere radius=0.4 translate={{T}},0,0 -noise -noise seed=2 "
                                    "-bound side=outside -dfvn speed=0.2 padding=0.6 -velocity dim=48 "
                                    "displaced=potential",
    "snap": MESH + "-mesh2ls dim=80 -scatter count=7e4 on=surface -snap",
    "check": FLOW + "-check samples=4e5",
    "lic": FLOW + "-lic width=700 streakLength=5",
    "warp": "-read small.png -noise dimensions=2 -dfvn -warp",
    "shade": MESH + "-shade width=900 height=600 -write out.png",
    "emit": "-frames 1-2 -emit rate=1.6e7 box=-1,-1,-1,1,1,1",
    "distance": POINTS + POINTS + "-distance",
    "mesh2ls of many faces": "-read mesh.ply -mesh2ls dim=200",
    "shade of many faces": "-read mesh.ply -shade width=400",
    "read mesh.ply": "-read mesh.ply",
    "read mesh.obj": "-read mesh.obj",
    "read velocity.vdb": "-read velocity.vdb",
    "read velocity.nvdb": "-read velocity.nvdb",
    "read image.exr": "-read image.exr",
    "read image.png": "-read image.png",
    "read points.bgeo": "-read points.bgeo",
    "write points.vdb": POINTS + "-write out.vdb",
    "write points.npz": POINTS + "-write out.npz",
    "write velocity.nvdb": FLOW + "-velocity dim=150 -write out.nvdb",
    "write image.exr": "-noise -slice width=1000 -write out.exr",
    "write image.png": "-noise -slice width=1000 -write out.png",
    "write points.npy": POINTS + "-write out.npy",
}


def peak(command, arguments, folder):
    """Returns the peak resident memory of the command, in bytes; or None and its message if it fails."""
    log = Path(folder) / "log"
    with open(log, "wb") as errors:
        process = subprocess.Popen([command, "-quiet", *arguments.split()], cwd=folder, stderr=errors)
        status, usage = os.wait4(process.pid, 0)[1:]
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        return None, log.read_text().strip()
    return usage.ru_maxrss * 1024, ""


def main(command, root):
    wrong = []
    print(f"{'':34}{'estimate':>10}{'peak':>10}   MB")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["CURLEW_READER"] = ""  # reads files in the measured process
        for arguments in PREPARE.values():
            subprocess.run([command, "-quiet", *arguments.format(root=root).split()], cwd=folder, check=True)
        for name, arguments in CASES.items():
            trace = Path(folder) / "trace"
            trace.unlink(missing_ok=True)
            os.environ["CURLEW_MEMORY_TRACE"] = str(trace)
            used, error = peak(command, arguments.format(root=root), folder)
            if used is None:
                wrong.append(f"{name}: {error}")
                continue
            asked = [tuple(map(float, line.split("\t")[:2])) for line in trace.read_text().splitlines()] if trace.exists() else []
            start = asked[0][1] if asked else 4e7
            estimate = max((bytes_ + resident - start for bytes_, resident in asked), default=0)
            ratio = estimate / (used - start)
            print(f"{name:34}{estimate / 1e6:10.0f}{(used - start) / 1e6:10.0f}{ratio:8.2f}", flush=True)
            if not 1 / FACTOR <= ratio <= FACTOR:
                wrong.append(f"{name}: the estimate is {ratio:.2f} times the peak")
    return "\n".join(wrong) or 0


sys.exit(main(*sys.argv[1:]))
