# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.errors import SceneError
from kintrack.geometry import PinholeCamera, invert_rigid, transform_points
from kintrack.raster import rasterise
from synthesis.mesh import Material
from synthesis.objects.bars import put
from synthesis.objects.catalogue import THINGS, held_out_things, training_things
from synthesis.objects.plan import CAMERA_CLEAR_M, CLEAR_M, KNEE_M, Plan, Rect, thinned
from synthesis.objects.rooms import MOST_FACES, room
from synthesis.objects.shapes import cylinder
from synthesis.patterns import Plain

CAMERA = PinholeCamera(160, 132, 114.0, 114.0, 79.5, 65.5)
SEEDS = range(10)


def _camera(seed):
    rng = np.random.default_rng((seed, 1))
    azimuth, distance = rng.uniform(0, 6.28), rng.uniform(1.8, 4.0)
    eye = np.array([distance * np.cos(azimuth), distance * np.sin(azimuth), rng.uniform(0.6, 1.9)])
    z = np.array([0, 0, 0.9]) - eye
    z /= np.linalg.norm(z)
    x = np.cross(z, [0, 0, 1])
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.stack([x, np.cross(z, x), z], axis=1), eye
    return T


def _path(seed):
    return np.cumsum(np.random.default_rng((seed, 2)).normal(0, 0.06, (40, 2)), axis=0)


@pytest.fixture(scope="module")
def rooms():
    return {s: room(np.random.default_rng(s), _path(s), _camera(s)[:3, 3], _camera(s))
            for s in SEEDS}  # fmt: skip


@pytest.mark.parametrize("seed", SEEDS)
def test_nothing_stands_where_the_person_or_the_camera_is(rooms, seed):
    vertices = rooms[seed].vertices
    tall = vertices[(vertices[:, 2] > 0.03) & (vertices[:, 2] < 2.0)]
    away = np.linalg.norm(tall[:, None, :2] - _path(seed)[None], axis=2)
    assert away.min() > CLEAR_M - 0.05
    assert np.linalg.norm(tall[:, :2] - _camera(seed)[:2, 3], axis=1).min() > CAMERA_CLEAR_M - 0.1


@pytest.mark.parametrize("seed", SEEDS)
def test_a_person_is_in_sight_above_the_knees_however_tall_things_are(seed):
    T = _camera(seed)
    T_camera_world = invert_rigid(T)
    tall = {name: THINGS["cabinet"] for name in ("chair", "lamp", "box", "bin", "ball", "plant")}
    mesh = room(np.random.default_rng(seed), _path(seed), T[:3, 3], T, things=tall)
    ahead, _ = rasterise(transform_points(T_camera_world, mesh.vertices), mesh.faces, CAMERA)
    for place in _path(seed)[::8]:
        body = cylinder(0.15, 1.7 - KNEE_M - 0.1, Material(Plain((0.5, 0.5, 0.5))))
        body = put(body, (*place, KNEE_M + 0.1))
        points = transform_points(T_camera_world, body.vertices)
        seen, _ = rasterise(points, body.faces, CAMERA)
        assert np.isfinite(seen).sum() > 100
        assert (seen <= ahead)[np.isfinite(seen)].all()


@pytest.mark.parametrize("seed", SEEDS)
def test_a_room_is_one_mesh_on_the_floor_and_not_too_fine(rooms, seed):
    mesh = rooms[seed]
    assert np.isfinite(mesh.vertices).all() and np.isfinite(mesh.coords).all()
    assert 100 < len(mesh.faces) <= MOST_FACES
    assert mesh.vertices[:, 2].min() > -0.02 and mesh.vertices[:, 2].max() < 3.2
    assert not mesh.labels.any()


def _first_hit(mesh, origin, ray):
    """Distance along a ray to a mesh (Moeller & Trumbore 1997), inf if it meets none."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    p = np.cross(ray, c - a)
    with np.errstate(all="ignore"):
        scale = 1.0 / np.einsum("fi,fi->f", b - a, p)
        u = np.einsum("fi,fi->f", origin - a, p) * scale
        q = np.cross(origin - a, b - a)
        v, t = q @ ray * scale, np.einsum("fi,fi->f", c - a, q) * scale
        return np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf).min()


@pytest.mark.parametrize("seed", SEEDS)
def test_walls_end_every_level_view_and_none_stands_before_the_person(rooms, seed):
    T, middle = _camera(seed), _path(seed).mean(axis=0)
    origin = T[:3, 3] * [1, 1, 0] + [0, 0, 1.3]
    to_person = np.append(middle - origin[:2], 0.0)
    assert 1.2 < _first_hit(rooms[seed], origin, to_person) < 8.0  # in distances to the person
    for azimuth in np.linspace(0, 6, 9):
        ray = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        assert CAMERA_CLEAR_M - 0.1 < _first_hit(rooms[seed], origin, ray) < 20.0


def test_rooms_differ_and_the_same_seed_gives_the_same_bytes(rooms):
    again = room(np.random.default_rng(3), _path(3), _camera(3)[:3, 3], _camera(3))
    assert again.vertices.tobytes() == rooms[3].vertices.tobytes()
    assert again.coords.tobytes() == rooms[3].coords.tobytes()
    assert again.face_material.tobytes() == rooms[3].face_material.tobytes()
    counts = [len(mesh.faces) for mesh in rooms.values()]
    assert len(set(counts)) == len(counts) and max(counts) > 2 * min(counts)


def test_only_the_given_kinds_are_used():
    drawn = set()

    def spy(name):
        def make(rng):
            drawn.add(name)
            return THINGS[name](rng)

        return make

    for seed in range(6):
        kinds = {name: spy(name) for name in (*training_things(), *held_out_things())
                 if name not in ("sofa", "chair")}  # fmt: skip
        room(np.random.default_rng(seed), _path(0), _camera(0)[:3, 3], _camera(0), things=kinds)
    assert len(drawn) > 12 and not drawn & {"sofa", "chair"}


@pytest.mark.parametrize("things", [{}, held_out_things()])
def test_few_or_no_kinds_still_make_a_room(things):
    mesh = room(np.random.default_rng(1), _path(0), _camera(0)[:3, 3], _camera(0), things=things)
    assert len(mesh.faces) > 100


def test_a_camera_that_looks_straight_down_still_gets_a_room():
    T = np.diag([1.0, -1.0, -1.0, 1.0])
    T[:3, 3] = [1.5, 0, 2.4]
    assert len(room(np.random.default_rng(0), _path(0), T[:3, 3], T).faces) > 100


@pytest.mark.parametrize("places", [np.zeros((0, 2)), np.full((3, 2), np.nan)])
def test_a_person_who_is_nowhere_is_refused(places):
    with pytest.raises(SceneError, match="places to keep clear"):
        room(np.random.default_rng(0), places, _camera(0)[:3, 3], _camera(0))


def test_the_distance_from_a_turned_rectangle():
    rect = Rect(np.array([1.0, 0.0]), np.array([2.0, 1.0]), np.pi / 2)
    points = np.array([[1.0, 0.9], [1.0, 2.0], [2.0, 0.0], [1.8, 1.4]])
    assert rect.distance(points) == pytest.approx([0.0, 1.0, 0.5, 0.5])


def test_rectangles_meet_when_they_come_nearer_than_the_gap():
    a = Rect(np.zeros(2), np.array([1.0, 1.0]))
    assert a.meets(Rect(np.array([1.02, 0]), np.array([1.0, 1.0])))
    assert not a.meets(Rect(np.array([1.05, 0]), np.array([1.0, 1.0])))
    assert not a.meets(Rect(np.array([0.9, 0.9]), np.array([1.0, 0.2]), -np.pi / 4))
    assert a.meets(Rect(np.array([0.6, 0.6]), np.array([1.0, 0.4]), -np.pi / 4))


def test_low_things_may_stand_in_the_line_of_sight_and_high_ones_beside_it():
    plan = Plan(
        np.array([[0.0, 0.0]]), np.array([-3.0, 0.0, 1.2]), np.full(2, -5.0), np.full(2, 5.0)
    )
    size = np.array([0.4, 0.4])
    assert plan.free(Rect(np.array([-1.5, 0.0]), size), 0.5)
    assert not plan.free(Rect(np.array([-1.5, 0.0]), size), 1.0)
    assert plan.free(Rect(np.array([-1.5, 0.6]), size), 1.9)
    assert not plan.free(Rect(np.array([0.4, 0.0]), size), 0.1)
    assert not plan.free(Rect(np.array([-3.0, 0.5]), size), 0.1)
    assert not plan.free(Rect(np.array([4.9, 0.0]), size), 0.1)
    assert plan.free(Rect(np.array([2.0, 0.0]), size), 2.0)
    plan.taken.append(Rect(np.array([2.1, 0.1]), size))
    assert not plan.free(Rect(np.array([2.0, 0.0]), size), 2.0)


def test_thinning_keeps_every_place_within_reach():
    points = np.random.default_rng(0).uniform(0, 1, (2000, 2))
    kept = thinned(points)
    gap = np.linalg.norm(points[:, None] - kept[None], axis=2).min(axis=1)
    assert len(kept) < 500 and gap.max() < 0.036
