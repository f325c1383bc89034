# SPDX-License-Identifier: Apache-2.0
"""Results on real recordings of whole scenes against an image-based witness (MediaPipe Pose).

The witness is no truth: shoulders and hips are image landmarks, it guesses hidden limbs, and where
several people are in view it jumps between them. What is counted is agreement.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.bench.cases import Case
from kintrack.joints import JOINT_NAMES
from kintrack.metrics import SWAP_LIMBS
from kintrack.result import STATUSES, TRACK_FILE, Track
from kintrack.sequence import open_sequence
from kintrack.sequence.reference import read_reference_pixels

PIXELS_FILE = "reference_mediapipe.csv"
VISIBLE = 0.8
"""Joints of the witness of at most this visibility are not compared."""
NEAR = 0.2
"""A joint agrees within this share of the torso's length in the image (PCK@0.2)."""
APART = 0.3
"""Left and right nearer than this share of it cannot be told apart."""


def witnessed(case: Case, result: Path) -> dict[str, Any]:
    """Scores of one recording.

    Returns:
        `pck` over all joints that the witness sees well, those without a pose missed, `pck_posed`
        over frames with a pose, `joints` how many they are, `swapped_frames` in which a limb's left
        and right are nearer the witness's right and left, shares by `status`, `locked_after` the
        frames up to the first that is tracked, and `largest_step_m`, the farthest that the pelvis
        moves between two tracked frames that follow each other: a jump to somebody else shows.
    """
    sequence, track = open_sequence(case.sequence), Track.load(result / TRACK_FILE)
    names, pixels, visibility = read_reference_pixels(case.sequence / PIXELS_FILE)
    n = min(len(track), len(pixels))
    pixels, visibility = pixels[:n], visibility[:n]
    points = track.joint_positions_camera_m[:n, [track.joint_names.index(name) for name in names]]
    known = np.isfinite(points).all(axis=-1) & (np.nan_to_num(points[..., 2]) > 0.05)
    safe = np.where(known[..., None], points, 1.0)
    estimate = np.where(known[..., None], sequence.camera.project(safe), np.nan)
    torso_px = torso_lengths_px(names, pixels)
    compared = (visibility > VISIBLE) & np.isfinite(torso_px)[:, None]
    # NaN, a joint without an estimate, is not near
    near = np.linalg.norm(estimate - pixels, axis=-1) <= NEAR * torso_px[:, None]
    pelvis = track.joint_positions_camera_m[:, JOINT_NAMES.index("pelvis")]
    steps = np.linalg.norm(np.diff(pelvis, axis=0), axis=-1)
    both = (track.status[1:] == "tracking") & (track.status[:-1] == "tracking")
    steps = steps[both & np.isfinite(steps)]
    tracking = np.flatnonzero(track.status == "tracking")
    return {
        "frames": len(track),
        "status": {name: float(np.mean(track.status == name)) for name in STATUSES},
        "joints": int(compared.sum()),
        "pck": float(near[compared].mean()) if compared.any() else None,
        "pck_posed": float(near[compared & known].mean()) if (compared & known).any() else None,
        "swapped_frames": swapped_frames(names, estimate, pixels, compared, torso_px),
        "locked_after": int(tracking[0]) + 1 if len(tracking) else None,
        "largest_step_m": float(steps.max()) if len(steps) else None,
    }


def swapped_frames(
    names: tuple[str, ...],
    estimate: Float[ndarray, "n j 2"],
    pixels: Float[ndarray, "n j 2"],
    compared: ndarray,
    torso_px: Float[ndarray, " n"],
) -> int:
    """Frames in which both joints of a limb lie nearer the witness's joint of the other side."""
    swapped = np.zeros(len(pixels), dtype=bool)
    for limb in SWAP_LIMBS:
        if f"l_{limb}" not in names or f"r_{limb}" not in names:
            continue
        pair = [names.index(f"l_{limb}"), names.index(f"r_{limb}")]
        own = np.linalg.norm(estimate[:, pair] - pixels[:, pair], axis=-1)
        other = np.linalg.norm(estimate[:, pair] - pixels[:, pair[::-1]], axis=-1)
        gap = np.linalg.norm(pixels[:, pair[0]] - pixels[:, pair[1]], axis=-1)
        told = compared[:, pair].all(axis=1) & (gap > APART * torso_px)
        swapped |= (other < own).all(axis=1) & told
    return int(swapped.sum())


def torso_lengths_px(
    names: tuple[str, ...], pixels: Float[ndarray, "n j 2"]
) -> Float[ndarray, " n"]:
    """Distance from mid-shoulder to mid-hip in each frame [px], shape (N,)."""
    ends = [
        0.5 * (pixels[:, names.index(f"l_{limb}")] + pixels[:, names.index(f"r_{limb}")])
        for limb in ("shoulder", "hip")
    ]
    return np.linalg.norm(ends[0] - ends[1], axis=-1)
