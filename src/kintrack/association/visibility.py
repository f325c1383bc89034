# SPDX-License-Identifier: Apache-2.0
"""Which vertices the camera could see if nothing but the body were there."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int
from numba import njit
from numpy import ndarray

from kintrack.geometry import PinholeCamera
from kintrack.raster import rasterise


def visible_vertices(
    vertices_camera: Float[ndarray, "v 3"],
    normals_camera: Float[ndarray, "v 3"],
    faces: Int[ndarray, "f 3"],
    camera: PinholeCamera,
    facing: float,
    tolerance_m: float,
) -> Bool[ndarray, " v"]:
    """Vertices that face the camera, lie in the image and are not hidden by the body itself.

    Args:
        vertices_camera: Vertices, camera frame [m].
        normals_camera: Outward unit normals.
        faces: Triangles of the skin.
        camera: Camera of the observation; the depth buffer has half its resolution.
        facing: Least cosine between normal and the ray to the camera.
        tolerance_m: Depth behind the body's own buffer that still counts as seen [m].

    Returns:
        True per visible vertex, shape (V,).
    """
    half = camera.scaled(2)
    depth, _ = rasterise(vertices_camera, faces, half)
    return _visible(
        vertices_camera,
        normals_camera,
        half.fx,
        half.fy,
        half.cx,
        half.cy,
        depth,
        facing,
        tolerance_m,
    )


@njit(cache=True, nogil=True)
def _visible(v, n, fx, fy, cx, cy, depth, facing, tolerance):
    h, w = depth.shape
    out = np.zeros(v.shape[0], dtype=np.bool_)
    for i in range(v.shape[0]):
        x, y, z = v[i, 0], v[i, 1], v[i, 2]
        if z <= 0.05:
            continue
        towards = -(n[i, 0] * x + n[i, 1] * y + n[i, 2] * z)
        if towards < facing * np.sqrt(x * x + y * y + z * z):
            continue
        u = int(np.floor(fx * x / z + cx + 0.5))
        r = int(np.floor(fy * y / z + cy + 0.5))
        if u < 0 or r < 0 or u >= w or r >= h:
            continue
        out[i] = z <= depth[r, u] + tolerance
    return out
