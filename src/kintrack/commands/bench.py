# SPDX-License-Identifier: Apache-2.0
"""`kintrack bench`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro

from kintrack.bench import tables as accuracy_tables
from kintrack.bench.accuracy import RESULT_FILE, run_accuracy
from kintrack.bench.figure import write_pictures
from kintrack.bench.filming import FilmingConfig, run_filming
from kintrack.bench.panels import write_methods
from kintrack.bench.recordings import AccuracyConfig, Sources
from kintrack.bench.segmentation import figure as segmentation_figure
from kintrack.bench.segmentation import run as segmentation_run
from kintrack.bench.segmentation import tables as segmentation_tables
from kintrack.bench.segmentation.config import SegmentationBenchConfig, named_weights
from kintrack.bench.segmentation.inputs import Inputs
from kintrack.bench.targets import targets_grid
from kintrack.commands.console import StepProgress, console
from segmentation.weights import SHIPPED


@dataclass(frozen=True)
class BenchAccuracy:
    """Joint errors of every method behind objects and after losses: tables, pictures, a JSON."""

    weights: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME=FILE ...")] = ()
    """Networks to compare, this project's own first; the one that ships if none is given."""
    output: Path = Path("kintrack-bench")
    """Folder for recordings, results and scores; a stopped bench goes on there."""
    mocap: Path | None = None
    """Folder of motion capture clips; authored motions only if not given."""
    data: Path | None = None
    """Folder with the real recordings (utd_mhad, scenes, bonn_tablet, bonn_three, sofa, uva_turn);
    synthetic people only if not given."""
    config: Annotated[AccuracyConfig, tyro.conf.OmitArgPrefixes] = field(
        default_factory=AccuracyConfig
    )
    """Methods, groups, seed, lengths."""

    def run(self) -> None:
        """Run with progress, print the tables, draw the pictures."""
        weights = named_weights(self.weights) if self.weights else {SHIPPED.stem: SHIPPED}
        sources = Sources(self.mocap, self.data)
        with StepProgress() as progress:
            bench = run_accuracy(self.output, weights, self.config, sources, progress)
        print_accuracy(bench.content)
        pictures = [*write_pictures(bench.content, self.output), write_methods(bench)]
        written = [self.output / RESULT_FILE, *(path for path in pictures if path)]
        console.print(f"written: {', '.join(map(str, written))}")


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


def print_accuracy(content: dict[str, Any]) -> None:
    """Print every table of the accuracy bench that has rows, and what was left out."""
    grids = [targets_grid(content), *accuracy_tables.all_grids(content)]
    _print((grid for grid in grids if grid.rows), content["left_out"])


def print_grids(content: dict[str, Any]) -> None:
    """Print every table of the segmentation bench that has rows, and what was left out."""
    _print(segmentation_tables.all_grids(content), content["left_out"])


def _print(grids: Iterable[segmentation_tables.Grid], left_out: dict[str, str]) -> None:
    for grid in grids:
        console.print(f"\n{grid.title}", style="bold", markup=False)
        console.print(grid.text(), soft_wrap=True, highlight=False, markup=False)
    for key, problem in left_out.items():
        console.print(f"left out {key}: {problem}", markup=False)
