# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from kintrack.geometry import PinholeCamera
from kintrack.raster import rasterise
from synthesis.mesh import Material
from synthesis.objects.bars import bent, sheet, staple, tube
from synthesis.objects.catalogue import (
    HELD_OUT,
    OCCLUDERS,
    THINGS,
    held_out_things,
    training_things,
)
from synthesis.objects.seats import bench, chair, desk_chair, sofa, stool
from synthesis.objects.shapes import box, cylinder, prism, rounded_rectangle
from synthesis.objects.turned import cushion, lathe, sphere
from synthesis.patterns import Plain

STUFF = Material(Plain((0.5, 0.5, 0.5)))
SEEDS = (0, 1, 2)
SOLIDS = {
    "box": (lambda: box((0.2, 0.3, 0.4), STUFF), 0.024),
    "rounded box": (lambda: box((0.2, 0.3, 0.4), STUFF, 0.02, 0.03), 0.0235),
    "cylinder": (lambda: cylinder(0.1, 0.5, STUFF, 0.01, 60), np.pi * 0.005),
    "prism": (lambda: prism(rounded_rectangle(1, 2), 0.5, STUFF), 1.0),
    "sphere": (lambda: sphere(0.3, STUFF, 48), 4 / 3 * np.pi * 0.027),
    "tube": (lambda: tube([[0, 0, 0], [0, 0, 1]], 0.1, STUFF, 40), np.pi * 0.01),
    "bent tube": (lambda: tube(bent([[0, 0, 0], [0, 0, 1], [1, 0, 1]], 0.1), 0.02, STUFF), 0.0022),
    "cup": (lambda: lathe([(0, 0), (1, 0), (1, 1), (0.5, 1), (0.5, 0.5), (0, 0.5)], STUFF, 64),
            np.pi * 0.875),
    "sheet": (lambda: sheet(np.stack(np.meshgrid([0, 1, 2], [0, 1], [0], indexing="xy"), -1)
                            .reshape(2, 3, 3).astype(float), 0.1, STUFF), 0.2),
    "cushion": (lambda: cushion((0.3, 0.3, 0.3), STUFF, 1.0, 60, 31), None),
}  # fmt: skip


def _volume(vertices, faces):
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    return np.einsum("fi,fi->f", a, np.cross(b, c)) / 6


def _pieces(mesh):
    """Faces of a mesh by piece, vertices at one place counted as one."""
    _, same = np.unique(np.round(mesh.vertices, 7), axis=0, return_inverse=True)
    faces = same.reshape(-1)[mesh.faces]
    rows, columns = faces[:, [0, 1]].T
    rows2, columns2 = faces[:, [1, 2]].T
    size = same.max() + 1
    graph = coo_matrix(
        (np.ones(2 * len(faces)), (np.r_[rows, rows2], np.r_[columns, columns2])), (size, size)
    )
    return connected_components(graph, directed=False)[1][faces[:, 0]], faces


def _things(names=tuple(THINGS)):
    return [pytest.param(THINGS[n](np.random.default_rng(s)), id=f"{n}{s}")
            for n in names for s in SEEDS]  # fmt: skip


@pytest.mark.parametrize("name", SOLIDS)
def test_a_shape_is_closed_and_has_its_volume(name):
    make, volume = SOLIDS[name]
    mesh = make()
    _, faces = _pieces(mesh)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    there, back = ({tuple(e) for e in edges.tolist()} for edges in (edges, edges[:, ::-1]))
    assert there == back and len(there) == len(edges)
    assert _volume(mesh.vertices, mesh.faces).sum() > 0
    if volume is not None:
        assert _volume(mesh.vertices, mesh.faces).sum() == pytest.approx(volume, rel=0.05)


@pytest.mark.parametrize("size", [(0.1, 0.4, 0.5), (0.5, 0.1, 0.4), (0.4, 0.5, 0.1)])
def test_a_cushion_is_as_large_as_asked_whichever_way_it_is_thin(size):
    mesh = cushion(size, STUFF, 0.5)
    assert np.ptp(mesh.vertices, axis=0) == pytest.approx(size, rel=0.05)
    assert mesh.vertices[:, 2].min() == pytest.approx(0, abs=0.01)
    assert _volume(mesh.vertices, mesh.faces).sum() > 0.5 * np.prod(size)


def test_a_staple_leaves_and_returns_along_its_direction():
    path = staple((0, 0, 0), (0, 1, 0), (0.5, 0, 0), 0.1)
    assert path[0].tolist() == [0, 0, 0] and path[-1].tolist() == [0, 1, 0]
    assert path[:, 0].max() == pytest.approx(0.5) and (path[:, 2] == 0).all()


@pytest.mark.parametrize("thing", _things())
def test_a_thing_stands_on_the_floor_in_its_real_size(thing):
    low, high = thing.mesh.vertices.min(axis=0), thing.mesh.vertices.max(axis=0)
    assert low[2] == pytest.approx(0, abs=0.012)
    assert np.abs(low + high)[:2].max() < 0.9 * (high - low)[:2].max() + 0.12
    assert 0.08 < (high - low).max() < 2.6
    assert 50 < len(thing.mesh.faces) <= 8000
    assert np.isfinite(thing.mesh.coords).all() and not thing.mesh.labels.any()


@pytest.mark.parametrize("thing", _things())
def test_every_piece_of_a_thing_is_turned_outward(thing):
    piece, faces = _pieces(thing.mesh)
    volumes = np.bincount(piece[: len(faces)], _volume(thing.mesh.vertices, thing.mesh.faces))
    assert volumes.min() > -1e-9 and volumes.max() > 1e-6


@pytest.mark.parametrize("thing", _things())
def test_materials_reflect_a_share_of_the_light(thing):
    for material in thing.mesh.materials:
        assert 0.01 <= material.infrared <= 0.9 and 0 <= material.gloss <= 0.8
        albedo = material.pattern(thing.mesh.coords)
        assert albedo.shape == thing.mesh.coords.shape
        assert albedo.min() >= 0 and albedo.max() <= 1


@pytest.mark.parametrize("name", THINGS)
def test_a_kind_is_drawn_anew_by_each_seed_and_alike_by_one(name):
    a, b, c = (THINGS[name](np.random.default_rng(seed)).mesh for seed in (5, 5, 6))
    assert a.vertices.tobytes() == b.vertices.tobytes() and a.faces.tobytes() == b.faces.tobytes()
    assert a.coords.tobytes() == b.coords.tobytes()
    assert a.vertices.shape != c.vertices.shape or not np.allclose(a.vertices, c.vertices)


@pytest.mark.parametrize("make", [stool, chair, desk_chair, sofa, bench])
@pytest.mark.parametrize("seed", range(4))
def test_the_seat_lies_on_the_upper_surface(make, seed):
    thing = make(np.random.default_rng(seed))
    T = thing.places["seat"]
    assert np.allclose(T[:3, :3], np.eye(3)) and 0.4 < T[2, 3] < 0.56
    camera = PinholeCamera(9, 9, 400.0, 400.0, 4.0, 4.0)
    points = (thing.mesh.vertices - [T[0, 3], T[1, 3], 3.0]) * [1, -1, -1]
    above, _ = rasterise(points, thing.mesh.faces, camera)
    assert 3.0 - np.median(above) == pytest.approx(T[2, 3], abs=0.03)


@pytest.mark.parametrize("thing", _things(("chair", "desk_chair", "sofa")))
def test_the_back_of_a_seat_is_behind_it(thing):
    high = thing.mesh.vertices[thing.mesh.vertices[:, 2] > thing.places["seat"][2, 3] + 0.28]
    assert np.median(high[:, 0]) < thing.places["seat"][0, 3] - 0.1


@pytest.mark.parametrize("thing", _things(("suitcase", "trolley", "bag", "cup")))
def test_a_bar_runs_through_the_handle_along_y(thing):
    T = thing.places["handle"]
    assert np.allclose(T[:3, :3].T @ T[:3, :3], np.eye(3)) and np.linalg.det(T[:3, :3]) > 0
    near = (thing.mesh.vertices - T[:3, 3]) @ T[:3, :3]
    bar = near[(np.abs(near[:, [0, 2]]) < 0.02).all(axis=1) & (np.abs(near[:, 1]) < 0.12)]
    assert len(bar) >= 8 and np.ptp(bar[:, 1]) > 0.03
    assert near[:, 2].max() < 0.03


def test_a_carried_case_clears_the_floor():
    heights = [THINGS["suitcase"](np.random.default_rng(s)).places["handle"][2, 3]
               for s in range(30)]  # fmt: skip
    assert max(heights) < 0.68


@pytest.mark.parametrize("thing", _things(("guitar",)))
def test_hands_on_a_guitar_lie_before_its_face(thing):
    neck, strings = thing.places["neck"][:3, 3], thing.places["strings"][:3, 3]
    assert neck[2] - strings[2] > 0.3
    vertices = thing.mesh.vertices
    for place in (neck, strings):
        assert np.abs(vertices - place)[:, [0, 2]].min(axis=0).max() < 0.2
        around = vertices[np.abs(vertices[:, 2] - place[2]) < 0.15]
        assert place[0] == pytest.approx(around[:, 0].max(), abs=0.03)


@pytest.mark.parametrize("thing", _things(("box",)))
def test_two_hands_find_the_sides_of_a_box(thing):
    left, right = thing.places["left"], thing.places["right"]
    assert left[1, 3] == -right[1, 3] > 0.1
    assert left[:3, 0].tolist() == right[:3, 0].tolist() == [1, 0, 0]
    assert left[:3, 2].tolist() == [0, 1, 0] and right[:3, 2].tolist() == [0, -1, 0]
    assert np.linalg.det(left[:3, :3]) == np.linalg.det(right[:3, :3]) == 1


def test_training_never_sees_what_is_held_out():
    assert len(OCCLUDERS) == 9 and set(OCCLUDERS) <= set(THINGS)
    assert len(HELD_OUT) == 2 and set(HELD_OUT) <= set(OCCLUDERS)
    assert set(training_things()) | set(held_out_things()) == set(THINGS)
    assert not set(training_things()) & set(held_out_things())
    assert "suitcase" in training_things()


def test_some_seats_hardly_reflect_the_sensor_and_others_do():
    darkest = [min(m.infrared for m in sofa(np.random.default_rng(s)).mesh.materials)
               for s in range(30)]  # fmt: skip
    assert min(darkest) < 0.12 and max(darkest) > 0.2
