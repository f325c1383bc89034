# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
import trimesh

from kintrack.body import run_kinematics
from kintrack.errors import ModelError
from kintrack.human import posed
from kintrack.skin import (
    load_skin,
    skinned_vertices,
    vertex_jacobians,
    vertex_normals,
)

POSES = range(5)
SOME = np.arange(0, 2800, 97)


@pytest.fixture(scope="module")
def display():
    return load_skin("display")


@pytest.fixture(scope="module")
def standing(body):
    return run_kinematics(body, body.neutral())


@pytest.fixture(scope="module")
def mesh(human, standing):
    return trimesh.Trimesh(skinned_vertices(standing, human.skin), human.skin.faces, process=False)


@pytest.mark.parametrize("resolution", ["tracking", "display"])
def test_every_vertex_has_four_weights_that_sum_to_one(resolution):
    skin = load_skin(resolution)
    assert skin.weights.shape == skin.links.shape == (len(skin.labels), 4)
    assert (skin.weights >= 0).all()
    assert np.allclose(skin.weights.sum(axis=1), 1.0, atol=1e-6)
    assert skin.links.min() >= 0 and skin.links.max() < len(skin.link_names)


def test_both_skins_hang_on_the_links_of_the_body(body, human, display):
    assert human.skin.link_names == display.link_names == body.link_names


def test_the_tracking_skin_is_closed_in_one_piece_and_faces_outwards(human, mesh):
    assert 2000 <= len(human.skin.labels) <= 4000
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert mesh.body_count == 1
    assert 0.055 < mesh.volume < 0.080  # an adult of 1.7 m holds about 65 l


def test_the_display_skin_is_finer(human, display):
    assert len(display.labels) > 3 * len(human.skin.labels)


def test_the_tracking_skin_is_evenly_spaced(mesh):
    """Measured: edges of 20 to 32 mm between the 5th and 95th percentile, a ratio of 1.6."""
    p5, p50, p95 = np.percentile(mesh.edges_unique_length, [5, 50, 95])
    assert p95 / p5 < 2.0
    assert 0.015 < p50 < 0.04
    assert mesh.edges_unique_length.max() < 2.5 * p50


@pytest.mark.parametrize("resolution", ["tracking", "display"])
def test_all_parts_are_labelled_on_their_side(resolution, standing):
    skin = load_skin(resolution)
    y = skinned_vertices(standing, skin)[:, 1]
    assert set(np.unique(skin.labels)) == set(range(1, 7))
    for right, left in ((3, 4), (5, 6)):
        assert (y[skin.labels == right] < 0).all()
        assert (y[skin.labels == left] > 0).all()
        counts = np.sum(skin.labels == right), np.sum(skin.labels == left)
        assert counts[0] == pytest.approx(counts[1], rel=0.1)


def test_labels_follow_the_links(human):
    strongest = human.skin.links[
        np.arange(len(human.skin.labels)), human.skin.weights.argmax(axis=1)
    ]
    names = np.array(human.skin.link_names)[strongest]
    for label, stem in (
        (1, "head"),
        (3, "r_forearm"),
        (4, "l_hand"),
        (5, "r_shank"),
        (6, "l_foot"),
    ):
        assert (human.skin.labels[names == stem] == label).all(), stem


def test_moving_the_root_moves_the_skin_rigidly(human, body, legal_pose):
    q = legal_pose(3)
    moved = q.copy()
    moved[:3], moved[3:7] = legal_pose(4)[:3], legal_pose(4)[3:7]
    a, b = (run_kinematics(body, x) for x in (q, moved))
    T = b.Ts_world_link[0] @ np.linalg.inv(a.Ts_world_link[0])
    expected = skinned_vertices(a, human.skin) @ T[:3, :3].T + T[:3, 3]
    assert np.allclose(skinned_vertices(b, human.skin), expected, atol=1e-6)


def test_a_rigidly_bound_vertex_moves_with_its_link(human, body, legal_pose):
    skin = human.skin
    rigid = np.flatnonzero(skin.weights.max(axis=1) > 1 - 1e-7)
    assert len(rigid) > 100
    state = run_kinematics(body, legal_pose(5))
    b = skin.weights[rigid].argmax(axis=1)
    T = state.Ts_world_link[skin.links[rigid, b]]
    expected = np.einsum("vij,vj->vi", T[:, :3, :3], skin.points_link[rigid, b]) + T[:, :3, 3]
    assert np.allclose(skinned_vertices(state, skin)[rigid], expected, atol=1e-6)


@pytest.mark.parametrize("seed", POSES)
def test_vertex_jacobians_agree_with_differences(human, body, legal_pose, differences, seed):
    q = legal_pose(seed)
    numeric = differences(lambda state: skinned_vertices(state, human.skin)[SOME], q)
    assert np.allclose(
        vertex_jacobians(run_kinematics(body, q), human.skin, SOME), numeric, atol=1e-7
    )


@pytest.mark.parametrize("seed", POSES)
def test_normals_are_unit_and_agree_with_trimesh(human, body, legal_pose, seed):
    vertices = skinned_vertices(run_kinematics(body, legal_pose(seed)), human.skin)
    normals = vertex_normals(vertices, human.skin.faces)
    assert np.allclose(np.linalg.norm(normals, axis=1), 1.0)
    mesh = trimesh.Trimesh(vertices, human.skin.faces, process=False)
    corners, areas = mesh.triangles, mesh.area_faces
    face_normals = trimesh.triangles.cross(corners) / np.maximum(2 * areas, 1e-30)[:, None]
    expected = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(expected, human.skin.faces[:, k], face_normals * areas[:, None])
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    assert np.allclose(normals, expected, atol=1e-6)


def test_normals_point_out_of_a_body_with_its_arms_away_from_the_trunk(human, body):
    state = run_kinematics(body, posed(body, {"shoulder_elevation": 60}))
    vertices = skinned_vertices(state, human.skin)
    mesh = trimesh.Trimesh(vertices, human.skin.faces, process=False)
    normals = vertex_normals(vertices, human.skin.faces)
    assert not mesh.contains(vertices + 0.004 * normals).any()
    assert mesh.contains(vertices - 0.004 * normals).mean() > 0.99


@pytest.mark.parametrize("seed", range(3))
def test_display_and_tracking_skin_lie_together_at_legal_poses(
    human, display, body, legal_pose, seed
):
    """Fingers, the pelvis' cleft and the inside of the mouth are simpler in the tracking skin."""
    state = run_kinematics(body, legal_pose(seed))
    coarse, fine = skinned_vertices(state, human.skin), skinned_vertices(state, display)
    distance = trimesh.proximity.closest_point(
        trimesh.Trimesh(fine, display.faces, process=False), coarse
    )[1]
    strongest = human.skin.links[np.arange(len(coarse)), human.skin.weights.argmax(axis=1)]
    names = np.array(human.skin.link_names)[strongest]
    simple = np.isin(names, ["l_hand", "r_hand", "pelvis"])
    assert distance[~simple].max() < 0.012
    assert np.percentile(distance[~simple], 99) < 0.01
    assert np.percentile(distance, 95) < 0.01
    assert distance.max() < 0.035


def test_an_unknown_resolution_is_answered_with_the_known_ones():
    with pytest.raises(ModelError, match="'coarse'.*'tracking' or 'display'"):
        load_skin("coarse")


def test_the_shape_moves_the_skin_linearly(standing):
    average, plus, minus = (load_skin(shape=np.array([b])) for b in (0.0, 1.0, -1.0))
    middle = 0.5 * (plus.points_link + minus.points_link)
    assert np.allclose(middle, average.points_link, atol=1e-6)
    assert np.abs(plus.points_link - average.points_link).max() > 0.01
