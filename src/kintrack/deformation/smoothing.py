# SPDX-License-Identifier: Apache-2.0
"""The offsets that agree best with what was seen, with their neighbours and with the template.

minimise  sum_f (o_f^T H_f o_f / 2 - g_f . o_f) + smooth/2 sum_edges (o_i - o_j)^2 + hold/2 |o|^2

by a fixed number of conjugate gradient steps (Hestenes & Stiefel 1952) with the diagonal as
preconditioner, from the last frame's offsets. The matrix is never formed: a triangle carries its
own 3x3 block of data, and half of each of its edges.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int
from numba import njit
from numpy import ndarray


def smoothed(
    offsets_m: Float[ndarray, " v"],
    H: Float[ndarray, "f 6"],
    g: Float[ndarray, "f 3"],
    faces: Int[ndarray, "f 3"],
    smooth: float,
    hold: float,
    iterations: int,
) -> Float[ndarray, " v"]:
    """Offsets nearer to the minimum [m].

    Args:
        offsets_m: Where to begin [m].
        H: Upper triangles of the data's matrices, row by row.
        g: The data's right-hand sides [m].
        faces: Triangles of a closed surface.
        smooth: Weight of neighbours against one pixel.
        hold: Weight of the template against one pixel.
        iterations: Steps.
    """
    return _solve(offsets_m, _with_edges(H, 0.5 * smooth), g, faces, hold, iterations)


@njit(cache=True, nogil=True)
def _with_edges(H, k):
    out = H.copy()
    for f in range(H.shape[0]):
        for c in (0, 3, 5):
            out[f, c] += 2.0 * k
        for c in (1, 2, 4):
            out[f, c] -= k
    return out


@njit(cache=True, nogil=True)
def _solve(start, H, g, faces, hold, iterations):
    x = start.copy()
    diagonal = np.full(len(x), hold)
    r = np.zeros(len(x))
    for f in range(faces.shape[0]):
        for c, k in ((0, 0), (1, 3), (2, 5)):
            diagonal[faces[f, c]] += H[f, k]
            r[faces[f, c]] += g[f, c]
    r -= _times(H, faces, hold, x)
    z = r / diagonal
    p = z.copy()
    before = np.dot(r, z)
    for _ in range(iterations):
        if before <= 1e-20:
            break
        q = _times(H, faces, hold, p)
        step = before / np.dot(p, q)
        x += step * p
        r -= step * q
        z = r / diagonal
        after = np.dot(r, z)
        p = z + after / before * p
        before = after
    return x


@njit(cache=True, nogil=True)
def _times(H, faces, hold, x):
    y = hold * x
    for f in range(faces.shape[0]):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        y[a] += H[f, 0] * x[a] + H[f, 1] * x[b] + H[f, 2] * x[c]
        y[b] += H[f, 1] * x[a] + H[f, 3] * x[b] + H[f, 4] * x[c]
        y[c] += H[f, 2] * x[a] + H[f, 4] * x[b] + H[f, 5] * x[c]
    return y
