# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from sensor_views import frames, plane, screen

from synthesis.sensors.kinect_v2 import KinectV2, time_of_flight_sigma_m

SENSOR = KinectV2()
CENTRE = np.s_[..., 202:222, 246:266]


@pytest.mark.parametrize(("depth_m", "tilt_deg"), [(1.0, 0.0), (3.0, 0.0), (4.2, 0.0), (2.0, 60.0)])
def test_it_errs_as_fankhauser_measured(depth_m, tilt_deg):
    view = plane(SENSOR, depth_m, tilt_deg)
    sigma = frames(SENSOR, view, 40)[CENTRE].std(axis=0, ddof=1)
    expected = time_of_flight_sigma_m(view.depth_m[CENTRE], view.angle_rad[CENTRE])
    assert np.mean(sigma) == pytest.approx(np.mean(expected), rel=0.1)


def test_the_published_error_is_2_7_mm_at_3_metres():
    sigma = time_of_flight_sigma_m(np.array([3.0]), np.array([0.0]))
    assert sigma[0] == pytest.approx(2.7e-3)


def test_dark_surfaces_err_more():
    bright, dark = (
        frames(SENSOR, plane(SENSOR, 1.5, albedo=a), 20)[CENTRE].std(axis=0).mean()
        for a in (0.7, 0.07)
    )
    assert dark == pytest.approx(np.sqrt(10.0) * bright, rel=0.15)


def test_corners_err_more_and_are_lost_first():
    view = plane(SENSOR, 3.0)
    depth = frames(SENSOR, view, 12)
    edge = depth[:, 60:80, 60:80]
    assert edge.std(axis=0).mean() > 1.15 * depth[CENTRE].std(axis=0).mean()
    far = frames(SENSOR, plane(SENSOR, 4.4, albedo=0.2), 1)[0]
    assert (far[CENTRE] > 0).mean() > 0.95
    assert (far[:20, :20] > 0).mean() < 0.05


def test_flying_pixels_are_at_edges_only_and_lie_between_its_sides():
    view = screen(SENSOR, 1.5, 2.5, -0.3, 0.3)
    depth = frames(SENSOR, view, 1)[0]
    floats = (depth > 1.55) & (depth < 2.4)
    columns = np.flatnonzero(floats.any(axis=0))
    edges = np.flatnonzero(np.diff(view.depth_m[0]) != 0)
    assert floats.sum() > 20
    assert np.all(np.abs(columns[:, None] - edges).min(axis=1) <= 1)


def test_the_driver_drops_most_flying_pixels():
    view = screen(SENSOR, 1.5, 2.5, -0.3, 0.3)
    kept = KinectV2(dropped_share=1e-9)

    def count(sensor):
        depth = frames(sensor, view, 2)
        return np.count_nonzero((depth > 1.55) & (depth < 2.4))

    assert count(SENSOR) < 0.5 * count(kept)


def test_dark_far_and_grazing_surfaces_are_lost():
    assert (frames(SENSOR, plane(SENSOR, 3.0, albedo=0.02), 1) > 0).mean() < 0.02
    assert not frames(SENSOR, plane(SENSOR, 4.7, albedo=1.0), 1).any()
    assert not frames(SENSOR, plane(SENSOR, 0.4), 1).any()
    grazing = plane(SENSOR, 2.0, tilt_deg=85.0, albedo=0.1)
    assert (frames(SENSOR, grazing, 1)[CENTRE] > 0).mean() < 0.15


def test_the_bias_stays_within_a_centimetre():
    for depth_m in (1.0, 2.0, 3.5):
        mean = frames(SENSOR, plane(SENSOR, depth_m), 10)[CENTRE].mean()
        assert abs(mean - depth_m) < 0.01
