# SPDX-License-Identifier: Apache-2.0
"""Writes a flow in a sphere as a velocity grid for Blender, Houdini and others: velocity.vdb."""

import curlew

FLOW = """
sphere radius=1
noise frequency=2 octaves=2 seed=1
noise frequency=2 octaves=2 seed=2
bound layer=0.2
dfvn speed=1
"""

grid = curlew.velocity_grid("velocity.vdb", FLOW, voxel=0.05, name="velocity")
print(f"velocity.vdb: {grid['active_voxels']} voxels of {grid['voxel_size']:.3g}")
