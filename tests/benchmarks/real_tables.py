# SPDX-License-Identifier: Apache-2.0
"""The section on real recordings: targets, tables by action, person and joint, the worst ten."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from baseline import Metric, target_table
from numpy import ndarray
from report import table
from scenes import SceneScore
from scoring import JOINT_KINDS, JOINTS, Pooled, RecordingScore, nanmean, pool
from timing import LEADS

from kintrack.metrics import THRESHOLDS_M

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
"""Action number -> name."""

FAR_M = 0.20
"""A joint further than this from the Kinect's is worth a word [m]."""

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


def metrics(scores: Sequence[RecordingScore]) -> list[Metric]:
    """The overall numbers with their targets."""
    p = pool(scores)
    return [
        Metric(
            "tracking", "frames with status `tracking`", 100 * p.tracking, "%", "higher", 0.3, 98
        ),
        Metric(
            "rms",
            "point-to-skin RMS of inliers, mean over frames",
            1e3 * p.rms_m,
            "mm",
            "lower",
            0.3,
            15,
        ),
        Metric(
            "worst_rms", "the same, worst recording", 1e3 * p.worst_rms_m, "mm", "lower", 1.0, 15
        ),
        Metric(
            "distance",
            "mean distance to the Kinect's joints",
            100 * p.mean_m,
            "cm",
            "lower",
            0.2,
            7,
        ),
        Metric(
            "offset_free",
            "the same, constant offsets per joint and recording taken off",
            100 * p.offset_free_m,
            "cm",
            "lower",
            0.2,
            4.5,
        ),
        Metric(
            "torso_offset_free",
            "the same, offsets that turn with the torso",
            100 * p.torso_offset_free_m,
            "cm",
            "lower",
            0.2,
        ),
        Metric(
            "within_10_cm",
            "joints within 10 cm of the Kinect's",
            100 * float(np.interp(0.10, THRESHOLDS_M, p.accuracy)),
            "%",
            "higher",
            1.0,
        ),
        Metric(
            "compared", "Kinect joints that have an estimate", 100 * p.compared, "%", "higher", 0.3
        ),
        Metric("swapped", "frames with left and right swapped", p.swapped, "", "lower", 0, 0),
        Metric("away", "frames facing away from the camera", p.away, "", "lower", 0, 0),
        Metric("inside_out", "frames with the skin inside out", p.inside_out, "", "lower", 0, 0),
    ]


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
        _worst(scores),
        "### Recordings with a frame not tracking, swapped, facing away or inside out",
        _failures(scores),
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


def _worst(scores: Sequence[RecordingScore]) -> str:
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


def _failures(scores: Sequence[RecordingScore]) -> str:
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
