# SPDX-License-Identifier: Apache-2.0
"""Relief made visible: how much nearer a cell is than its surroundings, several times over.

An arm before a trunk is a step of 2 or 3 % in depth, its outline before a room one of 50 %. Layers
that see both on one scale, of eight bits when they run, see little of the arm. So each cell of the
depth plane D becomes

    D - g / n  sum_k  min(max(D_k - D, -t), t),

k over n cells on three circles around it: steps up to t count `g` times, larger ones no more than
t. It is what local operators of tone mapping do to pictures (Durand & Dorsey 2002). Holes, and what
lies outside of the picture, count as level with the cell.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float
from numba import njit
from numpy import ndarray

GAIN = 8.0
"""g."""
STEP = 0.25
"""t: about 10 % of the depth."""
RADII = (2, 5, 9)
"""Circles of eight cells each."""
AROUND = np.array(
    [
        (round(r * math.sin(k * math.pi / 4)), round(r * math.cos(k * math.pi / 4)))
        for r in RADII
        for k in range(8)
    ]
)
"""Rows and columns of the surroundings, shape (24, 2)."""


def add_relief(plane: Float[ndarray, "h w"], farthest: float, out: Float[ndarray, "h w"]) -> None:
    """Write a depth plane with its relief.

    Args:
        plane: D, shape (H, W).
        farthest: The highest value of a reading, which none exceeds with its relief either; what is
            beyond it is a hole and stays as it is.
        out: Where to write, another array of the same shape and type.
    """
    gain = np.float32(GAIN / len(AROUND))
    _relieve(plane, np.float32(farthest), AROUND, np.float32(STEP), gain, out)


@njit(cache=True)
def _relieve(plane, farthest, around, step, gain, out):
    h, w = plane.shape
    for i in range(h):
        for j in range(w):
            d = plane[i, j]
            out[i, j] = d
            if d > farthest:
                continue
            total = np.float32(0.0)
            for k in range(around.shape[0]):
                a, b = i + around[k, 0], j + around[k, 1]
                if 0 <= a < h and 0 <= b < w and plane[a, b] <= farthest:
                    total += min(max(plane[a, b] - d, -step), step)
            out[i, j] = min(d - gain * total, farthest)
