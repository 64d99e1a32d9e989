# SPDX-License-Identifier: Apache-2.0
"""A graph that is edited while its session stays open: only the nodes that depend on the edit are evaluated again."""

import time

import numpy as np

import curlew

# A cube with edge length 1, as a host program would provide it.
points = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) - 0.5
faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def node(name: str, action: str, words: tuple = (), inputs: dict = {}, **options: object) -> dict:
    """Returns a node of a graph. Its inputs are the names of other nodes."""
    return {"name": name, "action": action, "words": list(words), "inputs": inputs, "options": options}


swirl = node("swirl", "noise", frequency=2, seed=1)
graph = {
    "curlew": 1,
    "nodes": [
        node("cube", "read", ["cube.ply"]),
        node("hull", "mesh2ls", inputs={"mesh": "cube"}, dim=96),
        swirl,
        node("drift", "noise", frequency=1, seed=2),
        node("along", "bound", inputs={"noise": "drift", "wall": "hull"}, side="outside", layer=0.2),
        node("wind", "dfvn", inputs={"f": "swirl", "g": "along"}, speed=1),
        node("seeds", "scatter", inputs={"domain": "wind"}, count=2000),
        node("dust", "advect", inputs={"flow": "wind", "points": "seeds"}, duration=0.5, steps=10),
    ],
    "wanted": ["dust"],
}

frames = []
with curlew.Session() as session:
    session.provide_mesh("cube.ply", points, faces)
    for frequency in (2, 2.5, 3):
        swirl["options"]["frequency"] = frequency  # as if a slider were dragged
        began = time.perf_counter()
        session.run_graph(graph)
        print(f"frequency {frequency}: {', '.join(session.evaluated)} in {1000 * (time.perf_counter() - began):.0f} ms")
        frames.append(session.points("dust").positions)

    # Values that do not depend on the edit are kept. Reads the level set as an array.
    hull = session.grid("hull")
    print(f"{hull.name}: {hull.grid_class} of {hull.array().shape} voxels, {sum(leaf.active.sum() for leaf in hull.leaves())} active")

np.save("dust.npy", np.array(frames))
print(curlew.translate(graph, "scene"))
