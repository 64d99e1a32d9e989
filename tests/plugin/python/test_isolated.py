# SPDX-License-Identifier: Apache-2.0
"""Point files are read by a child process (CURLEW_READER): its crash is an error of the file, not the end of the host."""

import os
import signal

import pytest

import curlew

WRITE = "scatter count=50 box=-1,-1,-1,1,1,1\nwrite points.vdb\n"


@pytest.fixture
def points(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with curlew.Session() as session:
        session.run(WRITE)
    return "read points.vdb\n"


@pytest.mark.parametrize("death", [signal.SIGSEGV, signal.SIGABRT, signal.SIGKILL])
def test_a_crash_of_the_reader_is_an_error(points, tmp_path, monkeypatch, death):
    reader = tmp_path / "reader"
    reader.write_text(f"#!/bin/sh\nkill -{int(death)} $$\n")
    reader.chmod(0o700)
    with curlew.Session() as session:
        monkeypatch.setenv("CURLEW_READER", str(reader))
        with pytest.raises(curlew.Error, match="points.vdb"):
            session.run(points)
        monkeypatch.setenv("CURLEW_READER", "")  # reads in this process
        session.run(points)  # the session goes on
        assert len(session.points().positions) == 50


def test_a_damaged_file_is_an_error(points, tmp_path):
    whole = (tmp_path / "points.vdb").read_bytes()
    with curlew.Session() as session:
        for size in range(200, len(whole), len(whole) // 12):
            (tmp_path / "points.vdb").write_bytes(whole[:size])
            with pytest.raises(curlew.Error):
                session.run(points)
        with pytest.raises(ChildProcessError):  # no child is left
            os.waitpid(-1, os.WNOHANG)
