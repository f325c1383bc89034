# SPDX-License-Identifier: Apache-2.0
"""Left and right of labelled limbs, settled by a body that is known roughly.

What a pixel is, arm or leg, a network says reliably; whose side it is, it guesses where a back
looks like a front. A body that has been followed knows its sides. So a pixel of a limb goes over to
the other side's limb if that one is nearer by more than a margin: d_other^2 + s^2 < d_own^2.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, UInt8
from numba import njit
from numpy import ndarray

from kintrack.association.observation import Observation

OTHER_SIDE = np.array([0, 1, 2, 4, 3, 6, 5], dtype=np.uint8)
"""`OTHER_SIDE[label]` is the same part of the other side."""
FIRST_LIMB = 3
"""Labels from this one on have sides."""
FAR_M2 = 0.3**2
"""Own skin counts as no further from a pixel than this, also where none would be seen [m^2]."""
THIN = 4
"""Every how many vertices of a limb one is looked at."""


def settle_sides(
    observation: Observation,
    vertices_camera: Float[ndarray, "v 3"],
    visible: Bool[ndarray, " v"],
    vertex_labels: UInt8[ndarray, " v"],
    side_m: float,
) -> Observation:
    """The observation with the sides of its limbs settled.

    Args:
        observation: Labelled points of one person.
        vertices_camera: Skin where it is expected [m].
        visible: Vertices that the camera would see.
        vertex_labels: Their labels.
        side_m: s of the module; a pixel's side is believed this far [m].

    Returns:
        The observation with changed labels; unchanged without labels.
    """
    labels = observation.labels
    if labels is None:
        return observation
    index = np.flatnonzero(visible & (vertex_labels >= FIRST_LIMB))
    index = np.concatenate([index[vertex_labels[index] == part][::THIN] for part in range(3, 7)])
    settled = _settle(
        observation.points_camera,
        np.where(observation.region, labels, np.uint8(0)),
        vertices_camera[index],
        vertex_labels[index],
        side_m * side_m,
    )
    return replace(observation, labels=np.where(observation.region, settled, labels))


@njit(cache=True, nogil=True)
def _settle(points, labels, skin, part, margin):
    h, w = labels.shape
    out = labels.copy()
    for i in range(h):
        for j in range(w):
            label = labels[i, j]
            if label < FIRST_LIMB or label > 6:
                continue
            other = OTHER_SIDE[label]
            own2, other2 = np.inf, np.inf
            x, y, z = points[i, j, 0], points[i, j, 1], points[i, j, 2]
            for k in range(skin.shape[0]):
                if part[k] != label and part[k] != other:
                    continue
                d = (skin[k, 0] - x) ** 2 + (skin[k, 1] - y) ** 2 + (skin[k, 2] - z) ** 2
                if part[k] == label:
                    own2 = min(own2, d)
                else:
                    other2 = min(other2, d)
            if other2 + margin < min(own2, FAR_M2):
                out[i, j] = other
    return out
