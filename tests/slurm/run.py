# SPDX-License-Identifier: Apache-2.0
"""Runs scenes/slurm on a real Slurm of one node, which listens on this machine only: run.py COMMAND ROOT.

Every frame of an array, of a chain of jobs with state, and of a job that is killed and queued again must have the same bytes as in
one process. The three run at once, on a node that claims enough processors for them, because Slurm waits for seconds in each. Exits
with 77 (skipped) if Slurm or MUNGE is not installed, or does not start.
"""

import contextlib
import getpass
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "scontrol")
CONFIGURATION = """ClusterName=curlew
SlurmctldHost={host}(127.0.0.1)
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
SlurmctldPort={port}
SlurmdPort={second_port}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
SchedulerParameters=batch_sched_delay=0,sched_min_interval=0,bf_interval=1
SlurmdParameters=config_overrides
NodeName={host} NodeAddr=127.0.0.1 CPUs=8 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""
FLOW = "noise frequency=2 'alpha={T}'\nnoise frequency=2 seed=1\nbound\ndfvn speed=1\n"
SCENES = {
    "before.txt": "sphere\n",
    "grids.txt": FLOW + "velocity dim=20\nwrite 'out/v.$F.vdb'\n",
    "points.txt": FLOW + "emit rate=20000 life=2 box=-0.2,-0.2,-0.2,0.2,0.2,0.2\nadvect accuracy=1e-5\nwrite 'out/p.$F.ply'\n",
}
FRAMES, LAST = "1-16", 16


def run(*words, cwd=None):
    """Returns the output of a program."""
    done = subprocess.run([str(word) for word in words], cwd=cwd, capture_output=True, text=True, timeout=60)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, words))}: {done.stderr}{done.stdout}")
    return done.stdout.strip()


def wait(until, what, seconds=60):
    """Waits for a condition."""
    deadline = time.monotonic() + seconds
    while not until():
        if time.monotonic() > deadline:
            raise RuntimeError(f"waited for {seconds} s: {what}")
        time.sleep(0.05)


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


@contextlib.contextmanager
def cluster(folder):
    """A Slurm of one node, while the context lasts."""
    for name in ("state", "spool"):
        (folder / name).mkdir()
    key = folder / "munge.key"
    key.write_bytes(os.urandom(1024))
    key.chmod(0o600)
    if int(run("slurmd", "-V").split()[1].split(".")[0]) >= 24:  # needs /sys/fs/cgroup otherwise; Slurm 22 does not know this setting
        (folder / "cgroup.conf").write_text("CgroupPlugin=disabled\n")
    configuration = folder / "slurm.conf"
    configuration.write_text(CONFIGURATION.format(host=socket.gethostname().split(".")[0], user=getpass.getuser(), folder=folder,
                                                  port=free_port(), second_port=free_port()))
    os.environ["SLURM_CONF"] = str(configuration)
    started = []
    try:
        for words in (["munged", "--foreground", "--force", f"--key-file={key}", f"--socket={folder}/munge.socket",
                       f"--pid-file={folder}/munged.pid", f"--log-file={folder}/munged.log", f"--seed-file={folder}/munged.seed"],
                      ["slurmctld", "-D"], ["slurmd", "-D"]):
            started.append(subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
            if words[0] == "munged":
                wait((folder / "munge.socket").exists, "munged")

        def idle():
            for process in started:
                if process.poll() is not None:
                    raise RuntimeError(f"{process.args[0]} has ended")
            return "idle" in subprocess.run(["sinfo", "-h", "-o", "%T"], capture_output=True, text=True).stdout

        wait(idle, "the node is idle")
        yield
    finally:
        subprocess.run(["scancel", "--user", getpass.getuser()], capture_output=True)
        for process in reversed(started):
            process.terminate()
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def state_of(job, field="JobState"):
    """Returns a field of a job, or of each task of an array."""
    words = run("scontrol", "--oneliner", "show", "job", job).split()
    return {word.partition("=")[2] for word in words if word.startswith(field + "=")}


def finished(job, folder):
    wait(lambda: not state_of(job) & {"PENDING", "RUNNING", "COMPLETING", "CONFIGURING"}, f"job {job} ends")
    if state_of(job) != {"COMPLETED"}:
        raise RuntimeError(f"job {job}: {state_of(job)}: " + "".join(log.read_text() for log in folder.glob("out/*.log")))


def files_of(folder):
    """Returns the files of the frames by name."""
    return {path.name: path.read_bytes() for path in folder.glob("out/*") if path.suffix in (".vdb", ".ply")}


def one_process(command, scene):
    """Returns a case that makes all frames of a scene in one process."""
    return lambda folder, scripts: run(command, "-quiet", "-config", "before.txt", "-frames", FRAMES, "-config", scene, cwd=folder)


def array(folder, scripts):
    """Independent frames, divided among the tasks of an array."""
    job = run("sbatch", "--parsable", "--array=1-3", scripts / "frames.sbatch", FRAMES, "before.txt", "grids.txt", cwd=folder)
    finished(job, folder)


def chain(folder, scripts):
    """Points that persist, in jobs that run one after the other."""
    jobs = run(scripts / "chain.sh", FRAMES, 3, "before.txt", "points.txt", cwd=folder).split()
    if len(jobs) != 3:
        raise RuntimeError(f"chain.sh has printed {jobs}")
    for job in jobs:
        finished(job, folder)


def requeued(folder, scripts):
    """Kills the job after its third frame. Slurm would start it again after two minutes."""
    job = run("sbatch", "--parsable", scripts / "sequence.sbatch", FRAMES, "before.txt", "points.txt", cwd=folder)
    wait((folder / "out/p.3.ply").exists, "frame 3")
    run("scontrol", "requeue", job)
    if (folder / f"out/p.{LAST}.ply").exists():
        raise RuntimeError("the job has ended before it was killed")
    wait(lambda: state_of(job) == {"PENDING"} and state_of(job, "Reason") == {"BeginTime"}, "the job is queued again")
    time.sleep(2)  # in the second in which the job was killed, Slurm would take the new credential for the revoked one, and end it
    run("scontrol", "update", f"JobId={job}", "StartTime=now")
    finished(job, folder)


def files_from(case, top, scripts):
    """Runs a case in its own folder, and returns the files."""
    folder = Path(tempfile.mkdtemp(dir=top))
    (folder / "out").mkdir()
    for name, text in SCENES.items():
        (folder / name).write_text(text)
    case(folder, scripts)
    return files_of(folder)


def main(command, root):
    if any(shutil.which(program) is None for program in PROGRAMS):
        print("skipped: there is no Slurm here (apt-get install slurm-wlm munge)")
        return 77
    os.environ["CURLEW"] = command
    wrong = []
    with contextlib.ExitStack() as stack:
        top = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="slurm")))
        try:
            stack.enter_context(cluster(top))
        except RuntimeError as error:
            print(f"skipped: Slurm does not start here: {error}")
            return 77
        scripts = Path(root) / "scenes/slurm"
        grids, points = (files_from(one_process(command, scene), top, scripts) for scene in ("grids.txt", "points.txt"))
        pool = stack.enter_context(ThreadPoolExecutor())
        running = [(case, files, pool.submit(files_from, case, top, scripts))
                   for case, files in ((array, grids), (chain, points), (requeued, points))]
        for case, files, future in running:
            try:
                made = future.result()
                if len(files) != LAST or made != files:
                    wrong.append(f"{case.__name__}: other files than those of one process: {sorted(made)}")
            except (RuntimeError, subprocess.TimeoutExpired) as error:
                wrong.append(f"{case.__name__}: {error}")
            print(case.__name__, "done", flush=True)
        if wrong:
            print((top / "slurmctld.log").read_text()[-3000:])
    return "\n".join(wrong) or 0


sys.exit(main(*sys.argv[1:]))
