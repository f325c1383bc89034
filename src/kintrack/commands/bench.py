# SPDX-License-Identifier: Apache-2.0
"""`kintrack bench`."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.table import Table

from kintrack.bench.accuracy import RESULT_FILE, AccuracyConfig, run_accuracy
from kintrack.bench.figure import write_pictures
from kintrack.commands.console import StepProgress, console


@dataclass(frozen=True)
class BenchAccuracy:
    """Joint errors with objects at 30, 45 and 60 cm before the person: tables, curves, a JSON."""

    output: Path = Path("kintrack-bench")
    """Folder for recordings, results and scores; a stopped bench goes on there."""
    mocap: Path | None = None
    """Folder of motion capture clips; authored motions only if not given."""
    real: Path | None = None
    """Folder of real recordings without background, each a sequence folder."""
    config: Annotated[AccuracyConfig, tyro.conf.OmitArgPrefixes] = field(
        default_factory=AccuracyConfig
    )
    """Methods, seed, lengths."""

    def run(self) -> None:
        """Run with progress, print the table, draw the pictures."""
        with StepProgress() as progress:
            content = run_accuracy(self.output, self.config, self.mocap, self.real, progress)
        console.print(accuracy_table(content))
        for key, problem in content["not_made"].items():
            console.print(f"left out {key}: {problem}")
        pictures = write_pictures(content, self.output)
        console.print(f"written: {', '.join(map(str, [self.output / RESULT_FILE, *pictures]))}")


@dataclass(frozen=True)
class Bench:
    """Measure on held-out people, motions and objects."""

    what: Annotated[
        Annotated[BenchAccuracy, tyro.conf.subcommand("accuracy")],
        tyro.conf.OmitSubcommandPrefixes,
        tyro.conf.OmitArgPrefixes,
    ]
    """What to measure."""

    def run(self) -> None:
        """Do it."""
        self.what.run()


def accuracy_table(content: dict[str, Any]) -> Table:
    """Errors by method, group and distance."""
    table = Table(title="Joint error (cm); share of joints within 10 cm", title_justify="left")
    for title in ("method", "recordings", "object"):
        table.add_column(title)
    for title in ("hidden", "posed", "all", "visible", "hidden joints", "within 10 cm", "tracking"):
        table.add_column(title, justify="right")
    for method, groups in content["scores"].items():
        for group, conditions in groups.items():
            for condition, found in conditions.items():
                table.add_row(
                    method,
                    f"{found['recordings']} {group}",
                    condition,
                    _percent(found["hidden_share"]),
                    _percent(found["all"]["posed"]),
                    *(_cm(found[part]["mean_m"]) for part in ("all", "visible", "hidden")),
                    _percent(within(found, 0.10)),
                    _percent(found["tracking"]),
                )
    return table


def within(found: dict[str, Any], threshold_m: float) -> float | None:
    """Share of all joints within a threshold; None without joints."""
    if found["all"]["accuracy"] is None:
        return None
    distances = [abs(t - threshold_m) for t in found["thresholds_m"]]
    return float(found["all"]["accuracy"][distances.index(min(distances))])


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.1f} %"


def _cm(length_m: float | None) -> str:
    return "-" if length_m is None else f"{100 * length_m:.1f}"
