# SPDX-License-Identifier: Apache-2.0
"""What the pixels of one frame say about the offsets of the triangles that they see.

The ray of a pixel meets the skin at s = sum_k b_k v_k in a triangle with normal n and corners k.
The observed point p on it lies r = n . (p - s) outside, and offsets o_k + do_k put it on the
surface if sum_k a_k do_k = r with a_k = b_k (n . d_k) (d: `kintrack.deformation.relief`). A pixel
just beside the skin's outline is compared with the outline's nearest pixel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numba import njit
from numpy import ndarray

from kintrack.association.observation import Observation
from kintrack.deformation_config import DeformationConfig
from kintrack.geometry import robust_scale, tukey_weights
from kintrack.raster import rasterise
from kintrack.skin import Skin

OBLIQUE = 0.2
"""Triangles with a smaller cosine between normal and ray say nothing inside the outline."""
RIM = 0.5
"""Weight of a pixel beside the outline."""
APART_M = 0.08
"""Point and skin on one ray may lie so far apart [m]."""


@dataclass(frozen=True)
class Evidence:
    """One row per pixel that says something."""

    face: Int[ndarray, " n"]
    """Triangle."""
    a: Float[ndarray, "n 3"]
    """Derivative of the surface along its normal with respect to the corners' offsets."""
    residual_m: Float[ndarray, " n"]
    """How far outside the surface the point lies [m]."""
    weight: Float[ndarray, " n"]
    """Robust weight times the cosine between normal and ray, 0 to 1."""


def evidence_of(
    skin: Skin,
    vertices_camera: Float[ndarray, "v 3"],
    directions_camera: Float[ndarray, "v 3"],
    observation: Observation,
    config: DeformationConfig,
) -> Evidence:
    """Compare a skin with what was observed, pixel by pixel.

    Args:
        skin: The skin.
        vertices_camera: Its vertices as they are now, camera frame [m].
        directions_camera: Where offsets move its vertices, camera frame.
        observation: What was observed; pixels of another label than the triangle say nothing.
        config: Gates and scales.
    """
    camera, labels = observation.camera, observation.labels
    _, index = rasterise(vertices_camera, skin.faces, camera)
    face, a, r, cosine = _compare(
        vertices_camera,
        directions_camera,
        skin.faces,
        skin.labels,
        index,
        observation.points_camera,
        observation.region.view(np.uint8) if labels is None else labels * observation.region,
        labels is not None,
        camera.fx,
        camera.fy,
        camera.cx,
        camera.cy,
        config.gate_m,
        config.beyond_px,
    )
    if len(r) == 0:
        return Evidence(face, a, r, cosine)
    scale = float(np.clip(robust_scale(r), config.scale_floor_m, config.scale_ceiling_m))
    return Evidence(face, a, r, tukey_weights(r, scale) * cosine)


@njit(cache=True, nogil=True)
def _compare(v, d, faces, part, index, points, wanted, labelled, fx, fy, cx, cy, gate, beyond):
    h, w = index.shape
    most = np.count_nonzero(wanted)
    face = np.empty(most, dtype=np.int64)
    a, r, cosine = np.empty((most, 3)), np.empty(most), np.empty(most)
    n, s, b = np.empty(3), np.empty(3), np.empty(3)
    count = 0
    for y in range(h):
        for x in range(w):
            if wanted[y, x] == 0:
                continue
            ry, rx = _nearest_hit(index, y, x, beyond)
            if ry < 0:
                continue
            f = index[ry, rx]
            if labelled and not _has_label(part, faces[f], wanted[y, x]):
                continue
            towards = _meet(v, faces[f], (rx - cx) / fx, (ry - cy) / fy, n, s, b)
            if towards < (OBLIQUE if ry == y and rx == x else 0.0):
                continue
            along, apart = 0.0, 0.0
            for k in range(3):
                away = points[y, x, k] - s[k]
                along += n[k] * away
                apart += away * away
            if abs(along) > gate or apart > APART_M * APART_M:
                continue
            for c in range(3):
                i = faces[f, c]
                a[count, c] = b[c] * (n[0] * d[i, 0] + n[1] * d[i, 1] + n[2] * d[i, 2])
            inside = ry == y and rx == x
            face[count], r[count], cosine[count] = f, along, towards if inside else RIM
            count += 1
    return face[:count], a[:count], r[:count], cosine[:count]


@njit(cache=True, nogil=True)
def _nearest_hit(index, y, x, beyond):
    """Pixel that sees the skin, this one or the nearest; -1, -1 if none is near enough."""
    if index[y, x] >= 0:
        return y, x
    h, w = index.shape
    best, ry, rx = beyond * beyond + 1, -1, -1
    for i in range(max(0, y - beyond), min(h, y + beyond + 1)):
        for j in range(max(0, x - beyond), min(w, x + beyond + 1)):
            away = (i - y) * (i - y) + (j - x) * (j - x)
            if index[i, j] >= 0 and away < best:
                best, ry, rx = away, i, j
    return ry, rx


@njit(cache=True, nogil=True)
def _has_label(part, corners, label):
    return part[corners[0]] == label or part[corners[1]] == label or part[corners[2]] == label


@njit(cache=True, nogil=True)
def _meet(v, corners, qx, qy, n, s, b):
    """Normal, point and barycentric coordinates where a ray meets a triangle, and their cosine."""
    o, p, q = v[corners[0]], v[corners[1]], v[corners[2]]
    ux, uy, uz = p[0] - o[0], p[1] - o[1], p[2] - o[2]
    vx, vy, vz = q[0] - o[0], q[1] - o[1], q[2] - o[2]
    n[0], n[1], n[2] = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    twice = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    if twice == 0.0:
        return -1.0
    n /= twice
    slope = n[0] * qx + n[1] * qy + n[2]
    if slope >= -1e-6:
        return -1.0
    z = (n[0] * o[0] + n[1] * o[1] + n[2] * o[2]) / slope
    s[0], s[1], s[2] = z * qx, z * qy, z
    x, y, z = s[0] - o[0], s[1] - o[1], s[2] - o[2]
    b[1] = (n[0] * (y * vz - z * vy) + n[1] * (z * vx - x * vz) + n[2] * (x * vy - y * vx)) / twice
    b[2] = (n[0] * (uy * z - uz * y) + n[1] * (uz * x - ux * z) + n[2] * (ux * y - uy * x)) / twice
    b[0] = 1.0 - b[1] - b[2]
    return -slope / np.sqrt(qx * qx + qy * qy + 1.0)
