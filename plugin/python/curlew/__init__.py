"""Curlew: divergence-free vector noise, and what follows it, for Python.

    import curlew

    with curlew.Session() as session:
        session.provide_mesh("monkey.ply", points, faces)
        session.run('''
            read monkey.ply
            mesh2ls dim=64
            noise frequency=2
            noise frequency=2 seed=1
            bound width=0.2 side=outside
            dfvn speed=1
            scatter count=1e5
            advect time=1
        ''')
        moved = session.points().positions

A program is the text of a scene: one action a line. `curlew -help` and registry() tell what there is. The library is
loaded when it is first needed; see find_library().
"""

from ._library import Cancelled, Error, find_library
from ._objects import Curves, Field, Flow, Image, Mesh, Points
from ._session import Session
from ._shortcuts import Program, advect, registry, velocity_grid, version

__all__ = [
    "Cancelled",
    "Curves",
    "Error",
    "Field",
    "Flow",
    "Image",
    "Mesh",
    "Points",
    "Program",
    "Session",
    "advect",
    "find_library",
    "registry",
    "velocity_grid",
    "version",
]
