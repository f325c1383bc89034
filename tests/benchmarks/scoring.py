# SPDX-License-Identifier: Apache-2.0
"""Scores of fitted recordings: frame by frame for one, pooled over frames and joints for many."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray
from scipy.spatial.transform import Rotation
from timing import Timing, timing

from kintrack.fit import load_person, posed_skin
from kintrack.metrics import (
    THRESHOLDS_M,
    accuracy_curve,
    joint_distances,
    offset_free_distances,
    swapped_limbs,
    torso_rotations,
)
from kintrack.result import TRACK_FILE, Track
from kintrack.sequence.reference import read_reference_joints

JOINT_KINDS = ("head", "shoulder", "elbow", "wrist", "hip", "knee", "ankle")
"""Joints compared; all but the head come left and right."""

JOINTS = (
    "head",
    *(f"{s}_{kind}" for kind in JOINT_KINDS[1:] for s in "lr"),
)
"""Names of the J = 13 joints compared."""

ACTIONS = {
    1: "swipe",
    3: "wave",
    4: "clap",
    6: "arm cross",
    13: "boxing",
    16: "arm curl",
    21: "pick up and throw",
    22: "jog",
    23: "walk",
    24: "sit to stand",
    25: "stand to sit",
    26: "lunge",
    27: "squat",
}
"""Number of an action of UTD-MHAD -> its name."""


@dataclass(frozen=True)
class RecordingScore:
    """One recording of N frames against the Kinect's skeletons."""

    name: str
    """Folder of the recording, aAA_sS_tT."""
    status: ndarray
    """Status of each frame, shape (N,)."""
    residual_rms_m: Float[ndarray, " n"]
    """Point-to-skin distance of the inliers, root mean square [m], shape (N,)."""
    distances_m: Float[ndarray, "n j"]
    """Distance of each joint from the Kinect's [m], shape (N, J); NaN where one is missing."""
    offset_free_m: Float[ndarray, "n j"]
    """The same without each joint's mean offset in the camera frame [m], shape (N, J)."""
    torso_offset_free_m: Float[ndarray, "n j"]
    """The same without each joint's mean offset in the torso's frame [m], shape (N, J)."""
    in_reference: Bool[ndarray, "n j"]
    """Joints the Kinect reported, shape (N, J)."""
    swapped: dict[str, Bool[ndarray, " n"]]
    """Limb -> frames in which its left and right joint are exchanged."""
    away: Bool[ndarray, " n"]
    """Frames whose root x axis points away from the camera, shape (N,)."""
    reference_away: Bool[ndarray, " n"]
    """Frames in which the Kinect's torso, by shoulders and hips, points away, shape (N,)."""
    volume_m3: Float[ndarray, " n"]
    """Signed volume of the posed skin [m^3], above 0 unless inside out, shape (N,)."""

    timing: Timing
    """Agreement at every shift of the reference against the images."""

    @property
    def action(self) -> int:
        """Number of the action."""
        return int(self.name[1:3])

    @property
    def person(self) -> int:
        """Number of the person."""
        return int(self.name[5:6])

    @property
    def any_swapped(self) -> Bool[ndarray, " n"]:
        """Frames with at least one limb exchanged."""
        return np.any(list(self.swapped.values()), axis=0)

    @property
    def inside_out(self) -> Bool[ndarray, " n"]:
        """Frames with a posed skin of no positive volume."""
        return self.volume_m3 <= 0


def score_recording(result: Path, recording: Path) -> RecordingScore:
    """Score a result folder; where the reference is shorter, later frames have no distances."""
    track = Track.load(result / TRACK_FILE)
    human, T_world_camera = load_person(result)
    names, found = read_reference_joints(recording / "reference_joints.csv")
    n = len(track)
    reference = np.full((n, len(JOINTS), 3), np.nan)
    shared = min(n, len(found))
    for j, joint in enumerate(JOINTS):
        if joint in names:
            reference[:shared, j] = found[:shared, names.index(joint)]
    estimate = track.joint_positions_camera_m[:, [track.joint_names.index(k) for k in JOINTS]]
    Rs_camera_torso = torso_rotations(JOINTS, reference)
    return RecordingScore(
        name=recording.name,
        status=track.status,
        residual_rms_m=track.residual_rms_m,
        distances_m=joint_distances(estimate, reference),
        offset_free_m=offset_free_distances(estimate, reference),
        torso_offset_free_m=offset_free_distances(estimate, reference, Rs_camera_torso),
        in_reference=np.isfinite(reference).all(axis=-1),
        swapped=swapped_limbs(JOINTS, estimate, reference),
        away=facing_away(track.q, T_world_camera),
        reference_away=np.einsum("ni,ni->n", Rs_camera_torso[..., 0], reference[:, 0]) > 0,
        timing=timing(recording, JOINTS, estimate, reference),
        volume_m3=np.array(
            [
                np.nan if skin is None else signed_volume_m3(skin, human.skin.faces)
                for skin in (posed_skin(human, q, T_world_camera) for q in track.q)
            ]
        ),
    )


def facing_away(
    q: Float[ndarray, "n nq"], T_world_camera: Float[ndarray, "4 4"]
) -> Bool[ndarray, " n"]:
    """Frames whose root x axis makes more than 90 degrees with the direction to the camera."""
    known = np.isfinite(q).all(axis=1)
    away = np.zeros(len(q), dtype=bool)
    if known.any():
        forward = Rotation.from_quat(q[known, 3:7]).as_matrix()[:, :, 0]
        away[known] = np.sum(forward * (T_world_camera[:3, 3] - q[known, :3]), axis=1) < 0
    return away


def signed_volume_m3(vertices: Float[ndarray, "v 3"], faces: Int[ndarray, "f 3"]) -> float:
    """Volume inside a closed mesh [m^3], below 0 if its faces point inwards (Gauss' theorem)."""
    a, b, c = (vertices[faces[:, k]] - vertices.mean(axis=0) for k in range(3))
    return float(np.sum(a * np.cross(b, c)) / 6.0)


@dataclass(frozen=True)
class Pooled:
    """Several recordings as one; means are over all their frames or compared joints."""

    recordings: int
    """How many."""
    frames: int
    """Frames of all."""
    tracking: float
    """Share of the frames with status `tracking`, 0 to 1."""
    compared: float
    """Share of the Kinect's joints that have an estimate, 0 to 1."""
    rms_m: float
    """Point-to-skin distance of the inliers, mean over frames [m]."""
    worst_rms_m: float
    """The largest of the recordings' own means [m]."""
    mean_m: float
    """Mean distance to the Kinect's joints [m]."""
    offset_free_m: float
    """The same, each joint's mean offset in the camera frame taken off per recording [m]."""
    torso_offset_free_m: float
    """The same, offsets turning with the torso [m]."""
    accuracy: Float[ndarray, " t"]
    """Share of joints within `THRESHOLDS_M`."""
    swapped: int
    """Frames with a left and a right joint exchanged."""
    away: int
    """Frames facing away."""
    inside_out: int
    """Frames with the skin inside out."""


def pool(scores: Sequence[RecordingScore], kind: str | None = None) -> Pooled:
    """Pool recordings.

    Args:
        scores: At least one.
        kind: One of `JOINT_KINDS`, for distances of that joint alone; None for all.
    """
    columns = [j for j, name in enumerate(JOINTS) if kind is None or name.endswith(kind)]

    def joints(field: str) -> ndarray:
        return np.concatenate([getattr(s, field)[:, columns].ravel() for s in scores])

    def frames(field: str) -> ndarray:
        return np.concatenate([getattr(s, field) for s in scores])

    distances_m, in_reference = joints("distances_m"), joints("in_reference")
    return Pooled(
        recordings=len(scores),
        frames=sum(len(s.status) for s in scores),
        tracking=float(np.mean(frames("status") == "tracking")),
        compared=float(np.isfinite(distances_m[in_reference]).mean()),
        rms_m=nanmean(frames("residual_rms_m")),
        worst_rms_m=max(nanmean(s.residual_rms_m) for s in scores),
        mean_m=nanmean(distances_m),
        offset_free_m=nanmean(joints("offset_free_m")),
        torso_offset_free_m=nanmean(joints("torso_offset_free_m")),
        accuracy=accuracy_curve(distances_m, THRESHOLDS_M),
        swapped=int(frames("any_swapped").sum()),
        away=int(frames("away").sum()),
        inside_out=int(frames("inside_out").sum()),
    )


def nanmean(values: ndarray) -> float:
    """Mean of the finite values; NaN, silently, if there are none."""
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if finite.size else float("nan")
