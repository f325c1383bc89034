# SPDX-License-Identifier: Apache-2.0
"""IPOPT beside Gauss-Newton: time, agreement, and joint limits; docs/results.md, JSON, a picture.

Needs a quiet machine. Both track the same recordings; then every problem that Gauss-Newton met on
its way (a round's pairs, weights and priors frozen) is solved to the end by both.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import baseline
import numpy as np
import report
from baseline import Metric, target_table
from command import OUT, parser, refuse_quick_baseline, run, settle
from jaxtyping import Float
from numpy import ndarray
from rich.progress import track
from solver_figure import write_figure
from solver_problems import STEPS, Agreement, compare, first_and_last, limit_trace, recorded, shown
from stages import StageClock, median_p95

import kintrack
from kintrack.config import SolverConfig, TrackerConfig
from kintrack.files import make_result_folder, write_json
from kintrack.sequence import SequenceReader, open_sequence
from kintrack.tracker import Tracker

GROUP = "solvers"
DEMO = Path(kintrack.__file__).parent / "demo"
REAL = {"arm curl": "a16_s1_t1", "jog": "a22_s1_t1", "sit to stand": "a24_s1_t1"}
"""Recordings of UTD-MHAD."""
METHODS = ("gauss-newton", "ipopt")
FRAME_MS, COST_SHARE, JOINT_MM = 250.0, 0.01, 2.0
"""Targets: a frame with IPOPT, and how far the solvers may be apart where no limit is active."""


@dataclass(frozen=True)
class Run:
    """One recording tracked with one solver, F frames after the start."""

    recording: str
    """Which recording."""
    method: str
    """Which solver."""
    frames_ms: Float[ndarray, " f"]
    """Whole frames [ms]."""
    solve_ms: Float[ndarray, " f"]
    """All rounds' solves of a frame [ms]."""
    tracking: int
    """Frames with status tracking."""


def main() -> int:
    """Measure, write."""
    arguments = _arguments()
    refuse_quick_baseline(arguments)
    recordings = _recordings(arguments.data, arguments.quick)
    runs, agreements = [], []
    limit = arguments.frames or (8 if arguments.quick else 60)
    for name, sequence in track(recordings.items(), disable=not sys.stdout.isatty()):
        for method in METHODS:
            runs.append(track_recording(name, sequence, method, limit))
        with recorded() as problems:
            track_recording(name, sequence, METHODS[0], limit)
        agreements += [compare(name, problem) for problem in first_and_last(problems)]
    metrics = _metrics(runs, agreements)
    print(_time_table(runs))
    print(_agreement_table(agreements))
    print(target_table(metrics))
    folder = make_result_folder(OUT)
    picture = folder / "solvers.png"
    write_figure(STEPS, agreements, limit_trace(agreements), picture)
    if not arguments.quick:
        _write(runs, agreements, metrics, picture)
    return settle(arguments, GROUP, metrics)


def _arguments() -> argparse.Namespace:
    made = parser(__doc__)
    made.add_argument("--frames", type=int, help="frames of each recording; 60 if not given")
    return made.parse_args()


def _recordings(data: Path, quick: bool) -> dict[str, SequenceReader]:
    found = {"demo (synthetic)": open_sequence(DEMO)}
    for says, name in REAL.items():
        if not quick and (data / "utd_mhad" / name).is_dir():
            found[f"{says} (real)"] = open_sequence(data / "utd_mhad" / name)
    return found


def track_recording(name: str, sequence: SequenceReader, method: str, limit: int) -> Run:
    """Track the first frames of a recording.

    Args:
        name: For the tables.
        sequence: The recording.
        method: Name of the solver.
        limit: Frames at most.

    Returns:
        Times of the frames after the start.
    """
    clock = StageClock()
    config = TrackerConfig(solver=SolverConfig(method=method))  # type: ignore[arg-type]
    tracker = Tracker(config, clock=clock)
    frames_ms, solve_ms, tracking = [], [], 0
    for frame in islice(sequence, limit):
        starting = tracker.belief is None
        clock.begin()
        result = tracker.step(frame)
        if starting:
            continue
        frames_ms.append(result.milliseconds)
        solve_ms.append(clock.spent_ms.get("solve", 0.0))
        tracking += result.status == "tracking"
    return Run(name, method, np.array(frames_ms), np.array(solve_ms), tracking)


def _metrics(runs: Sequence[Run], agreements: Sequence[Agreement]) -> list[Metric]:
    metrics = []
    for r in runs:
        if r.method == "ipopt":
            ms = median_p95(r.frames_ms)[0]
            key = f"ipopt_{r.recording.split(' (')[0].replace(' ', '_')}"
            says = f"IPOPT, {r.recording}: whole frame, median"
            metrics.append(Metric(key, says, ms, "ms", "lower", 0.25 * ms, FRAME_MS))
    free = [a for a in agreements if a.active == 0]
    cost = max((100 * abs(a.excess[-1]) for a in free), default=float("nan"))
    joints = max((a.joints_mm for a in free), default=float("nan"))
    says = "no limit active: largest difference of"
    return [
        *metrics,
        Metric("cost", f"{says} cost", cost, "%", "lower", 0.1, 100 * COST_SHARE),
        Metric("joints", f"{says} a joint", joints, "mm", "lower", 0.5, JOINT_MM),
    ]


def _time_table(runs: Sequence[Run]) -> str:
    rows = []
    for r in runs:
        cells = [f"{a:.1f} / {b:.1f}" for a, b in map(median_p95, (r.frames_ms, r.solve_ms))]
        rows.append([r.recording, r.method, *cells, f"{r.tracking} of {len(r.frames_ms)}"])
    header = ["recording", "solver", "whole frame, median / p95 [ms]", "solves [ms]", "tracking"]
    return report.table(header, rows)


def _agreement_table(agreements: Sequence[Agreement]) -> str:
    groups = {"none": [a for a in agreements if a.active == 0]}
    groups["one or more"] = [a for a in agreements if a.active > 0]
    rows = []
    for says, members in groups.items():
        if not members:
            continue
        excess = 100 * np.array([a.excess for a in members])
        joints = [a.joints_mm for a in members]
        rows.append(
            [
                says,
                str(len(members)),
                f"{np.median([a.pairs for a in members]):.0f}",
                f"{np.median([a.iterations for a in members]):.0f}",
                f"{np.median(excess[:, 0]):.2f} / {np.percentile(excess[:, 0], 95):.2f}",
                f"{np.median(excess[:, -1]):.4f} / {np.abs(excess[:, -1]).max():.3f}",
                f"{np.median(joints):.2f} / {max(joints):.2f}",
                f"{1e3 * max(a.inside_rad for a in members):.3f}",
                f"{max(a.beyond_deg for a in members):.1f}",
                f"{np.median([a.freed_mm for a in members]):.1f} / "
                f"{max(a.freed_mm for a in members):.1f}",
            ]
        )
    header = [
        "limits active", "problems", "pairs", "IPOPT iterations",
        "excess cost of 1 step, median / p95 [%]", "of 40 steps, median / largest [%]",
        "joints apart at the end, median / largest [mm]", "IPOPT inside the limit at most [mrad]",
        "without limits: beyond at most [deg]", "joints move, median / largest [mm]",
    ]  # fmt: skip
    return report.table(header, rows)


def _write(
    runs: Sequence[Run], agreements: Sequence[Agreement], metrics: Sequence[Metric], picture: Path
) -> None:
    facts = report.conditions(
        data=", ".join(dict.fromkeys(r.recording for r in runs)),
        seeds="none, nothing is drawn at random",
    )
    content: dict[str, Any] = {
        "metrics": baseline.as_dict(metrics),
        "conditions": facts,
        "problems": [shown(a) for a in agreements],
    }
    write_json(picture.with_suffix(".json"), content)
    (report.RESULTS.parent / "solvers.png").write_bytes(picture.read_bytes())
    report.rewrite_section(report.RESULTS, GROUP, _section(runs, agreements, metrics, facts))


def _section(runs, agreements, metrics, facts: dict[str, str]) -> str:
    return "\n\n".join(
        [
            "## IPOPT beside Gauss-Newton",
            "The same objective, associations and priors. Gauss-Newton takes one step a round, "
            "IPOPT solves every round to its end.",
            target_table(metrics),
            _time_table(runs),
            "Every problem (one round, all frozen but the pose) solved to the end by both. Both "
            "keep every limit: Gauss-Newton by an active set, exactly; IPOPT from inside.",
            _agreement_table(agreements),
            "![Cost over steps, and a hinge at its limit.](solvers.png)",
            "### Conditions",
            report.bullets(facts),
        ]
    )


if __name__ == "__main__":
    run(main)
