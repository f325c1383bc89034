# SPDX-License-Identifier: Apache-2.0
"""Colours of a skin that mean something: how far it is raised, how far what was seen lies off."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, UInt8
from numpy import ndarray

from kintrack.export.overlay import PART_COLORS
from kintrack.geometry import PinholeCamera
from kintrack.raster import rasterise
from kintrack.sequence import Frame
from kintrack.skin import Skin, vertex_normals

COLORINGS = ("part", "offset", "residual")
"""What a skin can be coloured by."""
FULL_OFFSET_M, FULL_RESIDUAL_M = 0.03, 0.02
"""Values of the darkest red and, negative, the darkest blue [m]."""
FACING = 0.2
"""Least cosine between normal and ray of a vertex that has a residual."""
BEHIND_M = 0.02
"""A vertex so far behind the skin's own depth is hidden [m]."""
GATE_M = 0.05
"""A reading further from the skin is another surface [m]."""

_UNKNOWN = (150, 150, 150)
_STOPS = np.array([[20, 50, 160], [110, 170, 230], [245, 245, 240], [240, 150, 100], [165, 15, 30]])


def signed_colors(values: Float[ndarray, " v"], full: float) -> UInt8[ndarray, "v 3"]:
    """Blue for -full, white for 0, red for +full, grey for NaN."""
    place = 2.0 + 2.0 * np.clip(np.nan_to_num(values) / full, -1.0, 1.0)
    mixed = np.stack([np.interp(place, np.arange(5), stop) for stop in _STOPS.T], axis=1)
    mixed[np.isnan(values)] = _UNKNOWN
    return np.rint(mixed).astype(np.uint8)


def residuals_of(
    vertices_camera: Float[ndarray, "v 3"], skin: Skin, frame: Frame | None
) -> Float[ndarray, " v"]:
    """How far outside each vertex the observed surface lies, along the normal [m].

    Args:
        vertices_camera: Vertices, camera frame [m].
        skin: Their skin.
        frame: What was observed.

    Returns:
        One value per vertex; NaN where the camera does not see it or sees something else.
    """
    out = np.full(len(vertices_camera), np.nan)
    if frame is None or frame.depth_m is None:
        return out
    camera: PinholeCamera = frame.camera
    normals = vertex_normals(vertices_camera, skin.faces)
    z = vertices_camera[:, 2]
    ahead = z > 0
    ray = vertices_camera / np.linalg.norm(vertices_camera, axis=1, keepdims=True)
    pixel = np.zeros((len(z), 2), dtype=int)
    pixel[ahead] = np.rint(camera.project(vertices_camera[ahead])).astype(int)
    u, v = pixel.T
    seen = ahead & (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
    seen &= -(normals * ray).sum(axis=1) > FACING
    skin_z, _ = rasterise(vertices_camera, skin.faces, camera)
    seen[seen] = z[seen] <= skin_z[v[seen], u[seen]] + BEHIND_M
    points = camera.back_project(frame.depth_m)[v[seen], u[seen]]
    along = ((points - vertices_camera[seen]) * normals[seen]).sum(axis=1)
    out[seen] = np.where((points[:, 2] > 0) & (np.abs(along) < GATE_M), along, np.nan)
    return out


def colors_of(
    coloring: str,
    skin: Skin,
    offsets_m: Float[ndarray, " v"] | None,
    vertices_camera: Float[ndarray, "v 3"],
    frame: Frame | None,
) -> UInt8[ndarray, "v 3"]:
    """R G B of every vertex.

    Args:
        coloring: One of `COLORINGS`.
        skin: The skin.
        offsets_m: Its offsets [m]; None for none.
        vertices_camera: Where it is, camera frame [m].
        frame: What was observed; without it there are no residuals.
    """
    if coloring == "offset":
        known = np.zeros(len(skin.labels)) if offsets_m is None else offsets_m
        return signed_colors(known, FULL_OFFSET_M)
    if coloring == "residual":
        return signed_colors(residuals_of(vertices_camera, skin, frame), FULL_RESIDUAL_M)
    return PART_COLORS[skin.labels]
