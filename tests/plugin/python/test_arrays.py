# SPDX-License-Identifier: Apache-2.0
"""Geometry passed in and read back, and evaluation at positions."""

import numpy as np
import pytest

import curlew
from conftest import FLOW, octahedron


def test_a_provided_mesh_is_that_of_a_file(session, command, tmp_path):
    points, faces = octahedron()
    text = "read mesh.ply\nmesh2ls dim=24\nnoise frequency=2\nnoise frequency=2 seed=1\nbound layer=0.1\ndfvn speed=1\n"
    text += "velocity dim=24\nwrite {}.vdb\n"
    (tmp_path / "scene.txt").write_text(text.format("file"))
    header = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n"
    header += "".join(f"property float {axis}\n" for axis in "xyz")
    header += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = [" ".join(map(str, p)) for p in points] + ["3 " + " ".join(map(str, f)) for f in faces]
    (tmp_path / "mesh.ply").write_text(header + "\n".join(rows) + "\n")
    command("-config", "scene.txt")
    session.provide_mesh("mesh.ply", points, faces)
    session.run(text.format(tmp_path / "arrays"))
    assert (tmp_path / "arrays.vdb").read_bytes() == (tmp_path / "file.vdb").read_bytes()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("index", [np.int32, np.int64, np.uint32, np.uint8])
def test_meshes_of_any_type_come_back(session, dtype, index):
    points, faces = octahedron()
    session.provide_mesh("m", points.astype(dtype), faces.astype(index))
    session.run("read m")
    mesh = session.mesh()
    assert np.array_equal(mesh.points, points.astype(np.float32)) and mesh.points.dtype == np.float32
    assert np.array_equal(mesh.triangles, faces) and len(mesh.quads) == 0
    assert mesh.faces[0] == (0, 2, 4)


def test_faces_of_different_sizes_and_points_in_the_same_place(session):
    # A cube whose top is two triangles, with a duplicate vertex and a point that belongs to no face.
    points = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)] + [[9, 9, 9], [1, 1, 1]]
    sizes = [4, 4, 4, 4, 4, 3, 3]
    corners = [0, 1, 3, 2, 4, 6, 9, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 1, 7, 3]
    session.provide_mesh("cube", points, (corners, sizes))
    session.run("read cube\nmesh2ls dim=16 keep=1\n")
    mesh = session.mesh()
    assert mesh.points.shape == (8, 3) and mesh.quads.shape == (5, 4) and mesh.triangles.shape == (2, 3)
    session.provide_mesh("two triangles", [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], ((0, 1, 2), (0, 2, 3)))
    session.run("read 'two triangles'")
    assert session.mesh().triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    # A polygon with five vertices is split into triangles.
    angle = 2 * np.pi * np.arange(5) / 5
    session.provide_mesh("pentagon", np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1), ([0, 1, 2, 3, 4], [5]))
    session.run("read pentagon")
    assert session.mesh().triangles.shape == (3, 3)


def test_points_keep_their_ids_and_velocities(session):
    positions = np.random.default_rng(1).uniform(-0.5, 0.5, (50, 3))
    ids = np.arange(50)[::-1] * 3
    session.provide_points("p", positions, ids=ids, velocities=2 * positions)
    session.run("read p")
    points = session.points()
    assert np.array_equal(points.positions, positions) and np.array_equal(points.ids, ids)
    assert np.array_equal(points.velocities, (2 * positions).astype(np.float32))
    assert points.ages is None and points.tracks is None and len(points) == 50
    session.run(FLOW + "advect duration=0.2 steps=4")
    moved = session.points()
    assert np.array_equal(moved.ids, ids) and not np.array_equal(moved.positions, positions)
    assert moved.tracks.shape == (50, 2)
    flow = session.flow()
    assert np.allclose(flow.fields(moved.positions), moved.tracks, atol=1e-7)
    assert np.allclose(flow.fields(positions), moved.tracks, atol=1e-7)  # f and g are unchanged


def test_curves_are_joined_from_edges(session):
    angle = 2 * np.pi * np.arange(40) / 40
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1)
    line = np.stack([np.linspace(-1, 1, 9), np.full(9, 2), np.zeros(9)], 1)
    edges = np.concatenate([np.stack([np.arange(40), np.roll(np.arange(40), -1)], 1), 40 + np.stack([np.arange(8), np.arange(1, 9)], 1)])
    shuffled = np.random.default_rng(3).permutation(edges)
    session.provide_curves("drawn.ply", np.concatenate([ring, line]), shuffled)
    session.run("read drawn.ply")
    curves = session.curves()
    assert curves.closed.tolist() == [False, True] and curves.offsets.tolist() == [0, 9, 49]
    assert np.array_equal(curves.vertices[:9], line)
    first = shuffled[shuffled[:, 0] < 40][0, 0]
    assert np.array_equal(curves.vertices[9:], np.roll(ring, -first, axis=0))
    assert abs(curves.lengths[1] - 80 * np.sin(np.pi / 40)) < 1e-12
    session.run("rail radius=0.1 speed=2\n")
    assert np.allclose(session.flow().velocity([[0, 2, 0]]), [[2, 0, 0]], atol=1e-6)
    with pytest.raises(curlew.Error, match="edge 0 joins vertex 1 to itself"):
        session.provide_curves("c", ring, [[1, 1]])
    with pytest.raises(curlew.Error, match="edges"):
        session.provide_curves("c", ring, [[0, 1, 2]])


def test_slices_of_arrays_are_read_as_they_are(session):
    packed = np.random.default_rng(2).uniform(-1, 1, (40, 6)).astype(np.float32)
    views = {
        "strided": packed[::2, 1:4],
        "backward": packed[::-1, :3],
        "transposed": np.asfortranarray(packed[:, :3]),
        "repeated": np.broadcast_to(packed[0, :3], (7, 3)),
        "swapped": packed[:, :3].astype(">f8"),
        "whole": (10 * packed[:, :3]).astype(np.int16),
        "half": packed[:, :3].astype(np.float16),
        "list": packed[:, :3].tolist(),
    }
    for name, view in views.items():
        session.provide_points(name, view)
        session.run(f"read {name}")
        assert np.array_equal(session.points().positions, np.asarray(view, np.float64)), name
    session.run(FLOW)
    flow = session.flow()
    assert np.array_equal(flow.velocity(views["strided"]), flow.velocity(np.ascontiguousarray(views["strided"])))


@pytest.mark.parametrize(
    "positions", [[1, 2, 3], np.zeros((3, 2)), np.zeros((2, 3, 3)), "text", [[1, 2], [3]], [["a", "b", "c"]], None]
)
def test_positions_of_another_shape_are_refused(session, positions):
    session.run(FLOW)
    with pytest.raises(curlew.Error, match="positions"):
        session.flow().velocity(positions)
    with pytest.raises(curlew.Error, match="positions"):
        session.provide_points("p", positions)


def test_numbers_that_are_none_are_refused(session):
    with pytest.raises(curlew.Error, match=r"positions\[1\] is not a finite"):
        session.provide_points("p", [[0, 0, 0], [0, np.nan, 0]])
    with pytest.raises(curlew.Error, match="whole numbers"):
        session.provide_points("p", [[0, 0, 0]], ids=[0.5])
    with pytest.raises(curlew.Error, match="there are 3"):
        session.provide_mesh("m", np.zeros((3, 3)), [[0, 1, 3]])
    with pytest.raises(curlew.Error, match="faces"):
        session.provide_mesh("m", np.zeros((3, 3)), [[0, 1]])


def test_no_points_are_points_too(session):
    session.provide_points("none", np.zeros((0, 3)))
    session.provide_points("empty", [])
    session.run(FLOW + "read none\nadvect steps=1\nread empty\n")
    assert session.count("points") == 2 and session.points(1).positions.shape == (0, 3)
    assert session.flow().velocity([]).shape == (0, 3)


def test_a_field_and_its_gradient(session):
    session.run("ramp gradient=1,2,3 value=0.5\nnoise dimensions=2\n")
    positions = np.random.default_rng(3).uniform(-2, 2, (1000, 3))
    ramp = session.field(1)
    assert np.allclose(ramp.value(positions), positions @ [1, 2, 3] + 0.5, atol=1e-12)
    assert np.allclose(ramp.gradient(positions), [1, 2, 3])
    assert ramp.value(positions.astype(np.float32)).dtype == np.float32
    noise = session.field()
    assert (noise.dimension, ramp.dimension) == (2, 3)
    value, gradient = noise.value_and_gradient(positions[:, :2])
    assert value.shape == (1000,) and gradient.shape == (1000, 2)
    in_space, gradient_in_space = noise.value_and_gradient(positions)
    assert np.allclose(in_space, value, atol=1e-12) and np.allclose(gradient_in_space[:, :2], gradient, atol=1e-12)
    assert not gradient_in_space[:, 2].any()
    # Agrees with central differences.
    step = 1e-5
    ahead = noise.value(positions[:, :2] + [step, 0]) - noise.value(positions[:, :2] - [step, 0])
    assert np.allclose(ahead / (2 * step), gradient[:, 0], atol=1e-7)
    assert np.isnan(noise.value([[0, np.inf]]))[0]


def test_a_flow_is_the_cross_product_of_the_gradients_of_its_fields(session):
    session.run("noise frequency=2\nnoise frequency=2 seed=1\ndfvn keep=1\n")
    positions = np.random.default_rng(4).uniform(-1, 1, (1000, 3))
    flow, f, g = session.flow(), session.field(1), session.field(0)
    assert (flow.dimension, flow.has_tracks, flow.divergence_free) == (3, True, True)
    assert np.array_equal(flow.lower, [-1, -1, -1]) and np.array_equal(flow.upper, [1, 1, 1])
    session.close()
    velocity, fields = flow.velocity_and_fields(positions)
    assert np.allclose(velocity, np.cross(f.gradient(positions), g.gradient(positions)), atol=1e-9)
    assert np.array_equal(fields, np.stack([f.value(positions), g.value(positions)], 1))


def test_a_flow_of_two_dimensions_and_a_sum(session):
    session.run("noise dimensions=2\ndfvn\n")
    plane, space = session.flow().velocity([[0.3, 0.4]]), session.flow().velocity([[0.3, 0.4, 0]])
    assert plane.shape == (1, 2) and np.allclose(space[0, :2], plane[0]) and space[0, 2] == 0
    assert session.flow().fields([[0.3, 0.4]]).shape == (1, 1)
    session.run("uniform velocity=1,2,3\nuniform velocity=1,0,0\nsuperpose\n")
    assert np.allclose(session.flow().velocity([[5, 5, 5]]), [2, 2, 3])
    with pytest.raises(curlew.Error, match="no tracks"):
        session.flow().fields([[0, 0, 0]])


def test_curves_come_with_where_each_begins(session):
    session.run("vortex\nscatter box=-0.5,-0.5,-0.5,0.5,0.5,0.5 count=20\ntrace\n")
    curves = session.curves()
    assert len(curves) == 20 and curves.closed.all() and curves.offsets[0] == 0
    assert curves.offsets[-1] == len(curves.vertices) == len(curves.velocities) == len(curves.along)
    for k in range(20):
        vertices = curves.vertices[curves.offsets[k] : curves.offsets[k + 1]]
        radius = np.hypot(vertices[:, 0], vertices[:, 2])
        assert np.allclose(radius, radius[0], atol=1e-6) and np.allclose(vertices[:, 1], vertices[0, 1], atol=1e-9)
        assert abs(curves.lengths[k] / (2 * np.pi * radius[0]) - 1) < 1e-3


def test_pictures_and_grids(session):
    session.run("ramp gradient=1,10,0\nslice width=40 box=-1,-1,-1,3,1,1\n")
    image = session.image()
    assert image.pixels.shape == (20, 40, 1) and image.channels == ["value"]
    inside = image.pixels[2:-2, 2:-2, 0]
    pixel = np.diff(inside, axis=1)
    assert np.allclose(pixel, pixel[0, 0], atol=1e-5) and pixel[0, 0] == pytest.approx(0.1, abs=1e-5)  # x increases to the right
    assert np.allclose(np.diff(inside, axis=0), -10 * pixel[0, 0], atol=1e-4)  # y decreases downwards
    session.run(FLOW + "velocity voxel=0.1 density=1 name=wind staggered=1\n")
    wind, density = session.grids()
    assert wind["name"] == "wind" and wind["class"] == "staggered" and wind["type"] == "vec3s"
    assert density["name"] == "density" and density["voxel_size"] == pytest.approx(0.1) and density["active_voxels"] > 0
    assert session.count("image") == 1
    with pytest.raises(curlew.Error, match="kinds are"):
        session.count("volume")


def test_frames_are_seen_while_they_are_there(session):
    seen = []

    def on_frame(frame, same):
        assert same is session
        seen.append((frame, same.count("image"), same.points().positions.copy(), same.points().ages))

    session.run(FLOW + "frames 1-4 fps=10\nemit rate=100 life=0.25\nadvect\nslice width=8\n", on_frame=on_frame)
    assert [frame for frame, *_ in seen] == [1, 2, 3, 4]
    assert [images for _, images, *_ in seen] == [1, 1, 1, 1]
    assert [len(p) for _, _, p, _ in seen][:3] == [0, 10, 20]
    assert seen[3][3].max() <= 0.25
    assert session.count("image") == 0 and session.report()["frames"] == 4
    with pytest.raises(curlew.Cancelled):
        session.run("frames 1-4\nslice width=8\n", on_frame=lambda frame, same: frame == 2)


def test_a_mesh_for_each_frame(session):
    points, faces = octahedron()
    for frame in (1, 2, 3):
        session.provide_mesh(f"mesh.{frame}.ply", points + [0.1 * frame, 0, 0], faces)
    text = "frames 1-3\nread mesh.$F.ply\nmesh2ls dim=16\nnoise\nnoise seed=1\nbound\ndfvn speed=1\nemit rate=200\nadvect\n"
    session.run(text)
    assert session.report()["advect"]["outside_most"] == 0 and len(session.points()) > 10


def test_advect_in_one_call():
    positions = np.random.default_rng(5).uniform(-0.9, 0.9, (30, 3))
    moved = curlew.advect(positions, curlew.Program("vortex turns=0.25 core=1e6"), duration=1, steps=200, ids=range(30, 60))
    quarter = np.stack([positions[:, 2], positions[:, 1], -positions[:, 0]], 1)
    assert np.allclose(moved.positions, quarter, atol=1e-4)
    assert moved.ids.tolist() == list(range(30, 60))
    with pytest.raises(curlew.Error, match="no option 'tim'|steps=-1"):
        curlew.advect(positions, "vortex", steps=-1)


def test_velocity_grid_in_one_call(tmp_path):
    path = tmp_path / "it's $F {x}.vdb"
    grid = curlew.velocity_grid(path, FLOW, voxel=0.1, staggered=True, box=[-1, -1, -1, 1, 1, 1], name="v")
    assert grid["name"] == "v" and grid["class"] == "staggered" and path.stat().st_size > 1000
    points, faces = octahedron()
    text = "read m\nmesh2ls dim=16\nnoise\nnoise seed=1\nbound\ndfvn\n"
    assert curlew.velocity_grid(tmp_path / "m.vdb", text, {"m": (points, faces)}, dim=16)["active_voxels"] > 0


@pytest.mark.parametrize("name", ["v_%04d_##.vdb", "#.vdb", "100%d $# {{}} $F4 #$%%.vdb"])
def test_a_path_is_taken_literally(tmp_path, name):
    curlew.velocity_grid(tmp_path / name, FLOW, dim=8)
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_an_escaped_text_has_no_expressions(session, tmp_path):
    name = "{1+1}{{$F$$####%d%04d%%"
    folder = tmp_path / name
    folder.mkdir()
    session.run_graph({"nodes": [
        {"name": "ball", "action": "sphere"},
        {"name": "points", "action": "scatter", "options": {"count": 5}, "inputs": {"domain": ["ball"]}},
        {"name": "write", "action": "write", "words": [curlew.escaped(str(folder)) + "/$F4.csv"], "inputs": {"what": ["points"]}},
    ], "frames": {"words": ["1-2"]}})
    assert sorted(path.name for path in folder.iterdir()) == ["0001.csv", "0002.csv"]


def ripples(x):
    """A field and its gradients."""
    return np.sin(3 * x[:, 0]) * x[:, 1], np.stack([3 * np.cos(3 * x[:, 0]) * x[:, 1], np.sin(3 * x[:, 0]), 0 * x[:, 2]], 1)


def test_a_field_from_numpy(session):
    session.provide_field("ripples", ripples)
    session.run("read ripples\nformula 'sin(3*x)*y'\nsubtract\ncheck samples=1000")
    assert abs(session.report()["check"]["field_max"]) < 1e-12
    session.run("read ripples\nnoise\ndfvn speed=1\nscatter count=100\nadvect duration=0.2\ncheck samples=1000")
    assert session.report()["check"]["drift_f"] < 1e-6
    positions = np.random.default_rng(2).uniform(-1, 1, (100, 3))
    session.run("read ripples")
    assert np.allclose(session.field().value(positions), ripples(positions)[0])


def test_a_field_of_another_dimension_changes_with_its_function(session):
    def plane(factor):
        return lambda x: (factor * x[:, 0], np.stack([factor + 0 * x[:, 0], 0 * x[:, 0]], 1))

    for factor in (1, 2):
        session.provide_field("plane", plane(factor), dimension=2)
        session.run_graph("read plane\ncheck samples=1000")
        assert abs(session.report()["check"]["field_max"] - factor) < 0.02


def test_functions_of_fields_that_are_wrong(session):
    with pytest.raises(curlew.Error, match="gradients"):
        session.provide_field("wrong", lambda x: (x[:, 0], 0 * x))
    with pytest.raises(ZeroDivisionError):
        session.provide_field("broken", lambda x: 1 // 0)
    with pytest.raises(curlew.Error, match="1 to 7"):
        session.provide_field("flat", ripples, dimension=0)
    broken = []

    def later(x):
        if broken:
            raise KeyError("later")
        return ripples(x)

    session.provide_field("later", later)
    broken.append(True)
    with pytest.raises(KeyError):
        session.run("read later\ncheck samples=1000")


def breakable(session):
    """Provides a field "q" and returns it with a list: the function raises the first exception in it."""
    broken = []

    def function(x):
        if broken:
            raise broken[0]
        return ripples(x)

    session.provide_field("q", function)
    session.run("read q\nnoise\ndfvn keep=1")
    return session.field(1), broken


def test_an_exception_of_a_fields_function_is_raised_where_it_is_evaluated(session):
    field, broken = breakable(session)
    flow = session.flow()
    broken.append(KeyError("inside"))
    for evaluate in (field.value, field.gradient, field.value_and_gradient, flow.velocity, flow.fields):
        with pytest.raises(KeyError, match="inside") as error:
            evaluate(np.zeros((1000, 3)))
        assert error.value is broken[0]
    assert not session._failures.found
    session.close()
    with pytest.raises(KeyError):
        field.value(np.zeros((1, 3)))
    broken.clear()
    assert field.value(np.zeros((1, 3))) == 0


def test_an_exception_that_was_handled_does_not_replace_the_end_of_the_run(session):
    field, broken = breakable(session)

    def on_frame(frame, same):
        broken.append(ZeroDivisionError(frame))
        with pytest.raises(ZeroDivisionError):
            field.value(np.zeros((2, 3)))
        broken.clear()
        return frame == 2

    with pytest.raises(curlew.Cancelled):
        session.run("frames 1-3\nnoise\nslice width=4", on_frame=on_frame)
    with pytest.raises(curlew.Error, match="no option"):
        session.run("noise freqency=2")
    session.run("read q")
    assert not session._failures.found


def test_results_of_a_fields_function_are_not_changed(session):
    with pytest.raises(curlew.Error, match="values must be real numbers, not complex128"):
        session.provide_field("q", lambda x: (x[:, 0] + 1j, 0 * x))
    with pytest.raises(curlew.Error, match="gradients must be an array without masked"):
        session.provide_field("q", lambda x: (x[:, 0], np.ma.masked_less(x, 0)))
    with pytest.raises(curlew.Error, match="1 to 7"):
        session.provide_field("q", ripples, dimension=2**32 + 3)
    with pytest.raises(curlew.Error, match="whole number, not 2.5"):
        session.provide_field("q", ripples, dimension=2.5)


def test_numbers_that_would_change_are_refused(session):
    origin = [[0, 0, 0]]
    with pytest.raises(curlew.Error, match="ids must be whole numbers below"):
        session.provide_points("p", origin, ids=np.array([2**63], np.uint64))
    with pytest.raises(curlew.Error, match="positions must be real numbers, not complex128"):
        session.provide_points("p", np.array(origin) + 1j)
    with pytest.raises(curlew.Error, match="positions must be an array without masked entries"):
        session.provide_points("p", np.ma.masked_equal(origin, 0))
    with pytest.raises(curlew.Error, match="velocities must be real numbers, not datetime64"):
        session.provide_points("p", origin, velocities=np.zeros((1, 3), "datetime64[s]"))
    session.provide_points("p", np.ma.array(origin), ids=np.array([2**63 - 1], np.uint64))
    session.run("read p")
    assert session.points().ids.tolist() == [2**63 - 1]


@pytest.mark.parametrize("age", [2**64, -(2**64), 1.5, None, b"a", [0]])
def test_an_age_is_a_whole_number(session, age):
    session.run("constant\nbake dim=4 box=0,0,0,1,1,1")
    with pytest.raises(curlew.Error, match="age"):
        session.grid(age)
    assert session.grid(np.int64(0)).name == session.grid(0).name


def test_options_of_any_type(tmp_path):
    path = tmp_path / "v.vdb"
    box = np.array([-1, -1, -1, 1, 1, 1], np.float32)
    grid = curlew.velocity_grid(path, FLOW, dim=np.int64(8), staggered=np.True_, box=box, voxel=None)
    assert grid["class"] == "staggered"
    assert curlew.velocity_grid(path, FLOW, dim=np.array(8), staggered=np.False_)["class"] != "staggered"
    for value in (b"8", 8j, [b"8"], object(), {}):
        with pytest.raises(curlew.Error, match="the option 'dim' must be"):
            curlew.velocity_grid(path, FLOW, dim=value)
    with pytest.raises(curlew.Error, match="the program must be text or a Program, not dict"):
        curlew.velocity_grid(path, {}, dim=8)


def test_both_quotes_and_no_line_break(tmp_path):
    name = "it's a \"name\""
    grid = curlew.velocity_grid(tmp_path / f"{name}.vdb", FLOW, dim=8, name=name)
    assert grid["name"] == name and [path.name for path in tmp_path.iterdir()] == [f"{name}.vdb"]
    with pytest.raises(curlew.Error, match="the path must not contain a line break"):
        curlew.velocity_grid(tmp_path / "a\nb.vdb", FLOW, dim=8)
    with pytest.raises(curlew.Error, match="the option 'name' must not contain a line break"):
        curlew.velocity_grid(tmp_path / "a.vdb", FLOW, dim=8, name="a\nquit")
    with pytest.raises(curlew.Error, match="the path has a character that UTF-8 does not have"):
        curlew.velocity_grid("\udcff.vdb", FLOW, dim=8)
    with pytest.raises(curlew.Error, match="the path must be text, not bytes"):
        curlew.velocity_grid(b"a.vdb", FLOW, dim=8)


def test_a_grid_from_a_frame_cannot_be_read_after_the_frame(session):
    kept, values = [], []

    def on_frame(frame, same):
        grid = same.grid("a" if frame == 1 else "b")
        values.append(float(grid.array().max()))
        kept.append(grid)
        if frame == 2:
            with pytest.raises(curlew.Error, match="gone on"):
                kept[0].array()

    session.run(
        "constant value={F} as=one\nframes 1-2\nconstant value={F} as=x\nbake field=x dim=8 box=0,0,0,1,1,1 as=a\n"
        "constant value={10*F} as=y\nbake field=y dim=8 box=0,0,0,1,1,1 as=b\n",
        on_frame=on_frame,
    )
    assert values == [1, 20]
    with pytest.raises(curlew.Error, match="gone on"):
        kept[1].array()
    assert session.grid("b").array().max() == 20
