# SPDX-License-Identifier: Apache-2.0
"""Which cells of a regular grid lie inside a closed surface."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int
from numba import njit
from numpy import ndarray

OFFSET_M = (1.3e-5, 2.9e-5)
"""Columns stand this far beside the grid, so that hardly any passes exactly through an edge [m]."""


def inside_points(
    vertices: Float[ndarray, "v 3"], faces: Int[ndarray, "f 3"], cell_m: float
) -> Float[ndarray, "n 3"]:
    """Grid points inside a closed surface: an odd number of its triangles lies above them.

    Args:
        vertices: Vertices [m].
        faces: Triangles of a closed surface.
        cell_m: Distance of the grid points [m].

    Returns:
        The points, x slowest, z fastest [m].
    """
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    axes = [np.arange(lo, hi, cell_m) for lo, hi in zip(low, high, strict=True)]
    counts = np.array([len(axis) for axis in axes])
    inside = _inside(vertices, faces, low, cell_m, counts, np.array(OFFSET_M))
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    return np.asarray(grid[inside])


@njit(cache=True)
def _inside(v, faces, low, cell, counts, offset) -> Bool[ndarray, "x y z"]:
    inside = np.zeros((counts[0], counts[1], counts[2]), dtype=np.bool_)
    for f in range(faces.shape[0]):
        a, b, c = v[faces[f, 0]], v[faces[f, 1]], v[faces[f, 2]]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0.0:
            continue
        x0, x1 = min(a[0], b[0], c[0]), max(a[0], b[0], c[0])
        y0, y1 = min(a[1], b[1], c[1]), max(a[1], b[1], c[1])
        i0 = max(int(np.floor((x0 - low[0]) / cell)) - 1, 0)
        i1 = min(int(np.ceil((x1 - low[0]) / cell)) + 1, counts[0])
        j0 = max(int(np.floor((y0 - low[1]) / cell)) - 1, 0)
        j1 = min(int(np.ceil((y1 - low[1]) / cell)) + 1, counts[1])
        for i in range(i0, i1):
            x = low[0] + i * cell + offset[0]
            for j in range(j0, j1):
                y = low[1] + j * cell + offset[1]
                p = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area
                q = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area
                if p < 0.0 or q < 0.0 or p + q > 1.0:
                    continue
                z = p * a[2] + q * b[2] + (1.0 - p - q) * c[2]
                below = min(int(np.ceil((z - low[2]) / cell)), counts[2])
                for k in range(below):
                    inside[i, j, k] = not inside[i, j, k]
    return inside
