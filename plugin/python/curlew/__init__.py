# SPDX-License-Identifier: Apache-2.0
"""Curlew for Python: divergence-free vector noise (DFVN), and particles, curves and level sets that follow it.

    import curlew

    with curlew.Session() as session:
        session.provide_mesh("monkey.ply", points, faces)
        session.run('''
            read monkey.ply
            mesh2ls dim=64
            noise frequency=2
            noise frequency=2 seed=1
            bound layer=0.2 side=outside
            dfvn speed=1
            scatter count=1e5
            advect duration=1 as=dust
        ''')
        moved = session.points("dust").positions

A program is the text of a scene, one action per line, or a graph of nodes as a dict. Session.run_graph() only evaluates
what has changed since the previous run. `curlew -help` and registry() list the actions. The library is loaded when it
is first needed; see find_library().
"""

from ._library import Cancelled, Error, escaped, find_library
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
    "escaped",
    "find_library",
    "read_isolated",
    "registry",
    "translate",
    "velocity_grid",
    "version",
]
