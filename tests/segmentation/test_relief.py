# SPDX-License-Identifier: Apache-2.0
"""Small steps of the depth plane enlarged, large ones not."""

import numpy as np
import pytest

from segmentation.preprocess import DEPTH_SCALE, FARTHEST, HOLE, network_input
from segmentation.relief import AROUND, GAIN, RADII, STEP, add_relief


def relieved(plane):
    plane = plane.astype(np.float32)
    out = np.empty_like(plane)
    add_relief(plane, FARTHEST, out)
    return out


def stepped(height):
    """A plane with a bar in the middle that is nearer by `height`."""
    plane = np.zeros((40, 40))
    plane[:, 17:23] = -height
    return plane


def test_what_is_level_has_no_relief():
    assert (relieved(np.full((30, 30), 0.7)) == np.float32(0.7)).all()


def test_a_small_step_is_several_times_as_high_and_a_large_one_is_hardly_higher():
    small, large = (np.ptp(relieved(stepped(h))[20]) / h for h in (0.05, 3.0))
    assert 4.0 < small <= 1.0 + 2.0 * GAIN
    assert 1.0 <= large < 2.0


def test_twice_the_small_step_is_twice_the_relief():
    low, high = relieved(stepped(0.05)), relieved(stepped(0.1))
    assert np.allclose(high, 2.0 * low, atol=1e-6)


def test_no_relief_exceeds_the_gain_times_the_step_or_the_farthest_reading():
    plane = np.random.default_rng(0).uniform(-4.0, FARTHEST, (50, 60)).astype(np.float32)
    out = relieved(plane)
    assert np.abs(out - plane).max() <= GAIN * STEP + 1e-5
    assert out.max() <= FARTHEST


def test_holes_stay_and_count_for_nothing():
    plane = stepped(0.1)
    holes = np.random.default_rng(1).random(plane.shape) < 0.4
    punched = np.where(holes, HOLE, plane)
    out = relieved(punched)
    assert (out[holes] == HOLE).all()
    level = relieved(np.where(holes, HOLE, 0.0))
    assert (level[~holes] == 0.0).all()


def test_the_surroundings_are_three_circles():
    assert AROUND.shape == (8 * len(RADII), 2)
    assert not AROUND.sum(axis=0).any()
    assert np.allclose(np.hypot(*AROUND.T), np.repeat(RADII, 8), atol=0.7)


def test_an_arm_before_a_trunk_is_seen_as_well_from_afar():
    """Relief is a ratio of depths, so it does not depend on the distance of the scene."""
    steps = []
    for distance in (1.5, 3.0):
        depth = np.full((424, 512), distance, dtype=np.float32)
        depth[:, 240:270] *= 0.97
        D = network_input(depth, 365.0)[3]
        steps.append(np.ptp(D[53]))
    assert steps[0] == pytest.approx(steps[1], rel=1e-4)
    assert steps[0] > 4.0 * -np.log(0.97) / DEPTH_SCALE
