# SPDX-License-Identifier: Apache-2.0
"""A custom scene: evaluates its flow at an array of positions, reads its streamlines, and writes a picture."""

import numpy as np

import curlew

SCENE = """
torus radius=0.7 tube=0.3
noise frequency=2 seed=1
surface speed=1 extent=0.1 as=wind
slice axis=y show=speed width=400
write speed.png
torus radius=0.7 tube=0.3
scatter count=200 seed=3
trace maxLength=2 as=threads
"""

with curlew.Program(SCENE, name="my scene").run() as session:
    flow, curves = session.flow("wind"), session.curves("threads")

# A flow can be evaluated at any positions. Its potentials f and g are constant along each curve.
velocity, fields = flow.velocity_and_fields(curves.vertices)
starts = np.repeat(fields[curves.offsets[:-1]], np.diff(curves.offsets), axis=0)
print(f"{len(curves)} curves of {len(curves.vertices)} vertices, {curves.closed.sum()} of them closed")
print(f"fastest: {np.linalg.norm(velocity, axis=1).max():.3g}; f and g leave their values by {abs(fields - starts).max():.1e}")
np.savetxt("curves.csv", curves.vertices, delimiter=",", header="x,y,z", comments="")
