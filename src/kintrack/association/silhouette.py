# SPDX-License-Identifier: Apache-2.0
"""Skin that projects beside the person must come back: pairs with the nearest silhouette pixel.

Window search says nothing about a limb that sticks out where nothing was observed near. Such a
vertex is drawn, across its ray and at its own depth, to the nearest pixel of the region.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from kintrack.association.observation import Observation


class SilhouettePairs(NamedTuple):
    """Vertices outside the silhouette and where they should be."""

    vertex: Int[ndarray, " n"]
    """Vertex index."""
    points_camera: Float[ndarray, "n 3"]
    """Place on the nearest region pixel's ray, at the vertex's depth [m]."""


class Silhouette(NamedTuple):
    """Nearest region pixel of every pixel."""

    distance_px: Float[ndarray, "h w"]
    """Distance to the region [px]; 0 inside."""
    nearest: Int[ndarray, "h w"]
    """Flat index of the nearest region pixel."""


def silhouette(observation: Observation) -> Silhouette:
    """Distance transform of the observation's region."""
    outside = (~observation.region).astype(np.uint8)
    distance, label = cv2.distanceTransformWithLabels(
        outside, cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    place = np.zeros(int(label.max()) + 1, dtype=np.int64)
    inside = np.flatnonzero(observation.region)
    place[label.ravel()[inside]] = inside
    return Silhouette(distance, place[label])


def outside_pairs(
    shape: Silhouette,
    observation: Observation,
    vertices_camera: Float[ndarray, "v 3"],
    visible: Bool[ndarray, " v"],
    tolerance_m: float,
    gate_m: float,
) -> SilhouettePairs:
    """Visible vertices whose pixel lies outside the region by more than a tolerance.

    Args:
        shape: Distance transform of the region.
        observation: What was observed.
        vertices_camera: Skin vertices, camera frame [m].
        visible: Vertices that the camera would see, inside the image.
        tolerance_m: Distance outside that is forgiven, the raggedness of the silhouette [m].
        gate_m: Distance beyond which a vertex is left alone [m].

    Returns:
        The pairs.
    """
    camera = observation.camera
    index = np.flatnonzero(visible)
    x, y, z = vertices_camera[index].T
    u = np.clip(np.floor(camera.fx * x / z + camera.cx + 0.5), 0, camera.width - 1).astype(int)
    v = np.clip(np.floor(camera.fy * y / z + camera.cy + 0.5), 0, camera.height - 1).astype(int)
    away_m = shape.distance_px[v, u] * z / camera.fx
    out = (away_m > tolerance_m) & (away_m < gate_m)
    row, column = np.divmod(shape.nearest[v[out], u[out]], camera.width)
    z = z[out]
    points = np.stack(
        [(column - camera.cx) / camera.fx * z, (row - camera.cy) / camera.fy * z, z], axis=1
    )
    return SilhouettePairs(index[out], points)
