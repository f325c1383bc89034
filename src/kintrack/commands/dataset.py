# SPDX-License-Identifier: Apache-2.0
"""`kintrack dataset`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from kintrack.commands.console import StepProgress, console
from synthesis.dataset.build import build_dataset, estimated_bytes, pending
from synthesis.dataset.pictures import write_sheet
from synthesis.dataset.recipes import takes_of


@dataclass(frozen=True)
class DatasetBuild:
    """Make a synthetic dataset; a build that was stopped goes on where it was."""

    output: tyro.conf.Positional[Path]
    """Folder of the dataset."""
    recipe: str = "paper"
    """paper: 8 people, 32 clean recordings and 7 with objects, 300 frames; training: many short
    takes; arms: the same with arms that go anywhere; sofas: the same on sofas; bench: held-out
    people and motions."""
    seed: int = 0
    """Draws everything; the same seed gives the same bytes."""
    frames: int | None = None
    """Another length: of every recording, or of the whole set for `training`, `arms` and
    `sofas`."""
    mocap: Path | None = None
    """Folder of motion capture clips; authored motions only if not given."""
    workers: int | None = None
    """Processes; one per core if not given."""

    def run(self) -> None:
        """Say how much disk is needed, then build with progress."""
        takes = takes_of(self.recipe, self.seed, self.mocap, self.frames)
        todo = pending(self.output, takes)
        total = sum(take.frames for take in takes)
        console.print(
            f"{len(takes)} recordings, {total} frames; {len(takes) - len(todo)} are there; about "
            f"{estimated_bytes(todo) / 1e9:.2f} GB to write"
        )
        facts: dict[str, object] = {"recipe": self.recipe, "seed": self.seed}
        with StepProgress() as bar:
            build_dataset(
                self.output,
                takes,
                facts,
                self.mocap,
                self.workers,
                lambda progress: bar("filming", progress.frames, total),
            )
        console.print(f"written: {self.output}")


@dataclass(frozen=True)
class DatasetPictures:
    """Draw random frames of a dataset: colour, depth and labels side by side."""

    dataset: tyro.conf.Positional[Path]
    """Folder of a dataset."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])] = Path("dataset.png")
    """Picture to write."""
    count: int = 20
    """How many frames."""
    seed: int = 0
    """Draws them."""

    def run(self) -> None:
        """Draw."""
        write_sheet(self.dataset, self.output, self.count, self.seed)
        console.print(f"written: {self.output}")


@dataclass(frozen=True)
class Dataset:
    """Synthetic people in synthetic rooms: build a dataset or look at one."""

    action: Annotated[
        Annotated[DatasetBuild, tyro.conf.subcommand("build")]
        | Annotated[DatasetPictures, tyro.conf.subcommand("pictures")],
        tyro.conf.OmitSubcommandPrefixes,
        tyro.conf.OmitArgPrefixes,
    ]
    """What to do."""

    def run(self) -> None:
        """Do it."""
        self.action.run()
