# SPDX-License-Identifier: Apache-2.0
"""Which surface a reading shows.

A sensor that matches windows gives a pixel beside a person her depth: the ray goes past her, the
reading is hers. Whoever learns from labels sees readings, so the label follows the reading.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, UInt8
from numba import njit
from numpy import ndarray

from synthesis.render.view import View

REACH = 8
"""How far from its ray a reading may come from [rays]: half a window, and a median filter."""
ALIKE_M, ALIKE_PER_M = 0.02, 0.01
"""A reading z shows a surface at most this + that z^2 from it [m, 1/m]: two standard deviations of
active stereo, the coarsest of the sensors."""


def labels_shown(view: View, depth_m: Float[ndarray, "h w"]) -> UInt8[ndarray, "h w"]:
    """Labels of what an image's readings show.

    A pixel keeps the label of its own ray if its reading agrees with what that ray meets, or if it
    has none; else it takes that of the nearest ray that its reading agrees with, within `REACH`. A
    reading between two surfaces, which agrees with no ray, keeps its own.

    Args:
        view: k x k rays a pixel.
        depth_m: What the sensor read [m], 0 = no reading.
    """
    k = view.labels.shape[0] // depth_m.shape[0]
    return np.asarray(
        _shown(view.labels, view.depth_m, np.asarray(depth_m), k, REACH, ALIKE_M, ALIKE_PER_M)
    )


@njit(cache=True)
def _shown(labels, true_m, depth_m, k, reach, alike_m, alike_per_m):
    tall, wide = labels.shape
    out = np.empty(depth_m.shape, dtype=np.uint8)
    for i in range(depth_m.shape[0]):
        for j in range(depth_m.shape[1]):
            v, u, z = k * i, k * j, depth_m[i, j]
            out[i, j] = labels[v, u]
            most = alike_m + alike_per_m * z * z
            if z <= 0.0 or abs(true_m[v, u] - z) <= most:
                continue
            nearest = (reach + 1) ** 2
            for y in range(max(0, v - reach), min(tall, v + reach + 1)):
                for x in range(max(0, u - reach), min(wide, u + reach + 1)):
                    square = (y - v) ** 2 + (x - u) ** 2
                    if square < nearest and abs(true_m[y, x] - z) <= most:
                        nearest = square
                        out[i, j] = labels[y, x]
    return out
