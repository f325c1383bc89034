# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kintrack.errors import ConfigError
from kintrack.geometry import (
    LABELS,
    T_LEVEL_WORLD_CAMERA,
    PinholeCamera,
    camera_pose,
    huber_weights,
    invert_rigid,
    robust_scale,
    transform_points,
    tukey_weights,
)

CAMERA = PinholeCamera(width=9, height=7, fx=11.0, fy=13.0, cx=4.2, cy=2.9)


def random_rigid(rng, count):
    Ts = np.tile(np.eye(4), (count, 1, 1))
    Ts[:, :3, :3] = Rotation.random(count, random_state=0).as_matrix()
    Ts[:, :3, 3] = rng.normal(size=(count, 3))
    return Ts


def test_back_projected_pixels_project_onto_themselves():
    depth = np.random.default_rng(0).uniform(0.5, 5.0, (7, 9))
    points = CAMERA.back_project(depth)
    v, u = np.mgrid[:7, :9]
    assert np.allclose(CAMERA.project(points), np.stack([u, v], axis=-1))
    assert np.array_equal(points[..., 2], depth)


def test_the_principal_point_looks_straight_ahead():
    assert np.allclose(CAMERA.project(np.array([0.0, 0.0, 3.0])), [4.2, 2.9])


def test_right_in_space_is_right_in_the_image_and_down_is_down():
    pixel = CAMERA.project(np.array([[0.1, 0.0, 1.0], [0.0, 0.1, 1.0]]))
    assert np.allclose(pixel, [[4.2 + 1.1, 2.9], [4.2, 2.9 + 1.3]])


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf, -np.inf])
def test_pixels_without_a_reading_have_no_point(bad):
    depth = np.full((7, 9), 2.0)
    depth[3, 5] = bad
    points = CAMERA.back_project(depth)
    assert np.array_equal(points[3, 5], np.zeros(3))
    assert np.count_nonzero(points[..., 2]) == 62


@pytest.mark.parametrize("factor", [1, 2, 3, 4])
def test_a_scaled_camera_sees_the_thinned_image(factor):
    thin = CAMERA.scaled(factor)
    depth = np.random.default_rng(1).uniform(0.5, 5.0, (7, 9))
    expected = CAMERA.back_project(depth)[::factor, ::factor]
    assert (thin.height, thin.width) == expected.shape[:2]
    assert np.allclose(thin.back_project(depth[::factor, ::factor]), expected)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("width", 0),
        ("width", -3),
        ("width", 640.0),
        ("height", True),
        ("height", "480"),
        ("fx", 0.0),
        ("fx", -5.0),
        ("fy", float("nan")),
        ("fy", float("inf")),
        ("cx", float("nan")),
        ("cy", float("-inf")),
    ],
)
def test_a_bad_camera_names_its_field_and_value(field, value):
    good = {"width": 9, "height": 7, "fx": 11.0, "fy": 13.0, "cx": 4.2, "cy": 2.9}
    with pytest.raises(ConfigError) as caught:
        PinholeCamera(**(good | {field: value}))
    assert f"{field} = {value!r}" in str(caught.value)


def test_a_level_camera_looks_along_world_x_with_z_up():
    ahead, right, down = np.eye(3)[2], np.eye(3)[0], np.eye(3)[1]
    R = T_LEVEL_WORLD_CAMERA[:3, :3]
    assert np.array_equal(R @ ahead, [1, 0, 0])
    assert np.array_equal(R @ right, [0, -1, 0])
    assert np.array_equal(R @ down, [0, 0, -1])
    assert np.array_equal(camera_pose(0.0), T_LEVEL_WORLD_CAMERA)


@pytest.mark.parametrize("pitch_deg", [-90.0, -20.0, 35.0, 90.0])
def test_a_pitched_camera_looks_down_by_its_angle_and_stays_upright(pitch_deg):
    T = camera_pose(pitch_deg)
    view = T[:3, :3] @ [0, 0, 1]
    assert np.degrees(np.arcsin(-view[2])) == pytest.approx(pitch_deg)
    assert np.allclose(T[:3, :3] @ [1, 0, 0], [0, -1, 0])
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)


@pytest.mark.parametrize("pitch_deg", [-90.1, 91.0, float("nan"), float("inf")])
def test_an_impossible_pitch_names_the_value_and_the_range(pitch_deg):
    with pytest.raises(ConfigError, match=r"pitch = .*-90 to 90") as caught:
        camera_pose(pitch_deg)
    assert repr(pitch_deg) in str(caught.value)


def test_inverse_transforms_cancel_alone_and_in_stacks():
    Ts = random_rigid(np.random.default_rng(2), 5)
    assert np.allclose(invert_rigid(Ts) @ Ts, np.eye(4))
    assert np.allclose(invert_rigid(Ts[0]), np.linalg.inv(Ts[0]))


def test_transformed_points_agree_with_homogeneous_coordinates():
    rng = np.random.default_rng(3)
    T, points = random_rigid(rng, 1)[0], rng.normal(size=(4, 6, 3))
    homogeneous = np.concatenate([points, np.ones((4, 6, 1))], axis=-1)
    assert np.allclose(transform_points(T, points), (homogeneous @ T.T)[..., :3])


def test_tukey_keeps_the_centre_and_drops_what_is_far():
    weights = tukey_weights(np.array([0.0, 0.5, -0.5, 4.7, -100.0]), scale=1.0)
    assert weights[0] == 1.0
    assert weights[1] == weights[2] == pytest.approx((1 - (0.5 / 4.685) ** 2) ** 2)
    assert np.array_equal(weights[3:], [0.0, 0.0])


def test_huber_bounds_the_pull_of_a_residual():
    r = np.array([-1.0, 1.345, 10.0, -1000.0])
    weights = huber_weights(r, scale=1.0)
    assert np.allclose(weights[:2], 1.0)
    assert np.allclose(np.abs(weights * r)[2:], 1.345)


def test_weights_scale_with_the_residuals_unit():
    r = np.linspace(-3, 3, 13)
    for weights in (tukey_weights, huber_weights):
        assert np.allclose(weights(r, 0.7), weights(1000 * r, 700.0))


def test_the_robust_scale_is_the_deviation_of_normal_noise_with_outliers():
    r = np.random.default_rng(4).normal(0.0, 0.02, 20_000)
    assert robust_scale(r) == pytest.approx(0.02, rel=0.03)
    r[:2000] = 50.0
    assert robust_scale(r) == pytest.approx(0.02, rel=0.2)


def test_labels_are_in_the_agreed_order():
    assert LABELS == (
        "background",
        "head",
        "torso",
        "right_arm",
        "left_arm",
        "right_leg",
        "left_leg",
    )
