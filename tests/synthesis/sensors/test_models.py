# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from synthesis.demo import KINECT_V1
from synthesis.render.camera import look
from synthesis.sensors.models import (
    EDGE_M,
    GRAZING_RAD,
    SENSORS,
    kinect_v1,
    kinect_v2,
    perfect,
    time_of_flight_sigma_m,
)


def _plane(depth_m, tilt_deg=0.0, half_m=10.0):
    tilt = np.radians(tilt_deg)
    x, y = np.meshgrid([-half_m, half_m], [-half_m, half_m])
    z = depth_m + y * np.sin(tilt)
    corners = np.stack([x, y * np.cos(tilt), z], axis=-1).reshape(-1, 3)
    return look(corners, np.array([[0, 1, 2], [1, 3, 2]]), KINECT_V1, np.eye(4))


def _two_planes():
    near, far = (np.array([[-9, -9, z], [s, -9, z], [-9, 9, z], [s, 9, z]]) for z, s in _EXTENTS)
    faces = np.array([[0, 1, 2], [1, 3, 2]])
    return look(np.vstack([near, far]), np.vstack([faces, faces + 4]), KINECT_V1, np.eye(4))


_EXTENTS = ((2.0, 0.0), (3.0, 9.0))


@pytest.mark.parametrize("depth_m", [1.5, 2.8, 4.0])
def test_structured_light_errs_as_khoshelham_and_elberink_measured(depth_m):
    tilted = _plane(depth_m, tilt_deg=8.0)
    frames = [kinect_v1(tilted, np.random.default_rng(n)) - tilted.depth_m for n in range(4)]
    near = np.abs(tilted.depth_m - depth_m) < 0.1
    assert np.stack(frames)[:, near].std() == pytest.approx(1.425e-3 * depth_m**2, rel=0.08)
    assert abs(np.stack(frames)[:, near].mean()) < 0.1 * 1.425e-3 * depth_m**2


def test_structured_light_has_steps_of_23_mm_at_2_8_metres():
    levels = np.unique(kinect_v1(_plane(2.8), np.random.default_rng(0)))
    assert np.all(np.abs(np.diff(levels) - 0.0229) < 1e-3)


def test_structured_light_invents_nothing_between_two_surfaces():
    depth = kinect_v1(_two_planes(), np.random.default_rng(0))
    assert not np.any((depth > 2.1) & (depth < 2.9))


def test_structured_light_frays_edges_by_about_a_sample():
    labels = kinect_v1(_two_planes(), np.random.default_rng(0)) < 2.5
    edge_samples = 2.0 * (labels.sum(axis=1) - KINECT_V1.cx)
    assert 0.5 < edge_samples.std() < 2.5 and abs(edge_samples.mean()) < 2.0


@pytest.mark.parametrize(("depth_m", "tilt_deg"), [(1.0, 0.0), (3.0, 0.0), (2.0, 55.0)])
def test_time_of_flight_errs_as_fankhauser_measured(depth_m, tilt_deg):
    view = _plane(depth_m, tilt_deg, half_m=10.0 if tilt_deg == 0.0 else 1.2)
    centre = np.s_[118:123, 100:220]
    error = np.stack(
        [(kinect_v2(view, np.random.default_rng(n)) - view.depth_m)[centre] for n in range(20)]
    )
    expected = time_of_flight_sigma_m(view.depth_m[centre], view.sample_angle_rad[::2, ::2][centre])
    assert error.std() == pytest.approx(np.sqrt(np.mean(expected**2)), rel=0.08)


def test_time_of_flight_flies_at_edges_only():
    view = _two_planes()
    depth = kinect_v2(view, np.random.default_rng(0))
    off = np.abs(depth - view.depth_m) > EDGE_M
    columns = np.argwhere(off)[:, 1]
    assert 0.1 < off[:, 160].mean() < 0.5
    assert np.all(np.abs(columns - KINECT_V1.cx) <= 1)


def test_time_of_flight_loses_grazing_surfaces():
    view = _plane(2.0, tilt_deg=72.0, half_m=1.5)
    angle = view.sample_angle_rad[::2, ::2]
    lost = kinect_v2(view, np.random.default_rng(0)) == 0
    assert not np.any(lost[(angle < GRAZING_RAD[0]) & (view.depth_m > 0)])
    assert lost[angle > np.radians(77.5)].mean() > 0.4


@pytest.mark.parametrize("name", list(SENSORS))
def test_a_sensor_sees_nothing_where_nothing_is_and_repeats_with_its_seed(name):
    view = _plane(2.0, half_m=0.4)
    first, second = (SENSORS[name](view, np.random.default_rng(5)) for _ in range(2))
    assert np.array_equal(first, second)
    assert first.shape == view.depth_m.shape and not first[:, :20].any()
    assert np.all(np.isfinite(first)) and first.min() >= 0.0


def test_a_perfect_sensor_reports_the_truth():
    view = _plane(2.0)
    assert np.array_equal(perfect(view, np.random.default_rng(0)), view.depth_m)
