# SPDX-License-Identifier: Apache-2.0
"""Particles around a mesh in memory: they follow the flow, frame by frame, and never enter the mesh."""

import numpy as np

import curlew

# A cube with edge length 1, as a host program would provide it.
points = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) - 0.5
faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]

SCENE = """
read cube.ply
mesh2ls dim=48
noise frequency=1.5 seed=1
noise frequency=1.5 seed=2
bound layer=0.2 side=outside
dfvn speed=1
scatter count=5000
frames 1-12 substeps=4
advect as=dust
"""

frames = []


def keep(frame: int, session: curlew.Session) -> None:
    """Stores the positions as an array at the end of each frame."""
    frames.append(session.points("dust").positions)


def show(title: str, fraction: float) -> bool:
    """Called repeatedly. Returning True would cancel the program."""
    return False


with curlew.Session() as session:
    session.provide_mesh("cube.ply", points, faces)
    session.run(SCENE, progress=show, on_frame=keep)
    report = session.report()["advect"]

np.save("particles.npy", np.array(frames))
inside = int((np.abs(frames) < 0.49).all(axis=-1).sum())
print(f"particles.npy: {len(frames)} frames of {len(frames[0])} particles, {inside} of them inside the cube")
print(f"largest error of f and g, relative: {report['residual_f']:.1e}, {report['residual_g']:.1e}")
