# SPDX-License-Identifier: Apache-2.0
"""Single real recordings: the worst, those that fail somewhere, and why."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy import ndarray
from report import table
from scoring import ACTIONS, JOINTS, RecordingScore, nanmean

FAR_M = 0.20
"""A joint further than this from the Kinect's is worth a word [m]."""


def worst(scores: Sequence[RecordingScore]) -> str:
    """The ten furthest from their reference."""
    ranked = sorted(scores, key=lambda s: -np.nan_to_num(nanmean(s.distances_m), nan=np.inf))
    header = ("recording", "distance cm", "offset-free cm", "RMS mm", "what goes wrong")
    rows = [
        [
            f"{s.name} {ACTIONS.get(s.action, '')}",
            f"{100 * nanmean(s.distances_m):.1f}",
            f"{100 * nanmean(s.offset_free_m):.1f}",
            f"{1e3 * nanmean(s.residual_rms_m):.1f}",
            what_goes_wrong(s),
        ]
        for s in ranked[:10]
    ]
    return table(header, rows)


def failures(scores: Sequence[RecordingScore]) -> str:
    """Those with a frame not tracking, swapped, facing away or inside out."""
    rows = []
    for s in scores:
        lost = int(np.sum(s.status != "tracking"))
        counts = (lost, s.any_swapped.sum(), s.away.sum(), s.inside_out.sum())
        if any(counts):
            limbs = [f"{limb} {int(n.sum())}" for limb, n in s.swapped.items() if n.any()]
            rows.append([s.name, str(len(s.status)), *map(str, counts), ", ".join(limbs) or "-"])
    header = (
        "recording",
        "frames",
        "not tracking",
        "swapped",
        "away",
        "inside out",
        "swapped limbs",
    )
    return table(header, rows) if rows else "None."


def what_goes_wrong(s: RecordingScore) -> str:
    """The numbers that say why a recording is far from its reference."""
    means = np.array([nanmean(column) for column in s.distances_m.T])
    free = np.array([nanmean(column) for column in s.offset_free_m.T])
    order = np.argsort(-np.nan_to_num(means))[:2]
    notes = [
        "worst joints "
        + ", ".join(
            f"{JOINTS[j]} {100 * means[j]:.0f} cm (offset-free {100 * free[j]:.0f})" for j in order
        )
    ]
    far: ndarray = np.any(s.distances_m > FAR_M, axis=1)
    if far.any():
        frames = np.flatnonzero(far)
        notes.append(
            f"a joint beyond {100 * FAR_M:.0f} cm in {len(frames)} of {len(far)} frames "
            f"({frames[0]} to {frames[-1]})"
        )
    for count, says in (
        (np.sum(s.status != "tracking"), "not tracking"),
        (s.any_swapped.sum(), "swapped"),
        (s.away.sum(), "facing away"),
        (s.inside_out.sum(), "inside out"),
    ):
        if count:
            notes.append(f"{count} frames {says}")
    return "; ".join(notes)
