# SPDX-License-Identifier: Apache-2.0
"""Skin that projects beside the person must come back: pairs with the nearest silhouette pixel.

Window search says nothing about a limb that sticks out where nothing was observed near. Where the
camera looks past such a vertex, at something behind it or at nothing at all in a recording without
background, the vertex is drawn, across its ray and at its own depth, to the nearest pixel of the
region. Where something nearer stands in the way, or the sensor failed, nothing follows.
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
    """Nearest allowed pixel of every pixel."""

    distance_px: Float[ndarray, "h w"]
    """Distance to an allowed pixel [px]; 0 inside."""
    nearest: Int[ndarray, "h w"]
    """Flat index of the nearest allowed pixel."""


def silhouette(observation: Observation) -> Silhouette:
    """Distance transform of where the person may be.

    That is the region, behind anything nearer, and where a recorded room has no reading, as dark
    cloth has none.
    """
    z = observation.points_camera[..., 2]
    nearest = np.quantile(z[observation.region], 0.01) if observation.region.any() else 0.0
    unread = (z == 0) & observation.has_background
    allowed = observation.region | ((z > 0) & (z < nearest)) | unread
    outside = (~allowed).astype(np.uint8)
    distance, label = cv2.distanceTransformWithLabels(
        outside, cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    place = np.zeros(int(label.max()) + 1, dtype=np.int64)
    inside = np.flatnonzero(allowed)
    place[label.ravel()[inside]] = inside
    return Silhouette(distance, place[label])


def outside_pairs(
    shape: Silhouette,
    observation: Observation,
    vertices_camera: Float[ndarray, "v 3"],
    visible: Bool[ndarray, " v"],
    tolerance_m: float,
    gate_m: float,
    behind_m: float = 0.05,
) -> SilhouettePairs:
    """Visible vertices whose pixel lies outside the region by more than a tolerance.

    Args:
        shape: Distance transform of the region.
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
    camera = observation.camera
    index = np.flatnonzero(visible)
    x, y, z = vertices_camera[index].T
    u = np.clip(np.floor(camera.fx * x / z + camera.cx + 0.5), 0, camera.width - 1).astype(int)
    v = np.clip(np.floor(camera.fy * y / z + camera.cy + 0.5), 0, camera.height - 1).astype(int)
    away_m = shape.distance_px[v, u] * z / camera.fx
    seen_m = observation.points_camera[v, u, 2]
    past_m = z if observation.labels is None else z + behind_m
    free = np.where(seen_m > 0, seen_m > past_m, not observation.has_background)
    out = free & (away_m > tolerance_m) & (away_m < gate_m)
    row, column = np.divmod(shape.nearest[v[out], u[out]], camera.width)
    z = z[out]
    points = np.stack(
        [(column - camera.cx) / camera.fx * z, (row - camera.cy) / camera.fy * z, z], axis=1
    )
    return SilhouettePairs(index[out], points)
