# SPDX-License-Identifier: Apache-2.0
"""Where a comparison goes: two files in a folder, and two tables on the terminal."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from kintrack.evaluation.comparison import Evaluation
from kintrack.evaluation.figure import plot_evaluation
from kintrack.files import make_result_folder, write_atomically, write_json


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
