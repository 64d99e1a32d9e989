# SPDX-License-Identifier: Apache-2.0
"""Points on loops: each frame is computed on its own, and `fade` is below 1 for points whose tracks take too long."""

import numpy as np

BALL = """
sphere
noise frequency=1.5
noise frequency=1.5 seed=1
bound layer=0.2
dfvn speed=1
scatter count=300 seed=3
"""


def frames(session, text):
    """Returns the points of each frame."""
    seen = {}
    session.run(text, on_frame=lambda frame, now: seen.update({frame: now.points("dust")}))
    return seen


def same(a, b):
    """Returns whether two sets of points are equal to the bit."""
    pairs = ((a.positions, b.positions), (a.velocities, b.velocities), (a.ids, b.ids), (a.fades, b.fades))
    return all(np.array_equal(one, other) for one, other in pairs)


def test_the_last_frame_is_the_first_and_any_frame_stands_alone(session):
    whole = frames(session, BALL + "frames 0-24 fps=24\nadvect loop=1 as=dust\n")
    assert same(whole[24], whole[0])
    assert not same(whole[7], whole[0])
    for frame in (7, 19, 0):
        alone = frames(session, BALL + f"frames {frame}-{frame} start=0 fps=24\nadvect loop=1 as=dust\n")
        assert list(alone) == [frame]
        assert same(alone[frame], whole[frame])


def test_what_fades_is_counted_and_hidden_while_it_jumps(session):
    whole = frames(session, BALL + "frames 0-48 fps=24\nadvect loop=2 as=dust\n")
    report = session.report()["loop"]
    assert report["closed"] + report["faded"] == 300 and report["faded"] > 10
    assert 2 / 3 <= report["pace_min"] <= report["pace_mean"] <= report["pace_max"] <= 4 / 3
    fades = np.array([points.fades for points in whole.values()])
    assert fades.dtype == np.float32 and fades.min() >= 0 and fades.max() == 1
    fading = (fades < 1).any(axis=0)
    assert fading.sum() == report["faded"]
    positions = np.array([points.positions for points in whole.values()])
    moved = np.linalg.norm(np.diff(positions, axis=0), axis=2)
    fastest = max(np.linalg.norm(points.velocities, axis=1).max() for points in whole.values()) * 1.5 / 24
    jumps = moved > fastest
    assert not jumps[:, ~fading].any()
    assert np.maximum(fades[:-1], fades[1:])[jumps].max(initial=0) < 0.2
