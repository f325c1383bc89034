# SPDX-License-Identifier: Apache-2.0
"""A depth buffer for triangle meshes: which surface a pixel sees."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int
from numba import njit
from numpy import ndarray

from kintrack.geometry import PinholeCamera

NEAR_M = 0.05
"""Triangles with a corner nearer than this are left out [m]."""


def rasterise(
    vertices_camera: Float[ndarray, "v 3"], faces: Int[ndarray, "f 3"], camera: PinholeCamera
) -> tuple[Float[ndarray, "h w"], Int[ndarray, "h w"]]:
    """Depth and nearest triangle at every pixel centre.

    Args:
        vertices_camera: Vertices, camera frame [m], shape (V, 3).
        faces: Triangles, shape (F, 3).
        camera: Camera that sets the image size.

    Returns:
        Depth along z [m], inf where nothing is seen, and triangle index, -1 there; both (H, W).
    """
    depth = np.full((camera.height, camera.width), np.inf)
    index = np.full((camera.height, camera.width), -1, dtype=np.int32)
    _fill(vertices_camera, faces, camera.fx, camera.fy, camera.cx, camera.cy, depth, index)
    return depth, index


@njit(cache=True, nogil=True)
def _fill(v, faces, fx, fy, cx, cy, depth, index):
    h, w = depth.shape
    pu = np.empty(v.shape[0])
    pv = np.empty(v.shape[0])
    for i in range(v.shape[0]):
        z = max(v[i, 2], NEAR_M)
        pu[i] = fx * v[i, 0] / z + cx
        pv[i] = fy * v[i, 1] / z + cy
    for f in range(faces.shape[0]):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        if min(v[a, 2], v[b, 2], v[c, 2]) < NEAR_M:
            continue
        area = (pu[b] - pu[a]) * (pv[c] - pv[a]) - (pv[b] - pv[a]) * (pu[c] - pu[a])
        if area == 0.0:
            continue
        u0 = max(0, int(np.ceil(min(pu[a], pu[b], pu[c]))))
        u1 = min(w - 1, int(np.floor(max(pu[a], pu[b], pu[c]))))
        v0 = max(0, int(np.ceil(min(pv[a], pv[b], pv[c]))))
        v1 = min(h - 1, int(np.floor(max(pv[a], pv[b], pv[c]))))
        ia, ib, ic = 1.0 / v[a, 2], 1.0 / v[b, 2], 1.0 / v[c, 2]
        for y in range(v0, v1 + 1):
            for x in range(u0, u1 + 1):
                wb = ((x - pu[a]) * (pv[c] - pv[a]) - (y - pv[a]) * (pu[c] - pu[a])) / area
                wc = ((pu[b] - pu[a]) * (y - pv[a]) - (pv[b] - pv[a]) * (x - pu[a])) / area
                wa = 1.0 - wb - wc
                if wa < 0.0 or wb < 0.0 or wc < 0.0:
                    continue
                z = 1.0 / (wa * ia + wb * ib + wc * ic)
                if z < depth[y, x]:
                    depth[y, x] = z
                    index[y, x] = f
