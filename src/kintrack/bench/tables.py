# SPDX-License-Identifier: Apache-2.0
"""The tables of the accuracy bench, from the content of `accuracy.json`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from kintrack.bench.cases import ALONE, CONDITIONS, GAPS, REAL, ROOM
from kintrack.bench.figure import in_words
from kintrack.bench.methods import COLD
from kintrack.bench.segmentation.tables import Grid

LOCK_FRAMES, RECOVER_FRAMES = 10, 15
"""Within so many frames a person is to be found, and found again."""
SAYS = {
    ROOM: "Synthetic people in rooms, exact truth",
    ALONE: "Synthetic people with nothing around them, exact truth",
    REAL: "UTD-MHAD people in a real room, against the clean fit",
    "kinect": "The same against the Kinect's joints: agreement, not error",
}


def all_grids(content: dict[str, Any]) -> list[Grid]:
    """Every table that has rows."""
    grids = [errors_grid(content, group) for group in SAYS]
    grids += [doubts_grid(content), starts_grid(content), gaps_grid(content), scenes_grid(content)]
    return [grid for grid in grids if grid.rows]


def errors_grid(content: dict[str, Any], group: str) -> Grid:
    """Joint errors of a group of recordings."""
    header = ("method", "condition", "recordings", "person hidden", "joints with a pose",
              "all [cm]", "visible [cm]", "hidden [cm]", "limbs [cm]", "within 5 cm",
              "within 10 cm", "visible within 10 cm", "frames tracking")  # fmt: skip
    rows = [
        (
            in_words(method),
            condition,
            str(found["recordings"]),
            percent(found["hidden_share"]),
            percent(found["all"]["posed"]),
            *(centimetres(found[p]["mean_m"]) for p in ("all", "visible", "hidden", "limbs")),
            percent(within(found, 0.05)),
            percent(within(found, 0.10)),
            percent(within(found, 0.10, "visible")),
            percent(found["status"]["tracking"]),
        )
        for method, condition, found in rows_of(content, group)
        if condition not in GAPS
    ]
    return Grid(SAYS[group], header, rows)


def doubts_grid(content: dict[str, Any]) -> Grid:
    """How honest the covariances are, and how often left and right are exchanged."""
    header = ("method", "recordings", "condition", "95 % ellipsoid holds visible joints",
              "hidden joints", "initialising", "tracking", "lost",
              "frames with left and right swapped", "of frames")  # fmt: skip
    rows = []
    for group in (ROOM, ALONE, REAL):
        for method, condition, found in rows_of(content, group):
            status = found["status"]
            rows.append(
                (
                    in_words(method),
                    group,
                    condition,
                    *(percent(found[part]["within_95"]) for part in ("visible", "hidden")),
                    *(percent(status[name]) for name in ("initialising", "tracking", "lost")),
                    str(found["swapped_frames"]),
                    str(found["frames"]),
                )
            )
    return Grid("Confidence, statuses and swaps", header, rows)


def starts_grid(content: dict[str, Any]) -> Grid:
    """Frames to the first right pose from a cold start."""
    header = ("method", "condition", "starts", f"found within {LOCK_FRAMES} frames", "found",
              "median frames")  # fmt: skip
    rows = [
        (in_words(method), condition, *_frames_to(found["locked_after"], LOCK_FRAMES))
        for method, condition, found in rows_of(content, ROOM)
        if method.endswith(COLD)
    ]
    return Grid("Cold starts in rooms", header, rows)


def gaps_grid(content: dict[str, Any]) -> Grid:
    """Frames to the first right pose after two seconds without the person."""
    header = ("method", "for two seconds", "gaps", f"found again within {RECOVER_FRAMES} frames",
              "found again", "median frames", "had the person before",
              "meanwhile said to track")  # fmt: skip
    rows = [
        (
            in_words(method),
            condition.removesuffix(" 2 s"),
            *_frames_to(found["recovered_after"], RECOVER_FRAMES),
            str(sum(found["held_before"])),
            percent(found["status_in_gap"]["tracking"]),
        )
        for method, condition, found in rows_of(content, ROOM)
        if condition in GAPS
    ]
    return Grid("Recovery", header, rows)


def scenes_grid(content: dict[str, Any]) -> Grid:
    """Full scenes from a cold start against the witness."""
    header = ("recording", "method", "frames", "PCK@0.2", "over frames with a pose",
              "joints compared", "initialising", "tracking", "lost", "first tracked frame",
              "frames swapped", "largest step of the pelvis [cm]")  # fmt: skip
    names = dict.fromkeys(name for found in content["scenes"].values() for name in found)
    rows = []
    for name in names:
        for method, scenes in content["scenes"].items():
            found = scenes[name]
            first = found["locked_after"]
            rows.append(
                (
                    name,
                    in_words(method),
                    str(found["frames"]),
                    percent(found["pck"]),
                    percent(found["pck_posed"]),
                    str(found["joints"]),
                    *(percent(found["status"][s]) for s in ("initialising", "tracking", "lost")),
                    "-" if first is None else str(first),
                    str(found["swapped_frames"]),
                    centimetres(found["largest_step_m"]),
                )
            )
    return Grid("Full scenes from a cold start, against MediaPipe in the image", header, rows)


def rows_of(content: dict[str, Any], group: str) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Method, condition and scores of a group, in the order of the tables."""
    for condition in CONDITIONS:
        for method, groups in content["scores"].items():
            found = groups.get(group, {}).get(condition)
            if found is not None:
                yield method, condition, found


def within(found: dict[str, Any], threshold_m: float, part: str = "all") -> float | None:
    """Share of joints within a threshold; None without joints."""
    if found[part]["accuracy"] is None:
        return None
    distances = [abs(t - threshold_m) for t in found["thresholds_m"]]
    return float(found[part]["accuracy"][distances.index(min(distances))])


def percent(share: float | None) -> str:
    """A share in percent, to be printed."""
    return "-" if share is None else f"{100 * share:.1f}%"


def centimetres(length_m: float | None) -> str:
    """A length in centimetres, to be printed."""
    return "-" if length_m is None else f"{100 * length_m:.1f}"


def _frames_to(frames: Sequence[int | None], most: int) -> tuple[str, str, str, str]:
    """How many there are, share within some frames, share at all, median of those found."""
    found = [n for n in frames if n is not None]
    return (
        str(len(frames)),
        percent(sum(n <= most for n in found) / len(frames)),
        percent(len(found) / len(frames)),
        f"{np.median(found):.0f}" if found else "-",
    )
