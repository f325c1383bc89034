# SPDX-License-Identifier: Apache-2.0
import numpy as np

from synthesis.motions.curves import keyed, minimum_jerk

RATE_HZ = 30.0
TIMES_S = np.arange(90) / RATE_HZ
KEYS = ((0.5, 0.0), (1.0, 40.0), (1.2, 40.0), (2.0, -10.0))


def test_a_curve_stays_within_the_range_of_its_keys():
    values = keyed(KEYS, TIMES_S, RATE_HZ)
    assert values.min() > -10.0 - 1e-9 and values.max() < 40.0 + 1e-9


def test_a_curve_passes_near_its_keys_and_rests_outside_them():
    values = keyed(KEYS, TIMES_S, RATE_HZ)
    assert abs(values[33] - 40.0) < 2.0
    assert np.allclose(values[:8], 0.0) and np.allclose(values[75:], -10.0)


def test_a_single_key_holds_for_ever():
    assert np.array_equal(keyed(((1.0, 7.0),), TIMES_S, RATE_HZ), np.full(90, 7.0))


def test_minimum_jerk_starts_and_stops_at_rest():
    u = np.linspace(0.0, 1.0, 1001)
    values = minimum_jerk(u)
    velocity = np.gradient(values, u)
    acceleration = np.gradient(velocity, u)
    assert values[0] == 0.0 and values[-1] == 1.0
    assert max(abs(velocity[[0, -1]])) < 1e-4 and max(abs(acceleration[[2, -3]])) < 0.2
