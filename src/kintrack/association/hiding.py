# SPDX-License-Identifier: Apache-2.0
"""Skin that something else hides: no evidence, neither for the pose nor against it."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, UInt8
from numba import njit
from numpy import ndarray

from kintrack.association.observation import Observation


def hidden_vertices(
    observation: Observation,
    vertices_camera: Float[ndarray, "v 3"],
    visible: Bool[ndarray, " v"],
    vertex_labels: UInt8[ndarray, " v"],
    nearer_m: float,
) -> Bool[ndarray, " v"]:
    """Vertices whose ray ends at another surface before it reaches them.

    Only labels tell a hidden limb from a limb that is elsewhere, so nothing is hidden in an image
    without them. A ray without a reading hides what lies on it where a room was recorded; where the
    background was taken out, it passes through free space.

    Args:
        observation: What was observed.
        vertices_camera: Skin vertices, camera frame [m].
        visible: Vertices inside the image that the camera would see if nothing else were there.
        vertex_labels: Body part of every vertex.
        nearer_m: How much nearer the reading must be [m].

    Returns:
        True per hidden vertex of the visible ones, shape (V,).
    """
    if observation.labels is None:
        return np.zeros(len(visible), dtype=bool)
    camera = observation.camera
    return _hidden(
        vertices_camera,
        visible,
        vertex_labels,
        observation.points_camera,
        observation.labels,
        observation.has_background,
        camera.fx,
        camera.fy,
        camera.cx,
        camera.cy,
        nearer_m,
    )


@njit(cache=True, nogil=True)
def _hidden(v, visible, part, points, labels, has_background, fx, fy, cx, cy, nearer):
    h, w = labels.shape
    out = np.zeros(v.shape[0], dtype=np.bool_)
    for i in range(v.shape[0]):
        if not visible[i]:
            continue
        z = v[i, 2]
        u = min(max(int(np.floor(fx * v[i, 0] / z + cx + 0.5)), 0), w - 1)
        r = min(max(int(np.floor(fy * v[i, 1] / z + cy + 0.5)), 0), h - 1)
        seen = points[r, u, 2]
        if seen > 0.0:
            out[i] = labels[r, u] != part[i] and seen < z - nearer
        else:
            out[i] = has_background
    return out
