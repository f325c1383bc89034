# SPDX-License-Identifier: Apache-2.0
"""`kintrack bench`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.table import Table

from kintrack.bench.accuracy import RESULT_FILE, AccuracyConfig, run_accuracy
from kintrack.bench.figure import write_pictures
from kintrack.bench.filming import FilmingConfig, run_filming
from kintrack.bench.segmentation import figure as segmentation_figure
from kintrack.bench.segmentation import run as segmentation_run
from kintrack.bench.segmentation import tables as segmentation_tables
from kintrack.bench.segmentation.config import SegmentationBenchConfig, named_weights
from kintrack.bench.segmentation.inputs import Inputs
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
class BenchFilming:
    """Frames per second of the data engine at 512 x 424 with noise, colour and writing."""

    config: Annotated[FilmingConfig, tyro.conf.OmitArgPrefixes] = field(
        default_factory=FilmingConfig
    )
    """How many frames and processes."""

    def run(self) -> None:
        """Time it with progress, print the rates."""
        with StepProgress() as progress:
            found = run_filming(self.config, progress)
        for kind, rates in found.items():
            console.print(
                f"{kind}: {rates['frames_per_second']:.1f} frames/s with {self.config.workers} "
                f"processes, {rates['bytes_per_frame'] / 1e3:.0f} kB a frame"
            )


@dataclass(frozen=True)
class BenchSegmentation:
    """Networks on held-out and real recordings, and their runtimes: tables, pictures, a JSON."""

    weights: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME=FILE ...")]
    """Networks to compare, the one that ships first."""
    output: Path = Path("kintrack-bench-segmentation")
    """Folder for recordings, results and scores; a stopped bench goes on there."""
    dataset: Path | None = None
    """Dataset of the recipe `paper`; its test part is made if not given."""
    mocap: Path | None = None
    """Folder of motion capture clips for that; authored motions only if not given."""
    data: Path | None = None
    """Folder with the real recordings (utd_mhad, scenes, uva_turn, bonn_tablet, bonn_three,
    sofa); synthetic people only if not given."""
    config: Annotated[SegmentationBenchConfig, tyro.conf.OmitArgPrefixes] = field(
        default_factory=SegmentationBenchConfig
    )
    """How much is measured."""

    def run(self) -> None:
        """Run with progress, print the tables, draw the pictures."""
        inputs = Inputs(self.dataset, self.mocap, self.data)
        with StepProgress() as progress:
            bench = segmentation_run.run_segmentation(
                self.output, named_weights(self.weights), self.config, inputs, progress
            )
        print_grids(bench.content)
        pictures = segmentation_figure.write_pictures(
            bench.content, bench.networks, bench.judged, self.output
        )
        written = [self.output / segmentation_run.RESULT_FILE, *pictures]
        console.print(f"written: {', '.join(map(str, written))}")


@dataclass(frozen=True)
class Bench:
    """Measure on held-out people, motions and objects."""

    what: Annotated[
        Annotated[BenchAccuracy, tyro.conf.subcommand("accuracy")]
        | Annotated[BenchFilming, tyro.conf.subcommand("filming")]
        | Annotated[BenchSegmentation, tyro.conf.subcommand("segmentation")],
        tyro.conf.OmitSubcommandPrefixes,
        tyro.conf.OmitArgPrefixes,
    ]
    """What to measure."""

    def run(self) -> None:
        """Do it."""
        self.what.run()


def accuracy_table(content: dict[str, Any]) -> Table:
    """Errors by method, group and distance."""
    table = Table(title="Joint error (cm), share of joints within 10 cm", title_justify="left")
    for title in ("method", "set", "object"):
        table.add_column(title, no_wrap=True)
    for title in ("n", "hidden", "posed", "all", "seen", "unseen", "<10 cm"):
        table.add_column(title, justify="right", no_wrap=True)
    for method, group, condition, found in rows_of(content):
        table.add_row(
            method,
            group,
            condition,
            str(found["recordings"]),
            percent(found["hidden_share"]),
            percent(found["all"]["posed"]),
            *(centimetres(found[part]["mean_m"]) for part in ("all", "visible", "hidden")),
            percent(within(found, 0.10)),
        )
    return table


def print_grids(content: dict[str, Any]) -> None:
    """Print every table of the segmentation bench that has rows, and what was left out."""
    for grid in segmentation_tables.all_grids(content):
        console.print(f"\n{grid.title}", style="bold", markup=False)
        console.print(grid.text(), soft_wrap=True, highlight=False, markup=False)
    for key, problem in content["left_out"].items():
        console.print(f"left out {key}: {problem}")


def rows_of(content: dict[str, Any]) -> Iterator[tuple[str, str, str, dict[str, Any]]]:
    """Method, group, condition and scores, in the order of the table."""
    for method, groups in content["scores"].items():
        for group, conditions in groups.items():
            for condition, found in conditions.items():
                yield method, group, condition, found


def within(found: dict[str, Any], threshold_m: float) -> float | None:
    """Share of all joints within a threshold; None without joints."""
    if found["all"]["accuracy"] is None:
        return None
    distances = [abs(t - threshold_m) for t in found["thresholds_m"]]
    return float(found["all"]["accuracy"][distances.index(min(distances))])


def percent(share: float | None) -> str:
    """A share in percent, to be printed."""
    return "-" if share is None else f"{100 * share:.1f}%"


def centimetres(length_m: float | None) -> str:
    """A length in centimetres, to be printed."""
    return "-" if length_m is None else f"{100 * length_m:.1f}"
