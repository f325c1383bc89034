# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from synthesis.sensors.statistics import (
    edges,
    flying_share,
    hole_share_beside_edges,
    hole_share_by_depth,
    plane_residuals,
    quantisation_steps,
    raggedness_px,
    temporal_std,
)


@pytest.fixture
def rng():
    return np.random.default_rng(0)


def _step(near_columns, far_m=3.0, near_m=2.0, shape=(60, 80)):
    depth = np.full(shape, far_m)
    for row, column in enumerate(np.broadcast_to(near_columns, shape[0])):
        depth[row, : int(column)] = near_m
    return depth


def test_steps_are_found_between_levels_that_are_met_often():
    depth = np.repeat([1.0, 1.1, 1.3, 0.0], 20).reshape(1, 8, 10)
    depth[0, 0, 0] = 1.2
    level, step = quantisation_steps(depth)
    assert level == pytest.approx([1.0, 1.1]) and step == pytest.approx([0.1, 0.2])


@pytest.mark.parametrize("window_px", [5, 15])
def test_noise_on_a_tilted_plane_is_measured(rng, window_px):
    v, u = np.indices((100, 100)) - 50.0
    plane = 1.0 / (0.5 + 1e-3 * u - 5e-4 * v)
    z, rms = plane_residuals((plane + rng.normal(0, 3e-3, plane.shape))[None], window_px)
    near = np.abs(z - 2.0) < 0.05
    assert np.sqrt(np.mean(rms[near] ** 2)) == pytest.approx(3e-3, rel=0.05)


def test_windows_with_holes_or_edges_do_not_count(rng):
    depth = _step(40)[None]
    depth[0, 30] = 0.0
    z, rms = plane_residuals(depth, 7)
    assert len(z) and rms.max() < 1e-9


def test_only_still_pixels_count_for_the_deviation_over_time(rng):
    depths = 2.0 + rng.normal(0, 4e-3, (50, 20, 20))
    depths[:, :10] += np.linspace(0, 1, 50)[:, None, None]
    depths[7, 15, 3] = 0.0
    z, std = temporal_std(depths)
    assert len(z) == 199 and np.mean(std) == pytest.approx(4e-3, rel=0.05)


def test_an_edge_is_found_across_its_holes():
    depth = _step(40)
    depth[:, 40:46] = 0.0
    found = edges(depth[None])
    assert len(found.row) == 60 and np.all(found.gap_px == 6) and np.all(found.column == 39)
    assert not found.near_right.any() and np.all(found.near_m == 2.0) and np.all(found.far_m == 3.0)
    mirrored = edges(depth[None, :, ::-1])
    assert mirrored.near_right.all() and np.all(mirrored.column == 40)


def test_raggedness_is_the_spread_of_independent_rows_and_0_on_a_slanted_line(rng):
    column = 40 + rng.normal(0, 1.0, 4000)
    found = edges(_step(np.rint(column), shape=(4000, 80))[None])
    assert raggedness_px(found) == pytest.approx(1.0, rel=0.08)
    slanted = edges(_step(20 + np.arange(30), shape=(30, 80))[None])
    assert raggedness_px(slanted) == 0.0


def test_holes_beside_edges_are_told_from_others():
    depth = _step(40)
    depth[:, 40:44] = 0.0
    assert hole_share_beside_edges(depth[None]) == 1.0
    depth[10:14, 5:20] = 0.0
    assert hole_share_beside_edges(depth[None]) == pytest.approx(240 / 300)


def test_holes_are_counted_at_the_depth_behind_them():
    depth = _step(40)
    depth[:, 40:50] = 0.0
    share = hole_share_by_depth(depth[None], np.array([1.5, 2.5, 3.5, 4.5]))
    assert share[:2] == pytest.approx([0.0, 0.25]) and np.isnan(share[2])


def test_readings_between_the_sides_of_an_edge_fly():
    depth = _step(40)
    assert flying_share(depth[None]) == 0.0
    depth[:30, 40] = 2.5
    assert 0.1 < flying_share(depth[None]) < 0.4
