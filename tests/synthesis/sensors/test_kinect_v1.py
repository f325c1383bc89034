# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest
from sensor_views import frames, nothing_but_a_disc, plane, screen

from kintrack.errors import SceneError
from kintrack.geometry import PinholeCamera
from synthesis.sensors.catalogue import SENSORS
from synthesis.sensors.kinect_v1 import CAMERA_320, KinectV1

SENSOR = KinectV1()
UNBIASED = KinectV1(bias_steps=0.0, jump_steps=0.0)
FB = 585.0 * 0.075


@pytest.mark.parametrize("depth_m", [1.5, 2.8, 4.0])
def test_it_errs_as_khoshelham_and_elberink_measured(depth_m):
    view = plane(UNBIASED, depth_m, tilt_deg=8.0)
    near = (np.abs(view.depth_m - depth_m) < 0.05) & (np.arange(640) < 620)
    depth = frames(UNBIASED, view, 3)[:, near]
    assert (depth > 0).mean() > 0.999
    error = (depth - view.depth_m[near])[depth > 0]
    assert error.std() == pytest.approx(1.425e-3 * depth_m**2, rel=0.15)
    assert abs(error.mean()) < 0.2 * 1.425e-3 * depth_m**2


def test_it_has_steps_of_23_mm_at_2_8_metres():
    levels = np.unique(frames(SENSOR, plane(SENSOR, 2.8), 1))
    assert np.all(np.abs(np.diff(levels[levels > 0]) - 0.0223) < 1.5e-3)


def test_three_quarters_of_the_error_before_rounding_stay_in_place():
    view = plane(UNBIASED, 2.0, tilt_deg=5.0)
    steps = 8 * FB / frames(UNBIASED, view, 12)[:, :, 20:600] - 8 * FB / view.depth_m[:, 20:600]
    assert 0.2 < steps.std(axis=0).mean() < 0.4
    assert steps.mean(axis=0).std() > steps.std(axis=0).mean()


def test_neighbours_share_the_error_over_a_window():
    view = plane(UNBIASED, 2.0, tilt_deg=5.0)
    error = (frames(UNBIASED, view, 3) - view.depth_m)[:, :, 20:600]

    def correlation(lag):
        return (error[:, :, lag:] * error[:, :, :-lag]).mean() / (error**2).mean()

    assert correlation(1) > 0.45
    assert abs(correlation(14)) < 0.1


def test_the_shadow_lies_left_of_what_is_near_and_is_nearly_as_wide_as_the_parallax():
    depth = frames(SENSOR, screen(SENSOR, 1.5, 3.0, -0.2, 0.2), 1)[0]
    left, right = depth[20:460, 150:280] == 0, depth[20:460, 380:450] == 0
    parallax = FB * (1 / 1.5 - 1 / 3.0)
    assert 0.55 * parallax < left.sum(axis=1).mean() < 1.1 * parallax
    assert right.sum(axis=1).mean() < 2.0


def test_a_thin_strip_casts_no_wider_shadow_than_itself():
    depth = frames(SENSOR, screen(SENSOR, 1.5, 3.0, 0.0, 0.03), 1)[0]
    assert (depth[20:460, 20:600] == 0).sum(axis=1).mean() < 20.0


def test_a_structure_thinner_than_half_a_window_is_not_seen():
    wide, thin = (screen(SENSOR, 2.0, 2.6, 0.0, w) for w in (0.05, 0.005))
    assert (np.abs(frames(SENSOR, wide, 1) - 2.0) < 0.1).sum() > 480 * 8
    assert not np.any(np.abs(frames(SENSOR, thin, 1) - 2.0) < 0.1)


def test_nothing_is_invented_between_two_surfaces():
    depth = frames(SENSOR, screen(SENSOR, 2.0, 3.0, -0.5, 0.0), 1)
    assert not np.any((depth > 2.1) & (depth < 2.9))


def test_edges_fray_by_about_a_sample():
    depth = frames(SENSOR, screen(SENSOR, 2.0, 3.0, -9.0, 0.0), 1)[0]
    edge = ((depth > 0) & (depth < 2.5)).sum(axis=1) - 320
    assert 0.5 < edge.std() < 2.5 and abs(edge.mean()) < 2.5


def test_what_is_dark_or_grazing_or_out_of_range_gives_no_reading():
    assert (frames(SENSOR, plane(SENSOR, 2.5, albedo=0.01), 1) > 0).mean() < 0.01
    assert (frames(SENSOR, plane(SENSOR, 2.5, albedo=0.3), 1) > 0).mean() > 0.97
    assert not frames(SENSOR, plane(SENSOR, 0.4), 1).any()
    assert not frames(SENSOR, plane(SENSOR, 9.0, albedo=1.0), 1).any()
    tilted = plane(SENSOR, 2.0, tilt_deg=80.0, albedo=0.1)
    assert (frames(SENSOR, tilted, 1)[0][(tilted.depth_m > 1.9)] == 0).mean() > 0.9


def test_the_last_columns_read_nothing():
    depth = frames(SENSOR, plane(SENSOR, 2.0), 1)[0]
    assert not depth[:, 632:].any() and (depth[:, :632] > 0).mean() > 0.99


def test_at_320_px_every_second_sample_is_handed_out():
    half = SENSOR.with_camera(CAMERA_320)
    assert half.supersampling == 2
    full = replace(SENSOR, camera=PinholeCamera(640, 480, 585.0, 585.0, 319.5, 239.5))
    assert np.array_equal(
        frames(half, plane(half, 2.0, 20.0), 1)[0],
        frames(full, plane(full, 2.0, 20.0), 1)[0][::2, ::2],
    )


@pytest.mark.parametrize("name", list(SENSORS))
def test_a_sensor_sees_nothing_where_nothing_is_and_repeats_with_its_seed(name):
    sensor = SENSORS[name]()
    view = nothing_but_a_disc(sensor, 2.0, 0.4)
    first, second = frames(sensor, view, 1)[0], frames(sensor, view, 1)[0]
    assert np.array_equal(first, second)
    assert first.shape == (sensor.camera.height, sensor.camera.width)
    assert first.any() and not first[:, :20].any()
    assert np.all(np.isfinite(first)) and first.min() >= 0.0


@pytest.mark.parametrize("name", list(SENSORS))
def test_a_view_of_other_rays_is_refused(name):
    other = KinectV1(camera=PinholeCamera(64, 48, 58.5, 58.5, 31.5, 23.5))
    with pytest.raises(SceneError, match="needs the rays"):
        frames(SENSORS[name](), plane(other, 2.0), 1)


@pytest.mark.parametrize("name", list(SENSORS))
def test_a_sensor_takes_another_camera(name):
    camera = PinholeCamera(width=320, height=240, fx=285.6, fy=285.6, cx=160.0, cy=120.0)
    sensor = SENSORS[name]().with_camera(camera)
    depth = frames(sensor, plane(sensor, 2.0), 1)[0]
    assert depth.shape == (240, 320)
    assert np.median(depth) == pytest.approx(2.0, abs=0.03)


def test_a_perfect_sensor_reports_the_truth():
    sensor = SENSORS["perfect"]()
    view = plane(sensor, 2.0, 10.0)
    assert np.array_equal(frames(sensor, view, 1)[0], view.depth_m)
