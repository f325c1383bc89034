# SPDX-License-Identifier: Apache-2.0
"""Block matching along rows, which structured light and active stereo share.

A second eye (projector or right imager) sits a baseline to the right of the camera. What it does
not see gives no match: a shadow to the left of whatever is near. A bright dot of the pattern
carries the disparity of the surface it falls on, with an error. The matcher looks at a square
window around each sample. It takes the disparity that most dots in the window agree on and refuses
where too few do: edges fray by the random places of the dots, near surfaces grow into their shadow,
structures narrower than half a window disappear, and neighbours share their error because their
windows overlap. Counting the dots of a window that agree follows [GKUP11] and [BRHS14].

[GKUP11] Gschwandtner, Kwitt, Uhl, Pree, BlenSor: Blender Sensor Simulation Toolbox, ISVC 2011.
[BRHS14] Bohg, Romero, Herzog, Schaal, Robot Arm Pose Estimation through Pixel-Wise Part
    Classification, ICRA 2014.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from jaxtyping import Float32
from numba import njit
from numpy import ndarray

_STEEP_PX = 2.0
"""Disparity between neighbouring samples up to which they are one surface [px]."""
_HIDDEN_PX = 1.5
"""Disparity by which a surface must be nearer to cast a shadow [px]."""
_ONE_SURFACE_PX2 = 0.03
"""Variance of disparity in a window up to which nothing is decided between surfaces [px^2]."""
_FOLLOWED = 0.7
"""How far a match follows a slanted surface from the mean of its dots to the window's centre,
fitted to slanted planes of a recording."""


@lru_cache(maxsize=8)
def dot_pattern(shape: tuple[int, int], cell_px: int, device: int) -> Float32[ndarray, "h w"]:
    """Brightness of the projected dots, one at a random place in each cell, 0 between them.

    Args:
        shape: (height, width) in samples.
        cell_px: Side of a cell [samples].
        device: Number of the device; the same number gives the same pattern.

    Returns:
        Brightness around 1, read-only, shape (height, width).
    """
    rng = np.random.default_rng([device, 3])
    rows, columns = cells(shape, cell_px)
    place = rng.integers(0, cell_px, size=(2, rows, columns))
    bright = rng.lognormal(0.0, 0.35, size=(rows, columns))
    v = np.arange(rows)[:, None] * cell_px + place[0]
    u = np.arange(columns) * cell_px + place[1]
    pattern = np.zeros((rows * cell_px, columns * cell_px), dtype=np.float32)
    pattern[v, u] = bright
    pattern = np.ascontiguousarray(pattern[: shape[0], : shape[1]])
    pattern.setflags(write=False)
    return pattern


@njit(cache=True)
def see_dots(
    depth_m, angle_rad, albedo, pattern, errors_px, fb_px_m, needs_overlap, falloff, threshold, cell
):
    """Dots that the camera sees and the disparity each one carries.

    Args:
        depth_m: Depth of the rays [m], 0 = nothing, shape (h, w).
        angle_rad: Angle between ray and normal [rad], shape (h, w).
        albedo: Reflectance for the pattern's light, shape (h, w).
        pattern: Brightness of the dots as the second eye sees them, shape (h, w + pad); its
            column `pad` lies opposite the image's column 0.
        errors_px: Error of disparity of the dot in each cell of the pattern [px].
        fb_px_m: Focal length times baseline [samples m].
        needs_overlap: Whether a dot left of the pattern's column `pad` is lost.
        falloff: Power of the depth [m] by which the light is divided.
        threshold: Least light that is seen, as albedo cosine brightness / z^falloff.
        cell: Side of a cell [samples].

    Returns:
        Disparity of every ray [px], 0 = nothing; 1 where a dot is seen, else 0; the disparity
        that it carries [px], 0 where none is seen; all of shape (h, w).
    """
    h, w = depth_m.shape
    reach = pattern.shape[1]
    pad = reach - w
    disparity = np.zeros((h, w), dtype=np.float32)
    seen = np.zeros((h, w), dtype=np.float32)
    carried = np.zeros((h, w), dtype=np.float32)
    nearest = np.empty(reach, dtype=np.float32)
    for v in range(h):
        nearest[:] = 0.0
        for u in range(w):
            z = depth_m[v, u]
            disparity[v, u] = fb_px_m / z if z > 0.0 else 0.0
        for u in range(w):
            d = disparity[v, u]
            if d <= 0.0:
                continue
            a = int(u - d + pad + 0.5)
            b = a
            if u + 1 < w:
                e = disparity[v, u + 1]
                if e > 0.0 and abs(e - d) < _STEEP_PX:
                    b = int(u + 1 - e + pad + 0.5)
            for x in range(max(min(a, b), 0), min(max(a, b) + 1, reach)):
                nearest[x] = max(nearest[x], d)
        for u in range(w):
            d = disparity[v, u]
            x = int(u - d + pad + 0.5)
            if d <= 0.0 or x < 0 or (needs_overlap and x < pad) or pattern[v, x] == 0.0:
                continue
            light = albedo[v, u] * np.cos(angle_rad[v, u]) * pattern[v, x]
            if nearest[x] <= d + _HIDDEN_PX and light > threshold * depth_m[v, u] ** falloff:
                seen[v, u] = 1.0
                carried[v, u] = d + errors_px[v // cell, x // cell]
    return disparity, seen, carried


@njit(cache=True)
def match(disparity, seen, carried, radius, least, tolerance_px):
    """Disparity that most dots in the window around each sample agree on.

    Args:
        disparity: True disparity of every ray [px], 0 = nothing, shape (h, w).
        seen: 1 where a dot is seen, else 0, shape (h, w).
        carried: Disparity that it carries [px], shape (h, w).
        radius: Window is 2 radius + 1 samples wide [samples].
        least: Dots that must agree in a window that lies in the image and holds several surfaces;
            one fewer where there is one surface, fewer where the window leaves the image.
        tolerance_px: How far from the centre of a surface its dots may lie [px].

    Returns:
        Disparity [px], 0 = no match, shape (h, w).
    """
    h, w = seen.shape
    width = 2 * radius + 1
    out = np.zeros((h, w), dtype=np.float32)
    count, total, plain, square = np.zeros(w), np.zeros(w), np.zeros(w), np.zeros(w)
    inside = np.empty((width * width, 2), dtype=np.float32)
    for v in range(-radius, h):
        top, bottom = v - radius - 1, v + radius
        if bottom < h:
            _add(1.0, disparity[bottom], seen[bottom], carried[bottom], count, total, plain, square)
        if top >= 0:
            _add(-1.0, disparity[top], seen[top], carried[top], count, total, plain, square)
        if v < 0:
            continue
        tall = (min(bottom, h - 1) - max(top + 1, 0) + 1) / width
        n, sums, first, second = 0.0, 0.0, 0.0, 0.0
        for u in range(-radius, w):
            right, left = u + radius, u - radius - 1
            if right < w:
                n += count[right]
                sums += total[right]
                first += plain[right]
                second += square[right]
            if left >= 0:
                n -= count[left]
                sums -= total[left]
                first -= plain[left]
                second -= square[left]
            if u < 0:
                continue
            needed = least
            if tall < 1.0 or u < radius or u >= w - radius:
                needed = int(least * tall * (min(right, w - 1) - max(left + 1, 0) + 1) / width)
            if n < max(needed - 1, 1):
                continue
            if second * n - first * first < _ONE_SURFACE_PX2 * n * n:
                out[v, u] = sums / n + _follow(disparity[v, u], first / n, tolerance_px)
            elif n >= needed:
                out[v, u] = _decide(
                    disparity, seen, carried, v, u, radius, needed, tolerance_px, inside
                )
    return out


@njit(cache=True)
def _add(sign, disparity, seen, carried, count, total, plain, square):
    """Add one row to the sums of the columns, or take it off."""
    for u in range(len(count)):
        d = np.float64(disparity[u]) * seen[u] * sign
        count[u] += sign * seen[u]
        total[u] += sign * np.float64(carried[u])
        plain[u] += d
        square[u] += d * np.float64(disparity[u])


@njit(cache=True)
def _decide(disparity, seen, carried, v, u, radius, least, tolerance_px, inside):
    """The same for one sample whose window holds more than one surface."""
    h, w = seen.shape
    n = 0
    low, high = np.float32(1e9), np.float32(0.0)
    for y in range(max(v - radius, 0), min(v + radius + 1, h)):
        for x in range(max(u - radius, 0), min(u + radius + 1, w)):
            if seen[y, x] > 0.0:
                d = disparity[y, x]
                inside[n, 0] = d
                inside[n, 1] = carried[y, x]
                low, high = min(low, d), max(high, d)
                n += 1
    best, best_sum, best_plain = 0, 0.0, 0.0
    for candidate in range(3):
        centre = high if candidate == 0 else low if candidate == 1 else disparity[v, u]
        members, sums, plain = 0, 0.0, 0.0
        for turn in range(2):
            members, sums, plain = 0, 0.0, 0.0
            for i in range(n):
                if abs(inside[i, 0] - centre) <= tolerance_px:
                    members += 1
                    sums += inside[i, 1]
                    plain += inside[i, 0]
            if members == 0 or turn == 1:
                break
            centre = np.float32(plain / members)
        if members > best:
            best, best_sum, best_plain = members, sums, plain
    if best < least:
        return 0.0
    return best_sum / best + _follow(disparity[v, u], best_plain / best, tolerance_px)


@njit(cache=True)
def _follow(own, mean, tolerance_px):
    """What a slant adds between the mean of the dots and the window's centre [px]."""
    return _FOLLOWED * (own - mean) if own > 0.0 and abs(own - mean) <= tolerance_px else 0.0


def agree_at_least(window_px: int, cell_px: int, share: float) -> int:
    """Dots that must agree if a share of those in a full window must."""
    return max(1, round(share * (window_px / cell_px) ** 2))


def cells(shape: tuple[int, int], cell_px: int) -> tuple[int, int]:
    """Cells along each axis of a pattern."""
    return -(-shape[0] // cell_px), -(-shape[1] // cell_px)
