# SPDX-License-Identifier: Apache-2.0
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
            advect time=1 as=dust
        ''')
        moved = session.points("dust").positions

A program is the text of a scene, one action a line, or a graph of nodes as a dict: Session.run_graph() evaluates only what
has changed since the run before. `curlew -help` and registry() tell what there is. The library is
loaded when it is first needed; see find_library().
"""

from ._library import Cancelled, Error, find_library
from ._objects import Curves, Field, Flow, Grid, Image, Leaf, Mesh, Points
from ._session import Session
from ._shortcuts import Program, advect, read_isolated, registry, translate, velocity_grid, version

__all__ = [
    "Cancelled",
    "Curves",
    "Error",
    "Field",
    "Flow",
    "Grid",
    "Image",
    "Leaf",
    "Mesh",
    "Points",
    "Program",
    "Session",
    "advect",
    "find_library",
    "read_isolated",
    "registry",
    "translate",
    "velocity_grid",
    "version",
]
