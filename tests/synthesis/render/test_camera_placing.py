# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.errors import SceneError
from kintrack.geometry import invert_rigid, transform_points
from synthesis.render.placing import level_camera, looking_at


def test_a_level_camera_sees_up_as_up_and_itself_nowhere():
    ahead = transform_points(invert_rigid(level_camera(2.6, 1.0)), np.array([[0.0, 0.0, 1.5]]))
    assert np.allclose(ahead, [[0.0, -0.5, 2.6]])


def test_the_target_lies_on_the_axis_and_the_horizon_is_level():
    rng = np.random.default_rng(0)
    for position, target in rng.normal(size=(20, 2, 3)):
        T = looking_at(position, target)
        at = transform_points(invert_rigid(T), target[None])[0]
        assert np.allclose(at, [0.0, 0.0, np.linalg.norm(target - position)])
        assert T[2, 0] == pytest.approx(0.0)
        assert T[2, 1] < 0.0
        assert np.allclose(T[:3, :3].T @ T[:3, :3], np.eye(3))
        assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)


def test_both_ways_to_place_a_camera_agree():
    T = looking_at(np.array([2.6, 0.0, 1.0]), np.array([0.0, 0.0, 1.0]))
    assert np.allclose(T, level_camera(2.6, 1.0))


def test_a_camera_may_look_straight_down():
    T = looking_at(np.array([0.0, 0.0, 3.0]), np.zeros(3))
    assert np.allclose(transform_points(invert_rigid(T), np.zeros((1, 3))), [[0.0, 0.0, 3.0]])
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)


def test_a_camera_that_looks_at_itself_is_refused():
    with pytest.raises(SceneError, match="cannot look at"):
        looking_at(np.ones(3), np.ones(3))
