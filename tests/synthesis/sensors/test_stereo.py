# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from sensor_views import frames, plane, screen

from synthesis.sensors.stereo import CAMERA_848, Stereo, stereo_sigma_m

SENSOR = Stereo()
FB = 385.0 * 0.05


@pytest.mark.parametrize("depth_m", [1.0, 2.0, 3.5])
@pytest.mark.parametrize("baseline_m", [0.05, 0.095])
def test_it_errs_as_the_maker_says(depth_m, baseline_m):
    sensor = Stereo(baseline_m=baseline_m)
    depth = frames(sensor, plane(sensor, depth_m), 2)
    error = depth[:, 20:460, 60:620] - depth_m
    expected = stereo_sigma_m(np.array(depth_m), 385.0, baseline_m)
    assert np.std(error) == pytest.approx(expected, rel=0.25)


def test_the_published_error_is_17_mm_at_2_metres():
    assert stereo_sigma_m(np.array(2.0), 385.0, 0.05) == pytest.approx(0.0166, abs=1e-4)


def test_a_band_at_the_left_reads_nothing_and_narrows_with_distance():
    def band_px(depth_m):
        depth = frames(SENSOR, plane(SENSOR, depth_m), 1)[0]
        return np.argmax(depth[20:460] > 0, axis=1).mean()

    assert band_px(0.5) == pytest.approx(FB / 0.5, abs=5.0)
    assert band_px(2.0) == pytest.approx(FB / 2.0, abs=5.0)


def test_windows_fatten_near_things_into_their_shadow():
    depth = frames(SENSOR, screen(SENSOR, 0.8, 3.0, -0.1, 0.1), 1)[0]
    near = ((depth > 0) & (depth < 1.0)).sum(axis=1)[20:460]
    assert 0.2 / 0.8 * 385.0 < near.mean() < 0.2 / 0.8 * 385.0 + 8.0
    assert (depth[20:460, 200:280] == 0).sum(axis=1).mean() > 0.4 * FB * (1 / 0.8 - 1 / 3.0)


def test_neighbours_share_the_error_and_frames_do_not_share_all_of_it():
    error = frames(SENSOR, plane(SENSOR, 2.0), 6)[:, 20:460, 60:620] - 2.0
    assert (error[:, :, 3:] * error[:, :, :-3]).mean() > 0.5 * (error**2).mean()
    assert 0.3 < error.std(axis=0).mean() / error.std() < 0.8


def test_dark_surfaces_lose_their_texture():
    assert (frames(SENSOR, plane(SENSOR, 2.0, albedo=0.005), 1) > 0).mean() < 0.05
    assert (frames(SENSOR, plane(SENSOR, 2.0, albedo=0.2), 1) > 0).mean() > 0.95


def test_it_works_at_848_px():
    sensor = SENSOR.with_camera(CAMERA_848)
    assert (frames(sensor, plane(sensor, 1.5), 1) > 0).mean() > 0.95
