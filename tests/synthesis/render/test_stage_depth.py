# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from stage_shapes import CAMERA, DAY, PAPER, box, floor, sphere

from kintrack.errors import SceneError
from synthesis.albedo import Plain
from synthesis.mesh import Material, join
from synthesis.render.cast import camera_rays
from synthesis.render.placing import looking_at
from synthesis.render.stage import Stage

EXACT_M = 1e-4
T_WORLD_CAMERA = looking_at(np.array([3.0, 0.4, 1.6]), np.array([0.0, 0.0, 0.6]))
RAYS = camera_rays(CAMERA, T_WORLD_CAMERA)


def _look(fixed=None, moving=None, T=T_WORLD_CAMERA, color=False):
    return Stage(fixed, moving, DAY).view(None, CAMERA, T, color)


def _box_depth(low, high):
    """Where rays enter a box (Kay & Kajiya 1986), 0 = never."""
    d = RAYS.directions
    ends = np.sort([(low - RAYS.origin) / d, (high - RAYS.origin) / d], axis=0)
    enter, leave = ends[0].max(axis=1), ends[1].min(axis=1)
    return np.where(enter < leave, enter, 0.0).reshape(CAMERA.height, CAMERA.width)


def test_a_floor_is_as_deep_as_its_plane_says():
    depth = _look(floor(50.0)).depth_m
    z = RAYS.directions[:, 2].reshape(depth.shape)
    expected = np.where(z < 0, -RAYS.origin[2] / np.minimum(z, -1e-9), 0.0)
    near = (expected > 0) & (expected < 12.0)
    assert near.mean() > 0.5
    assert np.abs(depth - expected)[near].max() < 1e-9


def test_a_box_is_as_deep_as_its_slabs_say():
    low, high = np.array([-0.5, -0.7, 0.0]), np.array([0.4, 0.6, 1.2])
    depth, expected = _look(box(low, high)).depth_m, _box_depth(low, high)
    both = (depth > 0) & (expected > 0)
    assert np.sum((depth > 0) != (expected > 0)) <= 2
    assert np.abs(depth - expected)[both].max() < EXACT_M


def test_a_sphere_is_as_deep_as_its_equation_says():
    center, radius = np.array([0.0, 0.0, 0.7]), 0.5
    depth = _look(sphere(center, radius, rows=400)).depth_m.ravel()
    d, m = RAYS.directions, RAYS.origin - center
    a, b, c = (d * d).sum(axis=1), d @ m, m @ m - radius**2
    inside = b * b - a * c
    expected = (-b - np.sqrt(np.maximum(inside, 0.0))) / a
    middle = inside / a > (0.3 * radius) ** 2
    assert middle.sum() > 500
    assert np.abs(depth - expected)[middle].max() < EXACT_M


def test_the_angle_of_a_floor_is_that_of_the_ray():
    view = _look(floor(50.0))
    d = RAYS.directions.reshape(CAMERA.height, CAMERA.width, 3)
    cosine = np.abs(d[..., 2]) / np.linalg.norm(d, axis=-1)
    seen = view.depth_m > 0
    assert np.allclose(view.angle_rad[seen], np.arccos(cosine)[seen], atol=1e-9)
    assert np.all(view.angle_rad[~seen] == 0)


def test_the_nearest_is_seen_whichever_part_moves():
    one, other = box([-0.5, -0.5, 0], [0.2, 0.1, 0.9]), sphere([0.3, 0.3, 0.5], 0.4)
    views = [
        _look(one, other, color=True),
        _look(other, one, color=True),
        _look(join([one, other]), color=True),
        _look(None, join([other, one]), color=True),
    ]
    for view in views[1:]:
        assert np.allclose(view.depth_m, views[0].depth_m, atol=1e-9)
        assert np.allclose(view.angle_rad, views[0].angle_rad, atol=1e-6)


def test_labels_and_infrared_are_those_of_the_nearest_surface():
    dark = Material(Plain((0.1, 0.1, 0.1)), infrared=0.25, gloss=0.2)
    ball = sphere([0.0, 0.0, 0.6], 0.4, material=dark, label=2)
    view = _look(floor(50.0), ball)
    on_ball = view.labels == 2
    assert 300 < on_ball.sum() < on_ball.size / 2
    assert np.allclose(view.infrared[on_ball], 0.25 * 0.8)
    assert np.allclose(view.infrared[~on_ball & (view.depth_m > 0)], PAPER.infrared)
    assert np.all(view.infrared[view.depth_m == 0] == 0)


def test_a_triangle_has_the_label_of_most_of_its_corners():
    mesh = floor(50.0, labels=np.array([3, 3, 5, 5], np.uint8))
    view = _look(None, mesh)
    d = RAYS.directions.reshape(CAMERA.height, CAMERA.width, 3)
    place = RAYS.origin + view.depth_m[..., None] * d
    seen = (view.depth_m > 0) & (np.abs(place[..., 0] - place[..., 1]) > 1e-3)
    expected = np.where(place[..., 0] > place[..., 1], 3, 5)
    assert np.array_equal(view.labels[seen], expected[seen])


def test_what_moves_right_up_to_the_camera_is_still_seen():
    wall = box([2.0, -5.0, -5.0], [3.5, 5.0, 5.0])
    inside = _look(None, wall)
    assert np.all(inside.depth_m > 0)


def test_nothing_is_seen_behind_the_camera():
    behind = looking_at(np.array([3.0, 0.0, 1.0]), np.array([6.0, 0.0, 1.0]))
    assert not _look(None, sphere([0.0, 0.0, 1.0], 0.5), T=behind).depth_m.any()
    assert not _look(sphere([0.0, 0.0, 1.0], 0.5), T=behind).depth_m.any()


def test_an_empty_stage_is_empty():
    view = _look(color=True)
    assert view.depth_m.shape == (CAMERA.height, CAMERA.width)
    assert not view.depth_m.any()
    assert not view.labels.any()
    assert np.isfinite(view.color).all()


def test_vertices_that_do_not_fit_or_are_not_finite_are_refused():
    ball = sphere([0.0, 0.0, 0.6], 0.4, rows=8)
    stage = Stage(None, ball, DAY)
    with pytest.raises(SceneError, match="shape"):
        stage.view(ball.vertices[1:], CAMERA, T_WORLD_CAMERA)
    broken = ball.vertices.copy()
    broken[7, 1] = np.nan
    with pytest.raises(SceneError, match="vertex 7"):
        stage.view(broken, CAMERA, T_WORLD_CAMERA)
