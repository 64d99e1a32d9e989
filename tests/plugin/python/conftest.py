# SPDX-License-Identifier: Apache-2.0
"""Shared code of the package's tests."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

PACKAGE = str(Path(__file__).resolve().parents[3] / "plugin/python")
sys.path.insert(0, PACKAGE)
os.environ["PYTHONPATH"] = PACKAGE  # for the programs that tests run

import curlew  # noqa: E402  # needs the path above

FLOW = "noise frequency=2\nnoise frequency=2 seed=1\ndfvn speed=1\n"


@pytest.fixture
def session():
    with curlew.Session() as opened:
        yield opened


@pytest.fixture
def command(tmp_path):
    """Returns a function that runs the command in a temporary folder and returns this folder."""
    if "CURLEW_COMMAND" not in os.environ:
        pytest.skip("CURLEW_COMMAND does not say where the command is")

    def run(*arguments: str) -> Path:
        subprocess.run([os.environ["CURLEW_COMMAND"], "-quiet", *arguments], cwd=tmp_path, check=True)
        return tmp_path

    return run


def octahedron(radius: float = 0.5):
    """Returns the points and triangles of an octahedron."""
    points = radius * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    return points, np.array(faces)
