# SPDX-License-Identifier: Apache-2.0
"""Score a result folder against reference joints: numbers, a figure, a table."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy import ndarray
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from kintrack.errors import ResultError
from kintrack.metrics import Scores, joint_distances, score, torso_rotations
from kintrack.result import (
    STATUSES,
    TRACK_FILE,
    Track,
    make_result_folder,
    write_atomically,
    write_json,
)
from kintrack.sequence.reference import read_reference_joints

REFERENCE_FILE = "reference_joints.csv"

_BLUE, _ORANGE, _GREY = "#0072b2", "#d55e00", "#999999"


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


def write_evaluation(evaluation: Evaluation, folder: Path) -> None:
    """Write `evaluation.json` and `evaluation.png` into the folder, made where missing.

    Raises:
        ResultError: if the folder or a file cannot be written.
    """
    folder = make_result_folder(folder)
    write_json(folder / "evaluation.json", evaluation.to_dict())
    figure = plot_evaluation(evaluation)
    write_atomically(
        folder / "evaluation.png", lambda file: figure.savefig(file, format="png", dpi=200)
    )


def print_evaluation(evaluation: Evaluation, console: Console | None = None) -> None:
    """Print the scores as two tables: over all, then joint by joint."""
    console = console or Console()
    n = len(evaluation.timestamps_s)
    console.print(escape(f"{evaluation.result}\nagainst {evaluation.reference}"), highlight=False)
    if evaluation.result_frames != evaluation.reference_frames:
        console.print(
            f"The result has {evaluation.result_frames} frames, the reference "
            f"{evaluation.reference_frames}; the first {n} are compared."
        )
    counts = ", ".join(f"{count} {name}" for name, count in evaluation.status_counts.items())
    console.print(f"{n} frames: {counts}")
    console.print(_overall_table(evaluation))
    console.print(_joint_table(evaluation))


def plot_evaluation(evaluation: Evaluation) -> Figure:
    """The accuracy curve, mean and median of each joint, and the mean over joints over time."""
    figure = Figure(figsize=(7.2, 5.6), layout="constrained")
    axes = figure.subplot_mosaic("AB;CC", width_ratios=(1.0, 1.5), height_ratios=(1.6, 1.0))
    _plot_accuracy(axes["A"], evaluation)
    _plot_joints(axes["B"], evaluation)
    _plot_time(axes["C"], evaluation)
    for axis in axes.values():
        axis.spines[["top", "right"]].set_visible(False)
        axis.tick_params(labelsize=7.5)
        axis.xaxis.label.set_fontsize(8.5)
        axis.yaxis.label.set_fontsize(8.5)
    return figure


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


def _overall_table(evaluation: Evaluation) -> Table:
    table = Table(title=f"{evaluation.measure.capitalize()}, all joints", title_justify="left")
    table.add_column("")
    table.add_column("posed frames", justify="right")
    table.add_column("tracking frames", justify="right")
    both = (evaluation.posed, evaluation.tracking)

    table.add_row("frames compared", *(str(s.frames) for s in both))
    table.add_row("reference joints with an estimate", *(_percent(s.coverage) for s in both))
    table.add_row("mean (cm)", *(_cm(s.mean_m) for s in both))
    table.add_row("median (cm)", *(_cm(s.median_m) for s in both))
    table.add_row(
        "mean, offsets taken off, camera (cm)", *(_cm(s.offset_free_camera_mean_m) for s in both)
    )
    table.add_row(
        "mean, offsets taken off, torso (cm)", *(_cm(s.offset_free_torso_mean_m) for s in both)
    )
    for threshold_m in (0.05, 0.10, 0.15):
        table.add_row(
            f"joints within {100 * threshold_m:.0f} cm",
            *(_percent(np.interp(threshold_m, s.thresholds_m, s.accuracy)) for s in both),
        )
    table.add_row(
        "acceleration, mean difference (m/s²)", *(_number(s.acceleration_error_m_s2) for s in both)
    )
    table.add_row("jitter, estimate (m/s²)", *(_number(s.jitter_m_s2) for s in both))
    table.add_row("jitter, reference (m/s²)", *(_number(s.reference_jitter_m_s2) for s in both))
    table.add_row("frames with left and right swapped", *(str(s.swap_frames) for s in both))
    return table


def _joint_table(evaluation: Evaluation) -> Table:
    table = Table(title=f"{evaluation.measure.capitalize()} by joint (cm)", title_justify="left")
    table.add_column("joint")
    for title in ("mean, posed", "median, posed", "mean, tracking", "median, tracking"):
        table.add_column(title, justify="right")
    posed, tracking = evaluation.posed, evaluation.tracking
    columns = (
        posed.joint_mean_m,
        posed.joint_median_m,
        tracking.joint_mean_m,
        tracking.joint_median_m,
    )
    for name, *cells in zip(posed.joint_names, *columns, strict=True):
        table.add_row(escape(name), *(_cm(cell) for cell in cells))
    return table


def _number(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else "-"


def _cm(value_m: float) -> str:
    return f"{100 * value_m:.1f}" if np.isfinite(value_m) else "-"


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %" if np.isfinite(share) else "-"


def _in_words(joint: str) -> str:
    """l_hip as left hip."""
    return re.sub("^l_", "left ", re.sub("^r_", "right ", joint)).replace("_", " ")


def _plot_accuracy(axis: Axes, evaluation: Evaluation) -> None:
    for label, scores, style in (
        ("tracking frames", evaluation.tracking, {"color": _BLUE, "marker": "o", "ms": 2.5}),
        ("all posed frames", evaluation.posed, {"color": _ORANGE, "linestyle": "--"}),
    ):
        if scores.samples:
            axis.plot(
                100 * scores.thresholds_m, 100 * scores.accuracy, label=label, lw=1.3, **style
            )
    axis.set(xlabel="threshold [cm]", ylabel="joints within threshold [%]", ylim=(0, 102))
    axis.set(xlim=100 * evaluation.posed.thresholds_m[[0, -1]], xticks=(2, 5, 10, 15, 20))
    axis.set_title("accuracy over threshold, all joints", fontsize=8.5)
    axis.grid(alpha=0.3, lw=0.5)
    if evaluation.posed.samples:
        axis.legend(loc="lower right", fontsize=7.5, frameon=False)


def _plot_joints(axis: Axes, evaluation: Evaluation) -> None:
    scores = evaluation.posed
    x = np.arange(len(scores.joint_names))
    axis.bar(x - 0.2, 100 * scores.joint_mean_m, 0.4, color=_BLUE, label="mean")
    axis.bar(x + 0.2, 100 * scores.joint_median_m, 0.4, color=_ORANGE, label="median")
    axis.axhline(100 * scores.mean_m, color="black", lw=0.7, ls=":", label="mean of all")
    axis.set_xticks(x, [_in_words(name) for name in scores.joint_names], rotation=90)
    axis.set_title("each joint, all posed frames", fontsize=8.5)
    axis.set(ylabel=f"{evaluation.measure} [cm]", xlim=(-0.7, len(x) - 0.3))
    axis.legend(loc="upper left", ncols=3, fontsize=7.5, frameon=False)
    axis.margins(y=0.2)


def _plot_time(axis: Axes, evaluation: Evaluation) -> None:
    seconds = evaluation.timestamps_s - evaluation.timestamps_s[0]
    seen = np.isfinite(evaluation.distances_m)
    total_m = np.where(seen, evaluation.distances_m, 0.0).sum(axis=1)
    counts = seen.sum(axis=1)
    mean_m = np.where(counts > 0, total_m / np.maximum(counts, 1), np.nan)
    axis.plot(seconds, 100 * mean_m, color=_BLUE, lw=1.0)
    if not evaluation.is_tracking.all():
        edges = np.concatenate([seconds[:1], (seconds[1:] + seconds[:-1]) / 2, seconds[-1:]])
        axis.stairs(
            ~evaluation.is_tracking,
            edges,
            fill=True,
            transform=axis.get_xaxis_transform(),
            color=_GREY,
            alpha=0.35,
            lw=0,
            label="status not tracking",
        )
        axis.legend(loc="upper right", fontsize=7.5, frameon=False)
    axis.set_title("mean over joints, frame by frame", fontsize=8.5)
    axis.set(xlabel="time [s]", ylabel=f"{evaluation.measure} [cm]")
    axis.set_xlim(seconds[0], max(seconds[-1], 1e-3))
    axis.set_ylim(bottom=0)
    axis.grid(alpha=0.3, lw=0.5)
