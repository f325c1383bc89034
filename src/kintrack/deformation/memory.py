# SPDX-License-Identifier: Apache-2.0
"""What all frames so far said about the offsets, triangle by triangle.

Recursive least squares with forgetting, in information form: a frame's rows a of a triangle's
pixels sum up to H = sum w a a^T and g = sum w a (r + a . o), o the corners' offsets at that time.
With k = exp(-dt / memory), H_f becomes k H_f + (1 - k) H and g_f alike, in a frame that shows the
triangle. While nobody sees it, both stay as they are, so what is hidden keeps its shape. H_f grows
to what one frame says: what was seen shortly counts less against the template.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int
from numba import njit
from numpy import ndarray

from kintrack.deformation.evidence import Evidence


def remembered(
    H: Float[ndarray, "f 6"],
    g: Float[ndarray, "f 3"],
    evidence: Evidence,
    faces: Int[ndarray, "f 3"],
    offsets_m: Float[ndarray, " v"],
    kept: float,
) -> tuple[Float[ndarray, "f 6"], Float[ndarray, "f 3"]]:
    """The memory after one more frame.

    Args:
        H: Upper triangle of every H_f, row by row.
        g: Every g_f [m].
        evidence: What the frame says.
        faces: Triangles.
        offsets_m: Offsets with which the evidence was found [m].
        kept: What is left of the old in triangles that the frame shows, 0 to 1.

    Returns:
        New H and g.
    """
    H, g = H.copy(), g.copy()
    _add(
        H,
        g,
        evidence.face,
        evidence.a,
        evidence.residual_m,
        evidence.weight,
        faces,
        offsets_m,
        kept,
    )
    return H, g


@njit(cache=True, nogil=True)
def _add(H, g, face, a, r, weight, faces, o, kept):
    seen = np.zeros(H.shape[0], dtype=np.bool_)
    for i in range(face.shape[0]):
        w = (1.0 - kept) * weight[i]
        if w == 0.0:
            continue
        f = face[i]
        if not seen[f]:
            seen[f] = True
            H[f] *= kept
            g[f] *= kept
        x, y, z = a[i, 0], a[i, 1], a[i, 2]
        target = w * (r[i] + x * o[faces[f, 0]] + y * o[faces[f, 1]] + z * o[faces[f, 2]])
        H[f, 0] += w * x * x
        H[f, 1] += w * x * y
        H[f, 2] += w * x * z
        H[f, 3] += w * y * y
        H[f, 4] += w * y * z
        H[f, 5] += w * z * z
        g[f, 0] += target * x
        g[f, 1] += target * y
        g[f, 2] += target * z
