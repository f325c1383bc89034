# SPDX-License-Identifier: Apache-2.0
"""Scores of joint positions against a reference; NaN means missing, in either of the two."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

THRESHOLDS_M = np.arange(2, 21) / 100.0
"""Distances within which a joint counts as found [m]: 2 to 20 cm, 1 cm apart."""

SWAP_LIMBS = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
"""Joints that come as a left and a right one, looked at for swaps."""

SWAP_MIN_GAP_M = 0.15
"""Left and right nearer than this in the reference [m] cannot be told apart by it."""


@dataclass(frozen=True)
class Scores:
    """How far J estimated joints lie from their reference over the frames that have both."""

    joint_names: tuple[str, ...]
    """Names of the J joints compared."""
    frames: int
    """Frames in which at least one joint could be compared."""
    samples: int
    """Joints compared, summed over frames; every mean below is over these unless said."""
    coverage: float
    """Share of the reference's joints that have an estimate, 0 to 1."""
    mean_m: float
    """Mean distance [m]."""
    median_m: float
    """Median distance [m]."""
    joint_mean_m: Float[ndarray, " j"]
    """Mean distance of each joint [m], shape (J,); NaN for a joint never compared."""
    joint_median_m: Float[ndarray, " j"]
    """Median distance of each joint [m], shape (J,)."""
    thresholds_m: Float[ndarray, " t"]
    """Distances of the accuracy curve [m], shape (T,)."""
    accuracy: Float[ndarray, " t"]
    """Share of samples at most that far away, 0 to 1, shape (T,)."""
    offset_free_camera_mean_m: float
    """Mean distance once each joint's mean offset in the camera frame is taken off [m]."""
    offset_free_torso_mean_m: float
    """The same with offsets that turn with the torso [m]; over frames whose torso is known."""
    acceleration_error_m_s2: float
    """Mean length of the difference of accelerations [m/s^2]."""
    jitter_m_s2: float
    """Standard deviation of the estimate's accelerations [m/s^2]; real motion counts too."""
    reference_jitter_m_s2: float
    """The same of the reference, over the same samples [m/s^2]: what to compare jitter with."""
    swaps: dict[str, int]
    """Limb -> frames in which its left and right joints are exchanged."""
    swap_frames: int
    """Frames in which at least one limb is exchanged."""

    def to_dict(self) -> dict[str, Any]:
        """The scores in lists, numbers and strings; NaN stays for the writer to make null."""
        per_joint = {
            name: {"mean_m": float(mean), "median_m": float(median)}
            for name, mean, median in zip(
                self.joint_names, self.joint_mean_m, self.joint_median_m, strict=True
            )
        }
        content = asdict(self)
        for field in ("joint_names", "joint_mean_m", "joint_median_m"):
            del content[field]
        return content | {
            "joints": per_joint,
            "thresholds_m": self.thresholds_m.tolist(),
            "accuracy": self.accuracy.tolist(),
        }


def score(
    joint_names: Sequence[str],
    estimate_m: Float[ndarray, "n j 3"],
    reference_m: Float[ndarray, "n j 3"],
    timestamps_s: Float[ndarray, " n"],
    Rs_camera_torso: Float[ndarray, "n 3 3"],
) -> Scores:
    """Every score of an estimate against a reference.

    To score some frames only, set the others to NaN instead of cutting them out: accelerations
    are then never taken across a gap.

    Args:
        joint_names: Names of the J joints.
        estimate_m: Estimated joints in the camera frame [m], shape (N, J, 3).
        reference_m: Reference joints in the camera frame [m], shape (N, J, 3).
        timestamps_s: Time stamps [s], shape (N,).
        Rs_camera_torso: Attitude of the torso, shape (N, 3, 3), from `torso_rotations`.

    Returns:
        The scores; NaN where nothing could be compared.
    """
    distances_m = joint_distances(estimate_m, reference_m)
    seen = np.isfinite(distances_m)
    in_reference = np.isfinite(reference_m).all(axis=-1)
    accelerations = accelerations_m_s2(estimate_m, timestamps_s)
    reference_accelerations = accelerations_m_s2(reference_m, timestamps_s)
    difference = accelerations - reference_accelerations
    in_both = np.isfinite(difference).all(axis=-1)
    swapped = swapped_limbs(joint_names, estimate_m, reference_m)
    any_swapped = np.any(list(swapped.values()), axis=0) if swapped else np.zeros(0, dtype=bool)
    return Scores(
        joint_names=tuple(joint_names),
        frames=int(seen.any(axis=1).sum()),
        samples=int(seen.sum()),
        coverage=float(seen.sum() / in_reference.sum()) if in_reference.any() else np.nan,
        mean_m=_mean(distances_m),
        median_m=_median(distances_m),
        joint_mean_m=np.array([_mean(joint) for joint in distances_m.T]),
        joint_median_m=np.array([_median(joint) for joint in distances_m.T]),
        thresholds_m=THRESHOLDS_M,
        accuracy=accuracy_curve(distances_m, THRESHOLDS_M),
        offset_free_camera_mean_m=_mean(offset_free_distances(estimate_m, reference_m)),
        offset_free_torso_mean_m=_mean(
            offset_free_distances(estimate_m, reference_m, Rs_camera_torso)
        ),
        acceleration_error_m_s2=_mean(np.linalg.norm(difference, axis=-1)),
        jitter_m_s2=_spread(accelerations, in_both),
        reference_jitter_m_s2=_spread(reference_accelerations, in_both),
        swaps={limb: int(frames.sum()) for limb, frames in swapped.items()},
        swap_frames=int(any_swapped.sum()),
    )


def joint_distances(
    estimate_m: Float[ndarray, "n j 3"], reference_m: Float[ndarray, "n j 3"]
) -> Float[ndarray, "n j"]:
    """Distance of each joint from its reference [m], shape (N, J); NaN where one is missing."""
    return np.linalg.norm(estimate_m - reference_m, axis=-1)


def accuracy_curve(
    distances_m: Float[ndarray, "n j"], thresholds_m: Float[ndarray, " t"]
) -> Float[ndarray, " t"]:
    """Share of the finite distances at most each threshold, shape (T,); NaN if there are none."""
    finite = distances_m[np.isfinite(distances_m)]
    if finite.size == 0:
        return np.full(len(thresholds_m), np.nan)
    return np.mean(finite[:, None] <= thresholds_m[None, :], axis=0)  # (T,)


def offset_free_distances(
    estimate_m: Float[ndarray, "n j 3"],
    reference_m: Float[ndarray, "n j 3"],
    Rs_camera_torso: Float[ndarray, "n 3 3"] | None = None,
) -> Float[ndarray, "n j"]:
    """Distances once each joint's constant offset over the sequence is taken off.

    Two skeletons that name a joint alike may place it apart (a hip at its socket or at the
    pelvis' rim); a constant offset between them is a convention, not an error of tracking.

        d_nj = R_n^T (e_nj - r_nj),   distance = |d_nj - mean_n d_nj|

    Without rotations (R = 1) the offset is constant in the camera frame, which suits a person who
    keeps facing one way, and also takes off an offset between two cameras. With the torso's
    attitude the offset turns with the person, as that of two skeletons on one body does.
    The fewer the frames, the more of the error the mean takes with it.

    Args:
        estimate_m: Estimated joints [m], shape (N, J, 3).
        reference_m: Reference joints [m], shape (N, J, 3).
        Rs_camera_torso: Attitude of the torso, shape (N, 3, 3), NaN where unknown; None for the
            offset in the camera frame.

    Returns:
        Distances [m], shape (N, J); NaN where a joint or the torso is missing.
    """
    offsets = estimate_m - reference_m
    if Rs_camera_torso is not None:
        offsets = np.einsum("nji,nkj->nki", Rs_camera_torso, offsets)
    valid = np.isfinite(offsets).all(axis=-1, keepdims=True)  # (N, J, 1)
    total = np.where(valid, offsets, 0.0).sum(axis=0)  # (J, 3)
    mean = total / np.maximum(valid.sum(axis=0), 1)
    return np.linalg.norm(np.where(valid, offsets - mean, np.nan), axis=-1)


def torso_rotations(
    joint_names: Sequence[str], positions_m: Float[ndarray, "n j 3"]
) -> Float[ndarray, "n 3 3"]:
    """Attitude of the torso from hips and shoulders: x forward, y left, z up.

    Args:
        joint_names: Names of the J joints.
        positions_m: Joints in the camera frame [m], shape (N, J, 3).

    Returns:
        R_camera_torso, shape (N, 3, 3); NaN where one of the four joints is missing.
    """
    needed = ("l_hip", "r_hip", "l_shoulder", "r_shoulder")
    if any(name not in joint_names for name in needed):
        return np.full((len(positions_m), 3, 3), np.nan)
    l_hip, r_hip, l_shoulder, r_shoulder = (
        positions_m[:, list(joint_names).index(name)] for name in needed
    )
    up = _unit(l_shoulder + r_shoulder - l_hip - r_hip)
    left = l_shoulder + l_hip - r_shoulder - r_hip
    left = _unit(left - np.sum(left * up, axis=1, keepdims=True) * up)
    return np.stack([np.cross(left, up), left, up], axis=-1)


def accelerations_m_s2(
    positions_m: Float[ndarray, "n j 3"], timestamps_s: Float[ndarray, " n"]
) -> Float[ndarray, "m j 3"]:
    """Second differences of positions for times that need not be evenly spaced.

        a_n = 2 (v_{n,n+1} - v_{n-1,n}) / (t_{n+1} - t_{n-1}),   v_{a,b} = (x_b - x_a) / (t_b - t_a)

    Args:
        positions_m: Joints [m], shape (N, J, 3).
        timestamps_s: Time stamps [s], shape (N,).

    Returns:
        Accelerations at the inner frames [m/s^2], shape (max(N - 2, 0), J, 3); NaN where one of
        the three frames lacks the joint or time does not advance.
    """
    if len(positions_m) < 3:
        return np.empty((0, *positions_m.shape[1:]))
    steps_s = np.diff(timestamps_s)
    steps_s = np.where(steps_s > 0, steps_s, np.nan)[:, None, None]  # (N - 1, 1, 1)
    velocities = np.diff(positions_m, axis=0) / steps_s
    return 2.0 * np.diff(velocities, axis=0) / (steps_s[1:] + steps_s[:-1])


def swapped_limbs(
    joint_names: Sequence[str],
    estimate_m: Float[ndarray, "n j 3"],
    reference_m: Float[ndarray, "n j 3"],
) -> dict[str, Bool[ndarray, " n"]]:
    """Frames in which a limb's left and right joints are exchanged.

    Exchanged means that the estimated left joint lies nearer the reference's right than its left,
    and the estimated right nearer the reference's left; frames whose two reference joints are
    less than `SWAP_MIN_GAP_M` apart are never counted.

    Args:
        joint_names: Names of the J joints.
        estimate_m: Estimated joints [m], shape (N, J, 3).
        reference_m: Reference joints [m], shape (N, J, 3).

    Returns:
        Limb -> flags, shape (N,), for the limbs whose two joints are both named.
    """
    index = {name: number for number, name in enumerate(joint_names)}
    swapped = {}
    for limb in SWAP_LIMBS:
        if f"l_{limb}" not in index or f"r_{limb}" not in index:
            continue
        pair = [index[f"l_{limb}"], index[f"r_{limb}"]]
        estimate, reference = estimate_m[:, pair], reference_m[:, pair]  # (N, 2, 3)
        own = joint_distances(estimate, reference)
        other = joint_distances(estimate, reference[:, ::-1])
        apart = np.linalg.norm(reference[:, 0] - reference[:, 1], axis=-1) >= SWAP_MIN_GAP_M
        swapped[limb] = (other < own).all(axis=1) & apart
    return swapped


def _unit(vectors: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
    """Vectors of length 1, shape (N, 3); NaN for those too short to have a direction."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(lengths > 1e-9, lengths, np.nan)


def _mean(values: ndarray) -> float:
    """Mean of the finite values; NaN if there are none."""
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if finite.size else float("nan")


def _median(values: ndarray) -> float:
    """Median of the finite values; NaN if there are none."""
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if finite.size else float("nan")


def _spread(vectors: Float[ndarray, "n j 3"], valid: Bool[ndarray, "n j"]) -> float:
    """Root mean square distance of the valid vectors from their joint's mean."""
    kept = np.where(valid[..., None], vectors, np.nan)
    distances = offset_free_distances(kept, np.zeros_like(kept))
    return float(np.sqrt(_mean(distances**2)))
