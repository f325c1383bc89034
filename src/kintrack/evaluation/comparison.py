# SPDX-License-Identifier: Apache-2.0
"""A result set against reference joints, frame by frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.errors import ResultError
from kintrack.metrics import Scores, joint_distances, score, torso_rotations
from kintrack.result import STATUSES, TRACK_FILE, Track
from kintrack.sequence.reference import REFERENCE_FILE, read_reference_joints


@dataclass(frozen=True)
class Evaluation:
    """A result set against its reference over the N frames whose index both have."""

    result: Path
    """The track that was scored."""
    reference: Path
    """What it was scored against."""
    reference_is_truth: bool
    """Whether distances are errors; False for a reference that errs itself, as a Kinect's does."""
    result_frames: int
    """Frames of the result."""
    reference_frames: int
    """Frames of the reference; the first N of both are compared."""
    status_counts: dict[str, int]
    """Status -> frames among the N."""
    posed: Scores
    """Scores over every frame with joint positions, whatever its status."""
    tracking: Scores
    """Scores over the frames with status `tracking`."""
    timestamps_s: Float[ndarray, " n"]
    """The result's time stamps [s], shape (N,)."""
    is_tracking: ndarray
    """Whether a frame's status is `tracking`, shape (N,)."""
    distances_m: Float[ndarray, "n j"]
    """Distance of each compared joint [m], shape (N, J); NaN where one is missing."""

    @property
    def measure(self) -> str:
        """What to call the distances: error, or distance to reference."""
        return "error" if self.reference_is_truth else "distance to reference"

    def to_dict(self) -> dict[str, Any]:
        """Everything but the per-frame arrays, for JSON."""
        return {
            "result": str(self.result),
            "reference": str(self.reference),
            "reference_is_truth": self.reference_is_truth,
            "measure": self.measure,
            "result_frames": self.result_frames,
            "reference_frames": self.reference_frames,
            "compared_frames": len(self.timestamps_s),
            "status_counts": self.status_counts,
            "posed_frames": self.posed.to_dict(),
            "tracking_frames": self.tracking.to_dict(),
        }


def evaluate(
    result_path: Path,
    reference_path: Path,
    *,
    reference_is_truth: bool,
    joints: Sequence[str] | None = None,
) -> Evaluation:
    """Compare a result with a reference, frame by frame of equal index.

    Where the lengths differ, the frames that both have are compared.

    Args:
        result_path: A result folder, or a track.npz.
        reference_path: A reference_joints.csv, a sequence folder with one, or another result.
        reference_is_truth: Whether the reference is exact, as that of a synthetic person is.
        joints: Names of the joints to compare; None for all that both have.

    Raises:
        ResultError: if a path holds nothing to compare, no frame or joint is common to both, or a
            joint of `joints` is missing from one.
    """
    track_file = _track_file(Path(result_path))
    track = Track.load(track_file)
    reference_file, reference_names, reference = _read_reference(Path(reference_path))
    reference_frames = len(reference)
    n = min(len(track), reference_frames)
    if n == 0:
        raise ResultError(
            f"no common frame: {track_file} has {len(track)}, "
            f"{reference_file} has {reference_frames}"
        )
    names = _joints_to_compare(track.joint_names, reference_names, joints)
    timestamps_s, reference = track.timestamps_s[:n], reference[:n]
    Rs_camera_torso = torso_rotations(reference_names, reference)
    reference = reference[:, [reference_names.index(name) for name in names]]
    estimate = track.joint_positions_camera_m[:n, [track.joint_names.index(name) for name in names]]
    is_tracking = track.status[:n] == "tracking"
    tracked = np.where(is_tracking[:, None, None], estimate, np.nan)
    return Evaluation(
        result=track_file,
        reference=reference_file,
        reference_is_truth=reference_is_truth,
        result_frames=len(track),
        reference_frames=reference_frames,
        status_counts={name: int(np.sum(track.status[:n] == name)) for name in STATUSES},
        posed=score(names, estimate, reference, timestamps_s, Rs_camera_torso),
        tracking=score(names, tracked, reference, timestamps_s, Rs_camera_torso),
        timestamps_s=timestamps_s,
        is_tracking=is_tracking,
        distances_m=joint_distances(estimate, reference),
    )


def _track_file(path: Path) -> Path:
    """The track.npz that a path means."""
    file = path / TRACK_FILE if path.is_dir() else path
    if not file.is_file():
        raise ResultError(f"{path}: no result there; give a result folder or its {TRACK_FILE}")
    return file


def _read_reference(path: Path) -> tuple[Path, tuple[str, ...], Float[ndarray, "n j 3"]]:
    """File, joint names and joint positions [m] (N, J, 3) of what a reference path means."""
    if (path / REFERENCE_FILE).is_file():
        path = path / REFERENCE_FILE
    elif (path / TRACK_FILE).is_file():
        path = path / TRACK_FILE
    if not path.is_file():
        raise ResultError(
            f"{path}: no reference there; give a {REFERENCE_FILE}, a sequence folder with one, "
            f"or another result"
        )
    if path.suffix == ".npz":
        track = Track.load(path)
        return path, track.joint_names, track.joint_positions_camera_m
    return path, *read_reference_joints(path)


def _joints_to_compare(
    estimated: Sequence[str], referenced: Sequence[str], wanted: Sequence[str] | None
) -> tuple[str, ...]:
    """Names that both have, in the result's order, or the wanted ones if both have them all."""
    common = tuple(name for name in estimated if name in referenced)
    if not common:
        raise ResultError(
            f"no common joint: the result has {', '.join(estimated)}; "
            f"the reference has {', '.join(referenced)}"
        )
    for name in wanted or ():
        if name not in common:
            raise ResultError(f"joint {name!r} is not in both; valid: {', '.join(common)}")
    return tuple(wanted) if wanted else common
