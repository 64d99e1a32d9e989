#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes scenes/walker.glb: a walking figure with a skin. It is our own work, so we may distribute it.

The body is one closed surface: naive surface nets (Gibson 1998) of a smooth union of capsules, one per bone. The clips
are "walk", a cycle of 24 frames at 24 fps on the spot, and "stroll", four cycles that move 1.3 m forward each. Units
are metres, Y is up, and the figure faces +Z.
"""
import json
import math
import struct
import sys

CELL = 0.028      # cell size of the lattice for the surface, metres
SMOOTH = 0.035    # reach of the smooth union, metres
FPS = 24
CYCLE = 24        # frames
STRIDE = 1.3      # metres per cycle
STROLL = 4        # cycles

# name: (parent, joint, end, radii at the joint and at the end). In the bind pose, the arms are slightly away from the
# body.
BONES = {
    "hips":        (None,        (0, 0.95, 0), (0, 1.06, 0), 0.125, 0.115),
    "spine":       ("hips",      (0, 1.06, 0), (0, 1.25, 0), 0.115, 0.125),
    "chest":       ("spine",     (0, 1.25, 0), (0, 1.40, 0), 0.140, 0.110),
    "head":        ("chest",     (0, 1.48, 0.01), (0, 1.66, 0.03), 0.055, 0.105),
    "upper_arm.L": ("chest",     (0.145, 1.39, 0), (0.335, 1.17, 0), 0.058, 0.048),
    "forearm.L":   ("upper_arm.L", (0.335, 1.17, 0), (0.50, 0.92, 0), 0.047, 0.042),
    "thigh.L":     ("hips",      (0.10, 0.91, 0), (0.13, 0.50, 0), 0.088, 0.060),
    "shin.L":      ("thigh.L",   (0.13, 0.50, 0), (0.14, 0.11, 0), 0.056, 0.042),
    "foot.L":      ("shin.L",    (0.14, 0.08, -0.02), (0.15, 0.055, 0.15), 0.050, 0.042),
}
for left in [n for n in BONES if n.endswith(".L")]:
    parent, joint, end, a, b = BONES[left]
    flip = lambda p: (-p[0], p[1], p[2])
    BONES[left[:-1] + "R"] = (parent.replace(".L", ".R"), flip(joint), flip(end), a, b)
NAMES = list(BONES)


def capsule(bone, p):
    """Returns the approximate signed distance to the capsule of a bone."""
    _, a, b, ra, rb = BONES[bone]
    ab = [b[k] - a[k] for k in range(3)]
    ap = [p[k] - a[k] for k in range(3)]
    t = max(0.0, min(1.0, sum(ab[k] * ap[k] for k in range(3)) / sum(c * c for c in ab)))
    return math.dist(ap, [t * c for c in ab]) - (ra + t * (rb - ra))


def body(p):
    """Returns the distance to the smooth union. Arms, legs and trunk are blended separately, so that limbs do not
    merge."""
    total = 0.0
    for bone in NAMES:
        total += math.exp(min(60.0, -capsule(bone, p) / SMOOTH * 2))
    return -SMOOTH / 2 * math.log(max(total, 1e-300))


def gradient(p, h=1e-4):
    """Returns the gradient by finite differences, which are acceptable in a tool."""
    return [(body([p[j] + (h if j == k else 0) for j in range(3)]) -
             body([p[j] - (h if j == k else 0) for j in range(3)])) / (2 * h) for k in range(3)]


def surface():
    low, size = (-0.62, -0.05, -0.26), (1.24, 1.90, 0.56)
    n = [int(s / CELL) + 2 for s in size]
    at = lambda i, j, k: [low[0] + i * CELL, low[1] + j * CELL, low[2] + k * CELL]
    value = [[[body(at(i, j, k)) for k in range(n[2])] for j in range(n[1])] for i in range(n[0])]
    points, number = [], {}
    cube = [(a, b, c) for a in (0, 1) for b in (0, 1) for c in (0, 1)]
    edges = [(p, q) for p in cube for q in cube if p < q and sum(abs(x - y) for x, y in zip(p, q)) == 1]
    for i in range(n[0] - 1):
        for j in range(n[1] - 1):
            for k in range(n[2] - 1):
                cuts = []
                for p, q in edges:
                    u = value[i + p[0]][j + p[1]][k + p[2]]
                    v = value[i + q[0]][j + q[1]][k + q[2]]
                    if (u < 0) != (v < 0):
                        t = u / (u - v)
                        cuts.append([p[m] + t * (q[m] - p[m]) for m in range(3)])
                if not cuts:
                    continue
                p = at(*[(i, j, k)[m] + sum(c[m] for c in cuts) / len(cuts) for m in range(3)])
                for _ in range(3):  # project onto the surface
                    g, d = gradient(p), body(p)
                    length = sum(c * c for c in g) or 1
                    p = [p[m] - d * g[m] / length for m in range(3)]
                number[i, j, k] = len(points)
                points.append(p)
    triangles = []
    for i, j, k in [(i, j, k) for i in range(1, n[0] - 1) for j in range(1, n[1] - 1) for k in range(1, n[2] - 1)]:
        for axis in range(3):
            step = [int(axis == m) for m in range(3)]
            u, v = value[i][j][k], value[i + step[0]][j + step[1]][k + step[2]]
            if (u < 0) == (v < 0):
                continue
            b, c = [(1, 2), (2, 0), (0, 1)][axis]
            around = []
            for x, y in ((0, 0), (-1, 0), (-1, -1), (0, -1)):
                cell = [i, j, k]
                cell[b] += x
                cell[c] += y
                around.append(number[tuple(cell)])
            if v < u:
                around.reverse()
            triangles += [around[:3], [around[0], around[2], around[3]]]
    return points, triangles


def skin(p):
    """Returns up to four bones with weights that add up to 255: the nearest bone and its neighbours in the skeleton."""
    distance = {bone: capsule(bone, p) for bone in NAMES}
    nearest = min(NAMES, key=lambda bone: distance[bone])
    near = [b for b in NAMES if b == nearest or BONES[b][0] == nearest or BONES[nearest][0] == b]
    share = {b: math.exp(-(max(distance[b] - distance[nearest], 0) / 0.03)) for b in near}
    best = sorted(share, key=lambda b: (-share[b], b))[:4]
    total = sum(share[b] for b in best)
    weights = [round(255 * share[b] / total) for b in best]
    weights[0] += 255 - sum(weights)
    pad = [0] * (4 - len(best))
    return [NAMES.index(b) for b in best] + pad, weights + pad


def turn(x=0.0, y=0.0, z=0.0):
    """Returns a quaternion: rotations in degrees about y, then x, then z."""
    def about(axis, degrees):
        half = math.radians(degrees) / 2
        q = [0, 0, 0, math.cos(half)]
        q[axis] = math.sin(half)
        return q

    def times(a, b):
        return [a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1], a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
                a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3], a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]]
    return times(times(about(1, y), about(0, x)), about(2, z))


def pose(phase):
    """Returns the rotations of the bones, and the offset of the hips from the bind pose, at a phase of the cycle."""
    turns = {"hips": turn(y=4 * math.sin(phase), z=1.5 * math.sin(phase)),
             "spine": turn(x=2), "chest": turn(y=-9 * math.sin(phase)), "head": turn(y=5 * math.sin(phase))}
    for side, sign in ((".L", 1), (".R", -1)):
        p = phase if sign > 0 else phase + math.pi
        swing = 27 * math.sin(p) + 3                       # forward is positive
        knee = 8 + 50 * max(0.0, math.cos(p + 0.25)) ** 2  # most bent while the leg swings forward
        foot = -swing + knee * 0.75 - 14 * max(0.0, -math.sin(p + 0.5)) ** 2
        turns["thigh" + side] = turn(x=-swing)
        turns["shin" + side] = turn(x=knee)
        turns["foot" + side] = turn(x=-foot * 0.6)
        turns["upper_arm" + side] = turn(x=24 * math.sin(p), z=-16 * sign)
        turns["forearm" + side] = turn(x=-24 + 10 * math.sin(p))
    return turns, [0.0, -0.03 - 0.018 * math.cos(2 * phase), 0.0]


class Glb:
    def __init__(self):
        self.root = {"asset": {"version": "2.0", "generator": "Curlew tools/walker.py",
                               "copyright": "Part of Curlew, own making"}, "bufferViews": [], "accessors": []}
        self.binary = b""

    def add(self, rows, kind, code, component, **more):
        flat = [x for row in rows for x in (row if isinstance(row, (list, tuple)) else [row])]
        data = struct.pack(f"<{len(flat)}{code}", *flat)
        self.root["bufferViews"].append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)})
        self.binary += data + b"\0" * (-len(data) % 4)
        accessor = {"bufferView": len(self.root["bufferViews"]) - 1, "componentType": component, "count": len(rows), "type": kind}
        if code == "f" and kind in ("SCALAR", "VEC3"):
            columns = list(zip(*[row if isinstance(row, (list, tuple)) else [row] for row in rows]))
            single = lambda x: struct.unpack("<f", struct.pack("<f", x))[0]
            accessor |= {"min": [single(min(c)) for c in columns], "max": [single(max(c)) for c in columns]}
        self.root["accessors"].append(accessor | more)
        return len(self.root["accessors"]) - 1

    def bytes(self):
        self.root["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(self.root, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        return (struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(self.binary)) + struct.pack("<I4s", len(text), b"JSON") + text +
                struct.pack("<I4s", len(self.binary), b"BIN\0") + self.binary)


def main(path):
    points, triangles = surface()
    skins = [skin(p) for p in points]
    glb = Glb()
    attributes = {"POSITION": glb.add(points, "VEC3", "f", 5126),
                  "JOINTS_0": glb.add([s[0] for s in skins], "VEC4", "B", 5121),
                  "WEIGHTS_0": glb.add([s[1] for s in skins], "VEC4", "B", 5121, normalized=True)}
    indices = glb.add([i for t in triangles for i in t], "SCALAR", "H", 5123)
    glb.root["meshes"] = [{"name": "body", "primitives": [{"attributes": attributes, "indices": indices}]}]
    # Nodes: 0 is the body, 1 the root, then the bones.
    first = 2
    nodes = [{"name": "body", "mesh": 0, "skin": 0}, {"name": "root", "children": [first + NAMES.index("hips")]}]
    inverse = []
    for bone in NAMES:
        parent, joint = BONES[bone][:2]
        origin = BONES[parent][1] if parent else (0, 0, 0)
        node = {"name": bone, "translation": [round(joint[k] - origin[k], 6) for k in range(3)]}
        children = [first + NAMES.index(b) for b in NAMES if BONES[b][0] == bone]
        nodes.append(node | ({"children": children} if children else {}))
        inverse.append([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, *[-c for c in joint], 1])
    glb.root |= {"nodes": nodes, "scene": 0, "scenes": [{"nodes": [0, 1]}],
                 "skins": [{"joints": [first + k for k in range(len(NAMES))], "skeleton": 1,
                            "inverseBindMatrices": glb.add(inverse, "MAT4", "f", 5126)}]}

    def clip(name, frames, forward):
        poses = [pose(2 * math.pi * f / CYCLE) for f in range(frames + 1)]
        times = glb.add([f / FPS for f in range(frames + 1)], "SCALAR", "f", 5126)
        hips = BONES["hips"][1]
        tracks = [(first + k, "rotation", glb.add([p[0][bone] for p in poses], "VEC4", "f", 5126))
                  for k, bone in enumerate(NAMES) if bone in poses[0][0]]
        tracks.append((first + NAMES.index("hips"), "translation",
                       glb.add([[hips[k] + p[1][k] for k in range(3)] for p in poses], "VEC3", "f", 5126)))
        if forward:
            tracks.append((1, "translation", glb.add([[0.0, 0.0, STRIDE * f / CYCLE] for f in range(frames + 1)], "VEC3", "f", 5126)))
        return {"name": name, "samplers": [{"input": times, "output": output} for _, _, output in tracks],
                "channels": [{"sampler": k, "target": {"node": node, "path": what}} for k, (node, what, _) in enumerate(tracks)]}

    glb.root["animations"] = [clip("walk", CYCLE, False), clip("stroll", STROLL * CYCLE, True)]
    with open(path, "wb") as file:
        file.write(glb.bytes())
    print(f"{path}: {len(points)} points, {len(triangles)} triangles, {len(glb.bytes())} bytes")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "scenes/walker.glb")
