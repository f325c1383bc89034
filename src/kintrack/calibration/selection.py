# SPDX-License-Identifier: Apache-2.0
"""A few frames that differ: poses and headings far from each other, the person well seen."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from kintrack.joints import JOINT_NAMES

PELVIS = JOINT_NAMES.index("pelvis")


def distances(joints_m: Float[ndarray, "n j 3"]) -> Float[ndarray, "n n"]:
    """How much poses differ: mean distance of the joints, the pelvis in one place [m].

    Args:
        joints_m: Joint centres, axes of the camera, so that a turned body differs too.
    """
    x = joints_m - joints_m[:, PELVIS, None]
    return np.stack([np.linalg.norm(x - y, axis=2).mean(axis=1) for y in x])


def varied(
    joints_m: Float[ndarray, "n j 3"], seen: Float[ndarray, " n"], count: int
) -> Int[ndarray, " m"]:
    """Frames chosen one after the other, each the farthest from those before it.

    A frame's distance counts by how much of the person it shows, so that a hidden limb's guessed
    pose does not win.

    Args:
        joints_m: Joint centres of N frames [m].
        seen: How well each shows the person, 0 to 1.
        count: How many are wanted.

    Returns:
        At most `count` of the N frames, in order.
    """
    if not len(joints_m):
        return np.zeros(0, dtype=np.int64)
    chosen = [int(np.argmax(seen))]
    x = joints_m - joints_m[:, PELVIS, None]
    near = np.full(len(x), np.inf)
    free = np.ones(len(x), dtype=bool)
    while len(chosen) < min(count, len(x)):
        last = np.linalg.norm(x - x[chosen[-1]], axis=2).mean(axis=1)
        near = np.minimum(near, last)
        free[chosen[-1]] = False
        chosen.append(int(np.argmax(np.where(free, near * seen, -1.0))))
    return np.sort(chosen)


def spread(joints_m: Float[ndarray, "n j 3"]) -> float:
    """Mean difference between the frames [m]; 0 for one frame."""
    n = len(joints_m)
    return float(distances(joints_m).sum() / (n * (n - 1))) if n > 1 else 0.0
