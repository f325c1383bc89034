# SPDX-License-Identifier: Apache-2.0
"""What two opinions on one frame disagree about: labels, not joints."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, UInt8
from numpy import ndarray

from kintrack.geometry import LABELS
from kintrack.joints import JOINT_NAMES
from kintrack.labelling.keeping import KeepingConfig, Reason
from kintrack.metrics import swapped_limbs


def disputes(
    labels: UInt8[ndarray, "h w"],
    others: UInt8[ndarray, "h w"],
    joints_camera: Float[ndarray, "j 3"],
    joints_other_camera: Float[ndarray, "j 3"],
    config: KeepingConfig,
) -> tuple[Reason, ...]:
    """What two opinions on one frame disagree about.

    Args:
        labels: Labels by one opinion.
        others: Labels by the other.
        joints_camera: Joints of the one, in the order of `JOINT_NAMES` [m].
        joints_other_camera: Joints of the other [m].
        config: Thresholds.

    Returns:
        The reasons; none if they agree.
    """
    out = []
    either = (labels > 0) | (others > 0)
    total = max(int(either.sum()), 1)
    disputed = int((labels != others).sum()) / total
    if disputed > config.max_disputed:
        text = f"{disputed:.0%} of the person's pixels, above {config.max_disputed:.0%}"
        out.append(Reason("opinions differ", text))
    iou = part_iou(labels, others, config.part_share)
    if np.nanmin(iou, initial=1.0) < config.min_part_agreement:
        part = int(np.nanargmin(iou))
        text = f"{LABELS[part]} agrees to {iou[part]:.0%}, below {config.min_part_agreement:.0%}"
        out.append(Reason("opinions differ", text))
        swapped = swapped_limbs(JOINT_NAMES, joints_camera[None], joints_other_camera[None])
        limbs = [limb for limb, found in swapped.items() if found[0]]
        if limbs:
            out.append(Reason("swap", f"left and right {', '.join(limbs)} change places"))
    return tuple(out)


def part_iou(
    labels: UInt8[ndarray, "h w"], others: UInt8[ndarray, "h w"], share: float
) -> Float[ndarray, " k"]:
    """Intersection over union per label; NaN for background and for parts hardly in either.

    Args:
        labels: One label image.
        others: Another of the same size.
        share: Share of the person's pixels, of the larger of the two, that a part must have.
    """
    k = len(LABELS)
    table = np.bincount(k * labels.ravel().astype(int) + others.ravel(), minlength=k * k)
    table = table.reshape(k, k).astype(float)
    both = np.diag(table)
    mine, theirs = table.sum(axis=1), table.sum(axis=0)
    person = max(mine[1:].sum(), theirs[1:].sum(), 1.0)
    seen = np.maximum(mine, theirs) >= share * person
    seen[0] = False
    return np.where(seen, both / np.maximum(mine + theirs - both, 1.0), np.nan)
