# SPDX-License-Identifier: Apache-2.0
"""Labels settled by a body that is expected somewhere: what of a network's doubt the place decides.

Where a network wavers between two labels, it names both. A pixel that lies hard by the skin of the
second of them is the second's; one that it called background, but might call a part, is what lies
nearest to it, if it is on one surface with pixels that are labelled hers. Whose side a limb's pixel
is, which a network guesses where a back looks like a front, is settled after that.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, UInt8
from numba import njit
from numpy import ndarray

from kintrack.alignment import View
from kintrack.association.observation import Observation
from kintrack.sides import settle_sides

EDGE_M = 0.04
"""Depth step between neighbouring pixels of one surface [m]."""


def settle(observation: Observation, view: View, doubt_m: float, side_m: float) -> Observation:
    """The observation with doubts and sides settled by the skin where it is expected.

    Args:
        observation: Points of one person, her region.
        view: Her skin where it is expected.
        doubt_m: How near to the skin of a label a pixel in doubt must be to take it [m].
        side_m: How far a limb's side is believed [m], see `settle_sides`.

    Returns:
        The observation with changed labels and a region that may have grown; unchanged without
        labels.
    """
    decided = settle_doubts(observation, view, doubt_m)
    return settle_sides(decided, view.vertices_camera, view.visible, view.labels, side_m)


def settle_doubts(observation: Observation, view: View, doubt_m: float) -> Observation:
    """The observation with second guesses in place of first ones where the skin speaks for them.

    Args:
        observation: Points of one person, her region.
        view: Her skin where it is expected.
        doubt_m: How near a visible vertex of the second label must be to a pixel [m].

    Returns:
        The observation; unchanged if nothing was in doubt.
    """
    labels, second = observation.labels, observation.second
    if labels is None or second is None or doubt_m == 0.0:
        return observation
    camera, points = observation.camera, observation.points_camera
    overlooked = (labels == 0) & (second > 0) & (points[..., 2] > 0)
    torn = observation.region & (second > 0) & (second != labels)
    near = _nearest_part(
        points,
        overlooked | torn,
        view.vertices_camera[view.visible],
        view.labels[view.visible],
        (camera.fx, camera.fy, camera.cx, camera.cy),
        doubt_m,
    )
    claims = overlooked & (near > 0)
    _drop_islands(points[..., 2], observation.region, claims)
    changed = claims | (torn & (near == second))
    return replace(
        observation,
        labels=np.where(changed, near, labels),
        region=observation.region | claims,
    )


@njit(cache=True, nogil=True)
def _nearest_part(
    points: Float[ndarray, "h w 3"],
    wanted: Bool[ndarray, "h w"],
    skin: Float[ndarray, "v 3"],
    part: UInt8[ndarray, " v"],
    intrinsics: tuple[float, float, float, float],
    reach_m: float,
) -> UInt8[ndarray, "h w"]:
    """Part of the vertex nearest to each wanted point; 0 where none is within reach."""
    h, w = wanted.shape
    fx, fy, cx, cy = intrinsics
    out = np.zeros((h, w), dtype=np.uint8)
    least = np.full((h, w), reach_m * reach_m)
    for k in range(len(skin)):
        x, y, z = skin[k, 0], skin[k, 1], skin[k, 2]
        if z <= 2.0 * reach_m:
            continue
        u, v = fx * x / z + cx, fy * y / z + cy
        across, down = fx * reach_m / (z - reach_m), fy * reach_m / (z - reach_m)
        for i in range(max(0, math.ceil(v - down)), min(h, math.floor(v + down) + 1)):
            for j in range(max(0, math.ceil(u - across)), min(w, math.floor(u + across) + 1)):
                if not wanted[i, j]:
                    continue
                dx, dy, dz = points[i, j, 0] - x, points[i, j, 1] - y, points[i, j, 2] - z
                d2 = dx * dx + dy * dy + dz * dz
                if d2 < least[i, j]:
                    least[i, j] = d2
                    out[i, j] = part[k]
    return out


@njit(cache=True, nogil=True)
def _drop_islands(
    z: Float[ndarray, "h w"], region: Bool[ndarray, "h w"], claims: Bool[ndarray, "h w"]
) -> None:
    """Take back claims to which no way over claims leads from the region."""
    h, w = z.shape
    kept = region.copy()
    stack = np.empty((h * w, 2), dtype=np.int64)
    top = 0
    for i in range(h):
        for j in range(w):
            if region[i, j]:
                stack[top, 0], stack[top, 1] = i, j
                top += 1
    while top > 0:
        top -= 1
        a, b = stack[top, 0], stack[top, 1]
        for da, db in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            c, d = a + da, b + db
            if c < 0 or d < 0 or c >= h or d >= w or kept[c, d] or not claims[c, d]:
                continue
            if abs(z[c, d] - z[a, b]) <= EDGE_M:
                kept[c, d] = True
                stack[top, 0], stack[top, 1] = c, d
                top += 1
    for i in range(h):
        for j in range(w):
            claims[i, j] &= kept[i, j]
