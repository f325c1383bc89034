# SPDX-License-Identifier: Apache-2.0
"""Smooth curves through a few keys, none of which they overshoot."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import gaussian_filter1d

SMOOTH_S = 0.06
"""Standard deviation of the Gaussian that rounds the keys [s]."""


def minimum_jerk(u: Float[ndarray, "*n"]) -> Float[ndarray, "*n"]:
    """10 u^3 - 15 u^4 + 6 u^5 with u clipped to [0, 1] (Flash & Hogan 1985)."""
    u = np.clip(u, 0.0, 1.0)
    return u * u * u * (10.0 + u * (6.0 * u - 15.0))


def smooth(
    values: Float[ndarray, " n"], rate_hz: float, sigma_s: float = SMOOTH_S
) -> Float[ndarray, " n"]:
    """Values averaged under a Gaussian in time; the ends are held, shape (N,)."""
    return gaussian_filter1d(values, sigma_s * rate_hz, axis=0, mode="nearest", truncate=3.0)


def keyed(
    keys: Sequence[tuple[float, float]], times_s: Float[ndarray, " n"], rate_hz: float
) -> Float[ndarray, " n"]:
    """A curve near its keys and never outside their range.

    Monotone cubics (Fritsch & Carlson 1980) rounded by a Gaussian of `SMOOTH_S`; held before the
    first key and after the last.

    Args:
        keys: (time [s], value), times increasing.
        times_s: Where to evaluate, evenly spaced, shape (N,).
        rate_hz: Their rate [Hz].

    Returns:
        Values, unit of the keys, shape (N,).
    """
    t, y = np.array(keys, dtype=float).T
    if len(t) == 1:
        return np.full(len(times_s), y[0])
    return smooth(PchipInterpolator(t, y)(np.clip(times_s, t[0], t[-1])), rate_hz)
