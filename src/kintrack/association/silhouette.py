# SPDX-License-Identifier: Apache-2.0
"""Skin where the camera saw that nothing is must leave: pairs with the nearest place it may take.

Window search says nothing about a limb that sticks out where nothing was observed near. Where the
camera looks past such a vertex, at something behind it or at nothing at all in a recording without
background, the vertex is drawn to the nearest pixel where it may be, across its ray and at its own
depth, or back along its ray to what is seen there, whichever is nearer: a leg in front of a desk
goes behind it. Where something nearer stands in the way, or the sensor failed, nothing follows.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from numba import njit
from numpy import ndarray

from kintrack.association.observation import Observation


class SilhouettePairs(NamedTuple):
    """Vertices outside the silhouette and where they should be."""

    vertex: Int[ndarray, " n"]
    """Vertex index."""
    points_camera: Float[ndarray, "n 3"]
    """On the nearest allowed pixel's ray, at the vertex's depth, or on its own ray, as far as what
    is seen there [m]."""


def outside_pairs(
    observation: Observation,
    vertices_camera: Float[ndarray, "v 3"],
    visible: Bool[ndarray, " v"],
    tolerance_m: float,
    gate_m: float,
    behind_m: float = 0.05,
) -> SilhouettePairs:
    """Visible vertices whose pixel lies outside the region by more than a tolerance.

    Args:
        observation: What was observed.
        vertices_camera: Skin vertices, camera frame [m].
        visible: Vertices that the camera would see, inside the image.
        tolerance_m: Distance outside that is forgiven, the raggedness of the silhouette [m].
        gate_m: Distance beyond which a vertex is left alone [m].
        behind_m: In a labelled image, what is seen must be so far behind the skin [m]: a nearer
            pixel may be the person's with a wrong label.

    Returns:
        The pairs.
    """
    camera, labelled = observation.camera, observation.labels is not None
    index = np.flatnonzero(visible)
    x, y, z = vertices_camera[index].T
    u = np.clip(np.floor(camera.fx * x / z + camera.cx + 0.5), 0, camera.width - 1).astype(int)
    v = np.clip(np.floor(camera.fy * y / z + camera.cy + 0.5), 0, camera.height - 1).astype(int)
    seen_m = observation.points_camera[v, u, 2]
    past_m = z + behind_m if labelled else z
    free = np.where(seen_m > 0, seen_m > past_m, not observation.has_background)
    free &= ~observation.region[v, u]
    index, u, v, z, seen_m = index[free], u[free], v[free], z[free], seen_m[free]
    row, column, away_px = _nearest_allowed(
        observation.points_camera,
        observation.region,
        observation.has_background,
        u,
        v,
        z,
        gate_m * camera.fx,
    )
    away_m = away_px * z / camera.fx
    # without labels all that is seen is hers, nothing to go behind
    back_m = np.where(labelled & (seen_m > 0), seen_m - z, np.inf)
    out = (away_m > tolerance_m) & (np.minimum(away_m, back_m) < gate_m)
    back = back_m < away_m
    row, column = np.where(back, v, row)[out], np.where(back, u, column)[out]
    z = np.where(back, seen_m, z)[out]
    points = np.stack(
        [(column - camera.cx) / camera.fx * z, (row - camera.cy) / camera.fy * z, z], axis=1
    )
    return SilhouettePairs(index[out], points)


@njit(cache=True, nogil=True)
def _nearest_allowed(points, region, has_background, u, v, z, gate):
    """For each vertex the nearest pixel where it may be: the region, or behind what is seen.

    So it is, too, where a recorded room has no reading, as dark cloth has none. Rings around the
    vertex' pixel are searched up to the gate [px m]; the distance is inf if there is no such pixel.
    """
    h, w = region.shape
    n = len(z)
    row, column, away = np.zeros(n, np.int64), np.zeros(n, np.int64), np.full(n, np.inf)
    for i in range(n):
        best = (gate / z[i]) ** 2
        r = 1
        while r * r < best:
            for dv in range(-r, r + 1):
                y = v[i] + dv
                if y < 0 or y >= h:
                    continue
                step = 1 if abs(dv) == r else 2 * r
                for du in range(-r, r + 1, step):
                    x = u[i] + du
                    d2 = du * du + dv * dv
                    if x < 0 or x >= w or d2 >= best:
                        continue
                    seen = points[y, x, 2]
                    hidden = seen < z[i] if seen > 0.0 else has_background
                    if region[y, x] or hidden:
                        best, row[i], column[i], away[i] = d2, y, x, np.sqrt(d2)
            r += 1
    return row, column, away
