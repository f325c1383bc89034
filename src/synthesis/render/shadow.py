# SPDX-License-Identifier: Apache-2.0
"""Soft shadows of the key lamp, one ray a pixel.

The 4 x 4 pixels of a block aim at 16 places of the lamp, and each pixel averages the block around
it as far as that lies on its own surface: interleaved sampling with a discontinuity buffer [KH01].

[KH01] Keller, Heidrich, Interleaved Sampling, Eurographics Workshop on Rendering 2001.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int, UInt8
from numba import njit
from numpy import ndarray

from synthesis.render.cast import Caster
from synthesis.render.lights import Lamp

SAME_SURFACE_M = 0.02
"""Pixels farther than this from a pixel's tangent plane lie on another surface [m]."""
SAME_SURFACE_COSINE = 0.8
"""Pixels whose normal is farther than this from a pixel's lie on another surface."""


_ORDER = np.array([0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5])
"""Places of the lamp in the order of a block's pixels, neighbours far apart (Bayer 1973)."""


def cast_shadows(
    lamp: Lamp,
    caster: Caster,
    place: Float[ndarray, "n 3"],
    clear: UInt8[ndarray, " n"],
    pixels: Int[ndarray, " m"],
    width: int,
) -> None:
    """Clear the flag of pixels that triangles hide from the lamp, in place.

    Args:
        lamp: The lamp.
        caster: What casts shadows.
        place: Where rays to the lamp start, world frame [m].
        clear: 1 where a pixel is lit, changed.
        pixels: Which to look at.
        width: Pixels a row.
    """
    turn = np.arange(16) * np.pi * (3.0 - np.sqrt(5.0))
    z = 1.0 - (2.0 * np.arange(16) + 1.0) / 16.0
    ring = np.sqrt(1.0 - z * z)
    ball = np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)[_ORDER]
    ends = (np.asarray(lamp.position) + lamp.radius_m * ball).astype(np.float32)
    near, starts, steps = _crossing(ends, *caster.box, place, clear, pixels, width)
    if len(near):
        clear[near[caster.occluded(starts, steps)]] = 0


def lit_share(
    clear: UInt8[ndarray, "h w"], normal: Float[ndarray, "h w 3"], place: Float[ndarray, "h w 3"]
) -> Float[ndarray, "h w"]:
    """Share of the lamp that each pixel sees, 0..1.

    Args:
        clear: 1 where a pixel's own ray reaches the lamp.
        normal: Unit normals.
        place: Points of the surface, world frame [m].
    """
    return np.asarray(_lit_share(clear, normal, place))


@njit(cache=True)
def _crossing(ends, low, high, place, clear, pixels, width):
    """Lit pixels whose ray to the lamp crosses a box, with the rays' starts and steps."""
    near = np.empty(pixels.shape[0], dtype=np.int64)
    starts = np.empty((pixels.shape[0], 3), dtype=np.float32)
    steps = np.empty((pixels.shape[0], 3), dtype=np.float32)
    count = 0
    for pixel in pixels:
        if clear[pixel] == 0:
            continue
        end = ends[4 * (pixel // width % 4) + pixel % width % 4]
        first, last = 0.0, 1.0
        for k in range(3):
            s = place[pixel, k]
            d = end[k] - s
            if abs(d) < 1e-9:
                if s < low[k] or s > high[k]:
                    last = -1.0
                continue
            a, b = (low[k] - s) / d, (high[k] - s) / d
            first, last = max(first, min(a, b)), min(last, max(a, b))
        if first <= last:
            near[count] = pixel
            for k in range(3):
                starts[count, k] = place[pixel, k]
                steps[count, k] = end[k] - place[pixel, k]
            count += 1
    return near[:count], starts[:count], steps[:count]


@njit(cache=True)
def _lit_share(clear, normal, place):
    h, w = clear.shape
    out = np.empty((h, w), dtype=np.float32)
    column = np.empty(w, dtype=np.int64)
    for i in range(h):
        top, bottom = max(i - 2, 0), min(i + 2, h)
        column[:] = 0
        for y in range(top, bottom):
            for x in range(w):
                column[x] += clear[y, x]
        for j in range(w):
            left, right = max(j - 2, 0), min(j + 2, w)
            total = 0
            for x in range(left, right):
                total += column[x]
            if total == 0 or total == (bottom - top) * (right - left):
                out[i, j] = clear[i, j]
                continue
            n0, n1, n2 = normal[i, j]
            p0, p1, p2 = place[i, j]
            count, total = 0, 0
            for y in range(top, bottom):
                for x in range(left, right):
                    m, q = normal[y, x], place[y, x]
                    if m[0] * n0 + m[1] * n1 + m[2] * n2 < SAME_SURFACE_COSINE:
                        continue
                    off = (q[0] - p0) * n0 + (q[1] - p1) * n1 + (q[2] - p2) * n2
                    if abs(off) < SAME_SURFACE_M:
                        count += 1
                        total += clear[y, x]
            out[i, j] = total / count if count > 0 else clear[i, j]
    return out
