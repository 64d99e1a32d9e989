# SPDX-License-Identifier: Apache-2.0
"""Graphs of nodes: results by name, incremental runs, errors that name nodes, and grids without copies."""

import copy
import json
from types import MappingProxyType

import numpy as np
import pytest

import curlew
from conftest import octahedron


def node(name, action, inputs=None, words=(), **options):
    return {"name": name, "action": action, "inputs": inputs or {}, "words": list(words), "options": options}


def graph(**more):
    """Returns a graph of two noises, one bounded by a sphere, their flow, and points that follow it. The nodes are unordered."""
    return {
        "curlew": 1,
        "nodes": [
            node("dust", "advect", {"flow": "wind", "points": "seeds"}, duration=0.2, steps=4),
            node("wind", "dfvn", {"f": "swirl", "g": "along"}, speed=1),
            node("seeds", "scatter", {"domain": "wind"}, count=300),
            node("along", "bound", {"noise": "noise two", "wall": "ball"}, layer=0.2),
            node("ball", "sphere", radius=1),
            node("swirl", "noise", frequency=2),
            node("noise two", "noise", frequency=2, seed=1),
        ],
        **more,
    }


def edited(given, name, **options):
    """Returns a copy of the graph with other options of a node."""
    result = copy.deepcopy(given)
    next(n for n in result["nodes"] if n["name"] == name)["options"].update(options)
    return result


TEXT = """
noise frequency=2 as=swirl
noise frequency=2 seed=1 as=second
sphere radius=1 as=ball
bound layer=0.2 noise=second wall=ball as=along
dfvn speed=1 f=swirl g=along as=wind
scatter count=300 domain=wind as=seeds
advect duration=0.2 steps=4 flow=wind points=seeds as=dust
"""


def test_results_by_name_are_those_of_the_scene(session):
    with curlew.Session() as other:
        other.run(TEXT)
        session.run_graph(graph())
        assert np.array_equal(session.points("dust").positions, other.points("dust").positions)
        assert np.array_equal(session.points("dust").positions, other.points().positions)
    positions = session.points("seeds").positions
    assert np.array_equal(session.flow("wind").velocity(positions), session.flow(0).velocity(positions))
    assert session.field("swirl").dimension == 3 and session.count("points") >= 1


def test_what_is_not_there_or_of_another_kind_is_an_error(session):
    session.run_graph(graph())
    with pytest.raises(curlew.Error, match="'wind' is of kind 'flow', not 'points'"):
        session.points("wind")
    with pytest.raises(curlew.Error, match="did you mean 'dust'"):
        session.points("dist")


def test_only_what_an_edit_reaches_is_evaluated(session):
    first = graph()
    session.run_graph(first)
    assert set(session.evaluated) == {n["name"] for n in first["nodes"]}
    before = session.points("dust").positions
    session.run_graph(first)
    assert session.evaluated == []
    session.run_graph(edited(first, "dust", duration=0.1))
    assert session.evaluated == ["dust"]
    assert not np.array_equal(session.points("dust").positions, before)
    session.run_graph(edited(first, "swirl", frequency=3))
    assert {"swirl", "wind", "dust"} <= set(session.evaluated)
    assert not {"ball", "along", "noise two"} & set(session.evaluated)
    # The result is the same in a new session.
    with curlew.Session() as fresh:
        fresh.run_graph(edited(first, "swirl", frequency=3))
        assert np.array_equal(fresh.points("dust").positions, session.points("dust").positions)


def test_a_provided_mesh_counts_by_what_it_is(session):
    points, faces = octahedron()
    nodes = [node("mesh", "read", words=["m"]), node("hull", "mesh2ls", {"mesh": "mesh"}, dim=16)]
    for expected, scale in (({"mesh", "hull"}, 1), (set(), 1), ({"mesh", "hull"}, 2)):
        session.provide_mesh("m", scale * points, faces)
        session.run({"curlew": 1, "nodes": nodes})
        assert set(session.evaluated) == expected
    assert session.grid("hull").array().shape[0] > 8


def test_wanted_leaves_out_what_nothing_needs(session, tmp_path):
    nodes = graph()["nodes"] + [node("file", "write", {"what": "dust"}, words=[str(tmp_path / "dust.csv")])]
    session.run_graph({"curlew": 1, "nodes": nodes, "wanted": ["wind"], "effects": False})
    assert "dust" not in session.evaluated and "seeds" not in session.evaluated and not list(tmp_path.iterdir())
    session.run_graph({"curlew": 1, "nodes": nodes})
    assert (tmp_path / "dust.csv").exists()


def test_dicts_json_and_scenes_are_the_same_graph(session):
    text = json.dumps(graph())
    for given in (graph(), text, curlew.translate(graph(), "scene"), curlew.translate(TEXT, "json")):
        session.run_graph(given)
        assert len(session.points("dust")) == 300
        again = curlew.translate(given, "json")
        assert curlew.translate(again, "json") == again
    assert json.loads(curlew.translate(graph(), "json"))["curlew"] == 1
    with pytest.raises(curlew.Error, match="form"):
        curlew.translate(TEXT, "yaml")
    session.run_graph(edited(graph(), "seeds", count=np.int64(7), seed=np.float32(2)))  # NumPy scalars
    assert len(session.points("dust")) == 7


def test_graphs_hold_mappings_and_paths(session, tmp_path):
    file = tmp_path / "dust.csv"
    nodes = [
        MappingProxyType(node("dust", "scatter", box="0,0,0,1,1,1", count=np.int64(5))),
        node("file", "write", MappingProxyType({"what": "dust"}), words=[file]),
    ]
    for run in (session.run, session.run_graph):
        run(MappingProxyType({"curlew": 1, "nodes": nodes}))
        assert len(session.points("dust")) == 5
        file.unlink()


@pytest.mark.parametrize("word", [b"dust.csv", np.bytes_(b"dust.csv"), {1, 2}, 1j, object()])
def test_what_no_graph_can_hold_is_refused(session, word):
    with pytest.raises(curlew.Error, match="a graph must contain text, numbers, lists and dicts"):
        session.run_graph({"curlew": 1, "nodes": [node("file", "write", words=[word])]})


@pytest.mark.parametrize("program", [b"noise", None, 5, ["noise"]])
def test_a_program_of_another_type_is_refused(session, program):
    for run in (session.run, session.run_graph):
        with pytest.raises(curlew.Error, match="a program must be text or a dict"):
            run(program)


def test_text_goes_on_from_what_a_graph_has_left(session):
    session.run_graph(graph())
    before = session.points("dust").positions
    session.run("advect flow=wind points=dust duration=0.1 steps=2 as=later\n")
    assert not np.array_equal(session.points("later").positions, before)


@pytest.mark.parametrize(
    ("change", "name", "words"),
    [
        (lambda nodes: nodes[1]["inputs"].pop("f"), "wind", "nothing is connected to 'f'"),
        (lambda nodes: nodes[0]["inputs"].update(flow="swirl"), "dust", "flow"),
        (lambda nodes: nodes[0]["inputs"].update(points="seds"), "dust", "did you mean 'seeds'"),
        (lambda nodes: nodes[5]["options"].update(freqency=2), "swirl", "did you mean 'frequency'"),
        (lambda nodes: nodes[5]["options"].update(octaves="{1/0}"), "swirl", "octaves"),
        (lambda nodes: nodes[3]["inputs"].update(noise="along"), "along", "cycle"),
        (lambda nodes: nodes[6].update(action="nois"), "noise two", "nois"),
    ],
)
def test_errors_name_the_node(session, change, name, words):
    given = graph()
    change(given["nodes"])
    with pytest.raises(curlew.Error, match=words) as error:
        session.run_graph(given)
    assert error.value.node == name
    session.run_graph(graph())
    with pytest.raises(curlew.Error) as error:
        session.run("nonsense")
    assert error.value.node is None


def test_stills_of_a_moment(session):
    moving = edited(graph(), "swirl", translate="{T},0,0")
    session.run_graph({**moving, "moment": {"frame": 13, "time": 0.5, "fps": 24}})
    still = session.points("dust").positions
    session.run_graph(edited(graph(), "swirl", translate="0.5,0,0"))
    assert np.array_equal(session.points("dust").positions, still)


def test_frames_are_read_by_name(session):
    seen = []
    moving = {**graph(), "frames": {"words": ["1-3"], "options": {"fps": 10}}}
    session.run_graph(moving, on_frame=lambda frame, same: seen.append((frame, same.points("dust").positions)))
    assert [frame for frame, _ in seen] == [1, 2, 3]
    assert not np.array_equal(seen[0][1], seen[2][1])


def test_emitters_without_links_stay_apart(session):
    """Emitted points are not added to those of the other emitter or to points made before the frames."""
    nodes = [
        node("wind", "uniform", velocity="0,0,1", box="-1,-1,-1,1,1,1"),
        node("seeds", "scatter", {"domain": "wind"}, count=7),
        node("left", "emit", words=(), rate=100, box="-1,0,0,-0.9,1,1"),
        node("right", "emit", words=(), rate=50, box="0.9,0,0,1,1,1"),
        *(node(f"{name} moved", "advect", {"flow": "wind", "points": name}) for name in ("seeds", "left", "right")),
    ]
    counts = []
    session.run_graph(
        {"curlew": 1, "nodes": nodes, "frames": {"words": ["1-3"], "options": {"fps": 10}}},
        on_frame=lambda frame, same: counts.append([len(same.points(f"{n} moved")) for n in ("seeds", "left", "right")]),
    )
    assert counts[-1] == [7, 20, 10]


def test_wanted_points_need_what_carries_them_to_the_next_frame(session):
    """The flow that moves the emitted points is evaluated even if only the emitter is wanted."""
    nodes = [
        node("source", "emit", words=(), rate=100, box="-1,0,0,-0.9,1,1"),
        node("moved", "advect", {"flow": "wind", "points": "source"}),
        node("wind", "uniform", velocity="0,0,1", box="-1,-1,-1,1,1,1"),
    ]
    heights = []
    session.run_graph(
        {"curlew": 1, "nodes": nodes, "frames": {"words": ["1-3"], "options": {"fps": 10}}, "wanted": ["source"]},
        on_frame=lambda frame, same: heights.append(sorted(same.points("source").positions[:10, 2].tolist())),
    )
    assert len(heights[-1]) == 10
    # The points are born every 0.01 s, so they have moved at speed 1 for 0 to 0.09 s.
    assert np.subtract(heights[2], heights[1]).mean() == pytest.approx(0.045, abs=1e-6)


def test_a_branch_that_traces_first_does_not_freeze_the_points(session):
    """Points that are both traced and advected move in every frame, whichever branch comes first."""
    moved = []
    for order in (1, -1):
        nodes = [
            node("wind", "uniform", velocity="0,0,1", box="-9,-9,-9,9,9,9"),
            node("seeds", "scatter", {"domain": "wind"}, count=5, box="-1,-1,-1,1,1,1"),
            node("lines", "trace", {"flow": "wind", "points": "seeds"}, maxLength=1),
            node("dust", "advect", {"flow": "wind", "points": "seeds"}),
        ][::order]
        heights = []
        session.run_graph(
            {"curlew": 1, "nodes": nodes, "frames": {"words": ["1-4"], "options": {"fps": 10}}, "wanted": ["lines", "dust"]},
            on_frame=lambda frame, same: heights.append(same.points("dust").positions[:, 2].mean()),
        )
        assert np.allclose(np.diff(heights), 0.1, atol=1e-6)
        moved.append(heights)
    assert moved[0] == moved[1]


def test_a_grid_is_an_array(session):
    session.run_graph({"curlew": 1, "nodes": [*graph()["nodes"], node("smoke", "velocity", {"flow": "wind"}, voxel=0.1, density=1)]})
    wind, density = session.grid("smoke"), session.grid("smoke.density")
    assert wind.type == "vec3s" and density.type == "float" and wind.name == session.grids()[0]["name"]
    assert np.allclose(wind.voxel_size, 0.1) and wind.about["lower"] == list(wind.lower)
    values = wind.array()
    assert values.shape == tuple(b - a for a, b in zip(wind.lower, wind.upper)) + (3,) and values.dtype == np.float32
    # At a voxel's position, the flow equals the grid's value.
    index = np.array([1, -2, 3])
    x, y, z = index - wind.lower
    position = (wind.transform @ np.append(index, 1))[:3]
    assert np.allclose(position, 0.1 * index, atol=1e-6)
    assert np.allclose(values[x, y, z], session.flow("wind").velocity([position]), atol=1e-5)
    part = wind.array(index, index + [2, 3, 4])
    assert part.shape == (2, 3, 4, 3) and np.array_equal(part, values[x : x + 2, y : y + 3, z : z + 4])
    assert wind.array((0, 0, 0), (0, 5, 5)).shape == (0, 5, 5, 3)
    for grid in (wind, density):
        active = 0
        for origin, block, mask in grid.leaves():
            assert np.array_equal(block, grid.array(origin, np.add(origin, 8)))
            assert not block.flags.writeable and block.shape[:3] == mask.shape == (8, 8, 8)
            active += mask.sum()
        assert active == grid.about["active_voxels"]
    session.run("noise")
    with pytest.raises(curlew.Error, match="get the grid again"):
        density.array()


def test_a_level_set_has_one_as_well(session):
    points, faces = octahedron()
    session.provide_mesh("m", points, faces)
    session.run("read m\nmesh2ls dim=24 as=hull\n")
    hull = session.grid("hull")
    assert hull.grid_class == "level set" and hull.array().min() < 0 < hull.array().max()
    leaf = next(hull.leaves())
    assert leaf.active.dtype == bool and leaf.values.shape == (8, 8, 8) and leaf.active.any()
