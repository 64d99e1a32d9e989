# SPDX-License-Identifier: Apache-2.0
"""Point files are read by a child process (CURLEW_READER): its crash is an error of the file, not the end of the host."""

import os
import signal
import subprocess
import sys

import pytest

import curlew

WRITE = "scatter count=50 box=-1,-1,-1,1,1,1\nwrite points.vdb\n"

# The library looks for the reader process once.
HOST = """
import curlew
with curlew.Session() as session:
    try:
        session.run("read points.vdb")
    except curlew.Error as error:
        print(error)
    curlew.read_isolated(False)
    session.run("read points.vdb")
    print(len(session.points().positions))
"""


@pytest.fixture
def points(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with curlew.Session() as session:
        session.run(WRITE)
    return tmp_path / "points.vdb"


@pytest.mark.parametrize("death", [signal.SIGSEGV, signal.SIGABRT, signal.SIGKILL])
def test_a_crash_of_the_reader_is_an_error(points, tmp_path, death):
    reader = tmp_path / "reader"
    reader.write_text(f"#!/bin/sh\nkill -{int(death)} $$\n")
    reader.chmod(0o700)
    path = os.pathsep.join(p for p in sys.path if p)
    done = subprocess.run([sys.executable, "-c", HOST], env={**os.environ, "CURLEW_READER": str(reader), "PYTHONPATH": path},
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    first, second = done.stdout.splitlines()
    assert "points.vdb" in first and f"signal {int(death)}" in first
    assert second == "50"


def test_a_damaged_file_is_an_error(points):
    whole = points.read_bytes()
    with curlew.Session() as session:
        for size in range(200, len(whole), len(whole) // 12):
            points.write_bytes(whole[:size])
            with pytest.raises(curlew.Error):
                session.run("read points.vdb\n")
        with pytest.raises(ChildProcessError):  # no child is left
            os.waitpid(-1, os.WNOHANG)
