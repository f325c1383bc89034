# SPDX-License-Identifier: Apache-2.0
"""Does a reference skeleton keep time with the depth images? Measured without the tracker.

A joint of a fast hand must lie near observed points. So for every shift of the reference against
the images, the distance from its moving elbows, wrists and hands to the nearest observed point is
averaged: the shift with the least distance is how far the reference runs ahead.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray
from scipy.spatial import cKDTree

from kintrack.metrics import joint_distances, offset_free_distances, swapped_limbs
from kintrack.sequence import open_sequence

LEADS = np.arange(-1, 5)
"""Frames by which the reference may run ahead of the images."""
FAST_M = 0.04
"""A joint that moves further than this from frame to frame takes part [m]."""


class Timing(NamedTuple):
    """One recording at every shift of `LEADS`, S of them."""

    to_points_m: Float[ndarray, " s"]
    """Mean distance of fast reference joints from the observed points [m]."""
    fast: int
    """Fast joints that were averaged."""
    distance_m: Float[ndarray, " s"]
    """Mean distance between estimate and shifted reference [m]."""
    offset_free_m: Float[ndarray, " s"]
    """The same without each joint's constant offset [m]."""
    swapped: Int[ndarray, " s"]
    """Frames with at least one limb's left and right exchanged."""


def timing(
    recording: Path,
    joints: tuple[str, ...],
    estimate: Float[ndarray, "n j 3"],
    reference: Float[ndarray, "n j 3"],
) -> Timing:
    """Compare images, estimate and reference at every shift.

    Args:
        recording: Folder of the recording.
        joints: Names of the joints.
        estimate: Estimated joints, camera frame [m].
        reference: Reference joints, camera frame [m].

    Returns:
        Distances per shift, over the frames that every shift has.
    """
    limbs = [i for i, name in enumerate(joints) if name.endswith(("elbow", "wrist"))]
    margin = int(np.abs(LEADS).max())
    inner = np.arange(margin, len(estimate) - margin)
    speed = np.linalg.norm(np.diff(reference[:, limbs], axis=0, append=np.nan), axis=2)
    sums, fast = np.zeros(len(LEADS)), 0
    sequence = open_sequence(recording)
    for i in inner:
        frame = sequence.frame(int(i))
        if frame.depth_m is None:
            continue
        points = frame.camera.back_project(frame.depth_m)
        tree = cKDTree(points[points[..., 2] > 0])
        moving = (speed[i - LEADS[:, None], np.arange(len(limbs))] > FAST_M).all(axis=0)
        if moving.any():
            shifted = reference[i - LEADS[:, None], np.array(limbs)[moving]]
            sums += np.asarray(tree.query(shifted)[0]).sum(axis=1)
            fast += int(moving.sum())
    pairs = [(estimate[inner], reference[inner - lead]) for lead in LEADS]
    return Timing(
        to_points_m=sums / max(fast, 1),
        fast=fast,
        distance_m=np.array([np.nanmean(joint_distances(*pair)) for pair in pairs]),
        offset_free_m=np.array([np.nanmean(offset_free_distances(*pair)) for pair in pairs]),
        swapped=np.array(
            [np.any(list(swapped_limbs(joints, *pair).values()), axis=0).sum() for pair in pairs]
        ),
    )
