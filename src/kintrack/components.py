# SPDX-License-Identifier: Apache-2.0
"""Pieces of a depth image that no depth step parts."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int
from numba import njit
from numpy import ndarray


@njit(cache=True, nogil=True)
def components(
    z: Float[ndarray, "h w"], valid: Bool[ndarray, "h w"], edge_m: float, noise: float
) -> Int[ndarray, "h w"]:
    """Connected pixels whose depth differs little from neighbour to neighbour.

    Args:
        z: Depth [m].
        valid: Pixels that count.
        edge_m: Largest step between neighbours of one piece [m].
        noise: What is added to it, times z squared [1/m].

    Returns:
        Number of each pixel's piece, from 0; -1 where it does not count.
    """
    h, w = z.shape
    out = np.full((h, w), -1, dtype=np.int64)
    stack = np.empty((h * w, 2), dtype=np.int64)
    count = 0
    for i in range(h):
        for j in range(w):
            if not valid[i, j] or out[i, j] >= 0:
                continue
            out[i, j] = count
            stack[0, 0], stack[0, 1] = i, j
            top = 1
            while top > 0:
                top -= 1
                a, b = stack[top, 0], stack[top, 1]
                for da, db in ((1, 0), (-1, 0), (0, 1), (0, -1)):
                    c, d = a + da, b + db
                    if c < 0 or d < 0 or c >= h or d >= w or not valid[c, d] or out[c, d] >= 0:
                        continue
                    if abs(z[c, d] - z[a, b]) > edge_m + noise * z[a, b] * z[a, b]:
                        continue
                    out[c, d] = count
                    stack[top, 0], stack[top, 1] = c, d
                    top += 1
            count += 1
    return out
