# SPDX-License-Identifier: Apache-2.0
"""The section on real recordings: targets, tables by action, person and joint, full scenes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from baseline import target_table
from real_cases import failures, worst
from real_metrics import metrics
from report import table
from scenes import SceneScore
from scoring import ACTIONS, JOINT_KINDS, Pooled, RecordingScore, pool
from timing import LEADS

from kintrack.metrics import THRESHOLDS_M

_GROUP = (
    "",
    "recordings",
    "frames",
    "tracking %",
    "RMS mm",
    "worst RMS mm",
    "distance cm",
    "offset-free cm",
    "torso offset-free cm",
    "within 10 cm %",
    "swapped",
    "away",
    "inside out",
)


def section(scores: Sequence[RecordingScore], scenes: Sequence[SceneScore], conditions: str) -> str:
    """Markdown of the whole section."""
    reference_away = sum(int(s.reference_away.sum()) for s in scores)
    contradicted = sum(int((s.away & ~s.reference_away).sum()) for s in scores)
    parts = [
        "## Real people: UTD-MHAD",
        "Default configuration, pixels labelled by the network that ships, one body sized at each "
        "start. The reference is "
        "the Kinect SDK's skeleton, itself 2 to 10 cm off: distances are agreement, not error. "
        "Every frame with a pose is compared, whatever its status. Joints: "
        + ", ".join(JOINT_KINDS)
        + ", left and right.",
        target_table(metrics(scores)),
        "![accuracy over threshold, and agreement by action](real_recordings.png)",
        f"Facing, cross-checked by the order of the Kinect's shoulders and hips: its torso faces "
        f"away in {reference_away} frames; in {contradicted} of the frames that face away here, "
        f"it does not.",
        "### By action",
        _groups([(f"{n} {name}", _where(scores, action=n)) for n, name in ACTIONS.items()], scores),
        "### By person",
        _groups([(f"person {n}", _where(scores, person=n)) for n in range(1, 6)], scores),
        "### By joint",
        _by_joint(scores),
        "### Timing of the reference",
        _timing(scores),
        "### The ten worst recordings, by mean distance",
        worst(scores),
        "### Recordings with a frame not tracking, swapped, facing away or inside out",
        failures(scores),
    ]
    if scenes:
        parts += ["## Full scenes, from a cold start", _SCENES_SAY, _scenes(scenes)]
    return "\n\n".join([*parts, "### Conditions", conditions])


_SCENES_SAY = (
    "A status says what the tracker thinks of itself. PCK@0.2: share of MediaPipe's joints with "
    "visibility above 0.8 that have ours within 0.2 of the torso's length (mid-shoulder to "
    "mid-hip) in the image; where there is no pose, the joint is missed."
)


def _timing(scores: Sequence[RecordingScore]) -> str:
    """Agreement at every shift of the reference, and how far the reference runs ahead."""
    frames = np.array([len(s.status) for s in scores], dtype=float)
    fast = np.array([s.timing.fast for s in scores], dtype=float)
    to_points = fast @ np.stack([s.timing.to_points_m for s in scores]) / max(fast.sum(), 1)
    distance = frames @ np.stack([s.timing.distance_m for s in scores]) / frames.sum()
    offset_free = frames @ np.stack([s.timing.offset_free_m for s in scores]) / frames.sum()
    says = (
        "Without the tracker: for every shift, the mean distance of the reference's fast elbows "
        "and wrists (over 4 cm a frame) from the nearest observed point. It is least where the "
        f"reference runs {LEADS[int(np.argmin(to_points))]} frames ahead of the images; the "
        "figures above are taken at 0, as the recordings are given."
    )
    rows = [
        [
            f"{lead}",
            *(f"{100 * x[i]:.1f}" for x in (to_points, distance, offset_free)),
            f"{sum(int(s.timing.swapped[i]) for s in scores)}",
        ]
        for i, lead in enumerate(LEADS)
    ]
    header = ["reference ahead by frames", "its distance to points cm", "distance cm"]
    return says + "\n\n" + table([*header, "offset-free cm", "swapped frames"], rows)


def _where(
    scores: Sequence[RecordingScore], action: int | None = None, person: int | None = None
) -> list[RecordingScore]:
    return [s for s in scores if action in (None, s.action) and person in (None, s.person)]


def _groups(
    groups: Sequence[tuple[str, list[RecordingScore]]], scores: Sequence[RecordingScore]
) -> str:
    rows = [[name, *_cells(pool(members))] for name, members in groups if members]
    overall = ["**all**", *(f"**{cell}**" for cell in _cells(pool(scores)))]
    return table(_GROUP, [*rows, overall])


def _cells(p: Pooled) -> list[str]:
    return [
        str(p.recordings),
        str(p.frames),
        f"{100 * p.tracking:.1f}",
        f"{1e3 * p.rms_m:.1f}",
        f"{1e3 * p.worst_rms_m:.1f}",
        f"{100 * p.mean_m:.1f}",
        f"{100 * p.offset_free_m:.1f}",
        f"{100 * p.torso_offset_free_m:.1f}",
        f"{100 * np.interp(0.10, THRESHOLDS_M, p.accuracy):.0f}",
        str(p.swapped),
        str(p.away),
        str(p.inside_out),
    ]


def _by_joint(scores: Sequence[RecordingScore]) -> str:
    rows = []
    for kind in JOINT_KINDS:
        p = pool(scores, kind)
        within = (f"{100 * np.interp(t, THRESHOLDS_M, p.accuracy):.0f}" for t in (0.05, 0.1, 0.2))
        swaps = str(sum(int(s.swapped[kind].sum()) for s in scores)) if kind != "head" else "-"
        means = (p.mean_m, p.offset_free_m, p.torso_offset_free_m)
        rows.append([kind, *(f"{100 * mean:.1f}" for mean in means), *within, swaps])
    header = (
        "",
        "distance cm",
        "offset-free cm",
        "torso offset-free cm",
        "within 5 cm %",
        "within 10 cm %",
        "within 20 cm %",
        "swapped frames",
    )
    return table(header, rows)


def _scenes(scenes: Sequence[SceneScore]) -> str:
    header = (
        "recording",
        "frames read",
        "ran to the end",
        "statuses",
        "PCK@0.2 %",
        "over frames with a pose %",
        "joints compared",
    )
    rows = [
        [
            s.name,
            f"{s.read} of {s.recorded}",
            "yes" if s.error is None and s.read == s.recorded else f"no: {s.error}",
            ", ".join(f"{n} {status}" for status, n in s.statuses.items()),
            f"{100 * s.pck:.0f}",
            "-" if np.isnan(s.pck_posed) else f"{100 * s.pck_posed:.0f}",
            str(s.joints),
        ]
        for s in scenes
    ]
    return table(header, rows)
