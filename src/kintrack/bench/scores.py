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

from kintrack.bench.cases import Case
from kintrack.errors import ResultError
from kintrack.joints import JOINT_NAMES
from kintrack.metrics import THRESHOLDS_M, joint_distances
from kintrack.result import TRACK_FILE, Track
from kintrack.sequence.occlusion import OCCLUSION_FILE, read_occlusion
from kintrack.sequence.reference import read_reference_joints


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
    tracking: Bool[ndarray, " n"]
    """Frames with status `tracking`."""


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
    distances = joint_distances(track.joint_positions_camera_m[:n][:, order], reference[:n])
    known = np.isfinite(reference[:n]).all(axis=-1)
    distances = np.where(known, np.where(np.isfinite(distances), distances, np.inf), np.nan)
    shares, hidden = np.zeros(n), np.zeros((n, len(JOINT_NAMES)), dtype=bool)
    occlusion = case.sequence / OCCLUSION_FILE
    if occlusion.is_file():
        shares, hidden = (values[:n] for values in read_occlusion(occlusion))
    return Errors(case, distances, hidden, shares, track.status[:n] == "tracking")


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
    known = ~np.isnan(distances)
    shares = np.concatenate([e.hidden_share for e in errors])
    return {
        "recordings": len(errors),
        "frames": len(distances),
        "tracking": float(np.mean(np.concatenate([e.tracking for e in errors]))),
        "hidden_share": float(np.nanmean(shares)) if np.isfinite(shares).any() else None,
        "thresholds_m": THRESHOLDS_M.tolist(),
        "all": _part(distances, known),
        "visible": _part(distances, known & ~hidden),
        "hidden": _part(distances, known & hidden),
        "joints": {name: _part(distances[:, j], known[:, j]) for j, name in enumerate(JOINT_NAMES)},
    }


def _part(distances: ndarray, chosen: ndarray) -> dict[str, Any]:
    values = distances[chosen]
    posed = values[np.isfinite(values)]
    return {
        "joints": int(values.size),
        "posed": float(posed.size / values.size) if values.size else None,
        "mean_m": float(posed.mean()) if posed.size else None,
        "median_m": float(np.median(posed)) if posed.size else None,
        "p95_m": float(np.percentile(posed, 95)) if posed.size else None,
        "accuracy": [float(np.mean(values <= t)) for t in THRESHOLDS_M] if values.size else None,
    }
