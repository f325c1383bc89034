# SPDX-License-Identifier: Apache-2.0
"""Errors of a result against the truth, split into visible and hidden joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from kintrack.bench.cases import GAPS, Case
from kintrack.bench.gaps import gap_of
from kintrack.errors import ResultError
from kintrack.joints import JOINT_NAMES
from kintrack.metrics import SWAP_LIMBS, THRESHOLDS_M, joint_distances, swapped_limbs
from kintrack.result import STATUSES, TRACK_FILE, Track
from kintrack.sequence import open_sequence
from kintrack.sequence.occlusion import OCCLUSION_FILE, read_occlusion
from kintrack.sequence.reference import read_reference_joints

BASIN_M = 0.20
"""Within this mean error of the joints in view a tracker has the person [Wan19, 6]."""
LEAST_POSED = 0.5
"""Share of the joints in view that it must say something of."""
CHI2_95 = 7.815
"""95 % of a normal distribution in space lie within this squared Mahalanobis distance."""
LIMBS = np.array([name[2:] in SWAP_LIMBS for name in JOINT_NAMES])
"""Joints that every method finds itself: shoulders to wrists, hips to ankles."""


@dataclass(frozen=True)
class Errors:
    """One recording of N frames against its truth."""

    case: Case
    """Which recording."""
    distances_m: Float[ndarray, "n j"]
    """Error of each of `JOINT_NAMES` [m]; inf where the method says nothing, NaN without truth."""
    hidden: Bool[ndarray, "n j"]
    """Joints behind something."""
    hidden_share: Float[ndarray, " n"]
    """Share of the person that is hidden."""
    status: ndarray
    """Status of each frame (N,)."""
    surprise: Float[ndarray, "n j"]
    """Squared Mahalanobis distance of the true joint from the estimate; NaN without either."""
    swapped: Bool[ndarray, " n"]
    """Frames in which the left and right of a limb are exchanged."""
    gap: range | None = None
    """Frames in which nobody is seen, if that is what the recording is about."""

    @property
    def found(self) -> Bool[ndarray, " n"]:
        """Frames in which it tracks, and most joints in view are right on average."""
        seen = np.where(self.hidden, np.nan, self.distances_m)
        asked, posed = (~np.isnan(seen)).sum(axis=1), np.isfinite(seen).sum(axis=1)
        mean = np.where(np.isfinite(seen), seen, 0.0).sum(axis=1) / np.maximum(posed, 1)
        enough = (posed > 0) & (posed >= LEAST_POSED * asked)
        return (self.status == "tracking") & enough & (mean <= BASIN_M)

    @property
    def locked_after(self) -> int | None:
        """Frames it took to find the person, the first that does counted; None if it never did."""
        return _first(self.found)

    @property
    def recovered_after(self) -> int | None:
        """The same from the first frame after the gap on."""
        return None if self.gap is None else _first(self.found[self.gap.stop :])


def errors_of(case: Case, result: Path, truth: Path) -> Errors:
    """Score a result.

    Args:
        case: What was tracked.
        result: Result folder.
        truth: `reference_joints.csv`, or a track whose tracked frames count as true.

    Raises:
        ResultError: if a file is missing or broken, or there are no common frames.
    """
    track = Track.load(result / TRACK_FILE)
    reference = _truth(truth)
    n = min(len(track), len(reference))
    if n == 0:
        raise ResultError(f"{result} and {truth} have no common frame")
    order = [track.joint_names.index(name) for name in JOINT_NAMES]
    joints, reference = track.joint_positions_camera_m[:n][:, order], reference[:n]
    distances = joint_distances(joints, reference)
    known = np.isfinite(reference).all(axis=-1)
    distances = np.where(known, np.where(np.isfinite(distances), distances, np.inf), np.nan)
    shares, hidden = np.zeros(n), np.zeros((n, len(JOINT_NAMES)), dtype=bool)
    occlusion = case.sequence / OCCLUSION_FILE
    if occlusion.is_file():
        shares, hidden = (values[:n] for values in read_occlusion(occlusion))
    swapped = np.zeros(n, dtype=bool)
    for flags in swapped_limbs(JOINT_NAMES, joints, reference).values():
        swapped |= flags
    return Errors(
        case,
        distances,
        hidden,
        shares,
        track.status[:n],
        surprises(joints, track.joint_covariances_m2[:n][:, order], reference),
        swapped,
        gap_of(open_sequence(case.sequence)) if case.condition in GAPS else None,
    )


def surprises(
    joints: Float[ndarray, "n j 3"],
    covariances_m2: Float[ndarray, "n j 3 3"],
    truth: Float[ndarray, "n j 3"],
) -> Float[ndarray, "n j"]:
    """Squared Mahalanobis distances d' C^-1 d of true joints (N, J), NaN where one is missing."""
    away = truth - joints
    usable = np.isfinite(away).all(axis=-1) & np.isfinite(covariances_m2).all(axis=(-2, -1))
    out = np.full(usable.shape, np.nan)
    # a microscopic ridge, for a covariance that is exactly flat along some direction
    ridge = 1e-12 * np.eye(3)
    solved = np.linalg.solve(covariances_m2[usable] + ridge, away[usable][..., None])[..., 0]
    out[usable] = np.sum(solved * away[usable], axis=-1)
    return out


def _first(flags: Bool[ndarray, " n"]) -> int | None:
    return int(np.argmax(flags)) + 1 if flags.any() else None


def _truth(path: Path) -> Float[ndarray, "n j 3"]:
    """True joints in the order of `JOINT_NAMES`, NaN where unknown."""
    if path.name == TRACK_FILE:
        track = Track.load(path)
        order = [track.joint_names.index(name) for name in JOINT_NAMES]
        joints = track.joint_positions_camera_m[:, order].copy()
        joints[track.status != "tracking"] = np.nan
        return joints
    names, found = read_reference_joints(path)
    joints = np.full((len(found), len(JOINT_NAMES), 3), np.nan)
    for j, name in enumerate(JOINT_NAMES):
        if name in names:
            joints[:, j] = found[:, names.index(name)]
    return joints


def summary(errors: Sequence[Errors]) -> dict[str, Any]:
    """What the bench reports of some recordings pooled; lengths in metres.

    Frames without a pose count as beyond every threshold; means are over joints with a pose, and
    `posed` says how many those are.
    """
    distances = np.concatenate([e.distances_m for e in errors])
    hidden = np.concatenate([e.hidden for e in errors])
    surprise = np.concatenate([e.surprise for e in errors])
    status = np.concatenate([e.status for e in errors])
    shares = np.concatenate([e.hidden_share for e in errors])
    known = ~np.isnan(distances)
    return {
        "recordings": len(errors),
        "frames": len(distances),
        "status": {name: float(np.mean(status == name)) for name in STATUSES},
        "hidden_share": float(np.nanmean(shares)) if np.isfinite(shares).any() else None,
        "thresholds_m": THRESHOLDS_M.tolist(),
        "all": _part(distances, known, surprise),
        "visible": _part(distances, known & ~hidden, surprise),
        "hidden": _part(distances, known & hidden, surprise),
        "limbs": _part(distances, known & LIMBS, surprise),
        "joints": {
            name: _part(distances[:, j], known[:, j], surprise[:, j])
            for j, name in enumerate(JOINT_NAMES)
        },
        "swapped_frames": int(sum(e.swapped.sum() for e in errors)),
        "locked_after": [e.locked_after for e in errors],
        **_gaps([e for e in errors if e.gap is not None]),
    }


def _gaps(errors: Sequence[Errors]) -> dict[str, Any]:
    """Of recordings with a gap: what it says meanwhile, and when it has the person again."""
    if not errors:
        return {}
    meanwhile = np.concatenate([e.status[e.gap.start : e.gap.stop] for e in errors if e.gap])
    return {
        "held_before": [bool(e.found[e.gap.start - 1]) for e in errors if e.gap],
        "recovered_after": [e.recovered_after for e in errors],
        "status_in_gap": {name: float(np.mean(meanwhile == name)) for name in STATUSES},
    }


def _part(distances: ndarray, chosen: ndarray, surprise: ndarray) -> dict[str, Any]:
    values = distances[chosen]
    posed = values[np.isfinite(values)]
    doubted = surprise[chosen]
    doubted = doubted[np.isfinite(doubted)]
    return {
        "joints": int(values.size),
        "posed": float(posed.size / values.size) if values.size else None,
        "mean_m": float(posed.mean()) if posed.size else None,
        "median_m": float(np.median(posed)) if posed.size else None,
        "p95_m": float(np.percentile(posed, 95)) if posed.size else None,
        "accuracy": [float(np.mean(values <= t)) for t in THRESHOLDS_M] if values.size else None,
        "within_95": float(np.mean(doubted <= CHI2_95)) if doubted.size else None,
    }
