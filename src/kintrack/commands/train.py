# SPDX-License-Identifier: Apache-2.0
"""`kintrack train`."""

from __future__ import annotations

import os
import sys
import zlib
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro
from rich.progress import BarColumn, Progress, TextColumn

from kintrack.commands.console import StepProgress, console
from kintrack.errors import ConfigError
from segmentation.training_config import TrainConfig

if TYPE_CHECKING:
    from segmentation.augment.sample import Bank
    from segmentation.dataset import Split
    from segmentation.evaluate import Scores
    from segmentation.train import TrainProgress


@dataclass(frozen=True)
class Train:
    """Train the part segmentation on labelled recordings; a stopped run goes on."""

    data: tyro.conf.Positional[tuple[Path, ...]]
    """Recordings or folders of recordings, with labels."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """Folder of the run: checkpoints, log, curves, weights.safetensors."""
    validation: tuple[Path, ...] = ()
    """Recordings to validate with; a share of DATA if none."""
    start: Path | None = None
    """Weights to begin with, for fine-tuning."""
    cache: Path | None = None
    """Folder of packed recordings and rendered objects, for several runs; OUTPUT/cache if not
    given."""
    config: Annotated[TrainConfig, tyro.conf.arg(name="")] = field(default_factory=TrainConfig)
    """How to train."""

    def run(self) -> None:
        """Pack, render, train with progress; Ctrl-C leaves a checkpoint."""
        try:
            from segmentation.learner import join_group
            from segmentation.train import sources_of, train
            from segmentation.weights import load_weights
        except ImportError as error:
            raise ConfigError(
                f"training needs {error.name}: pip install 'kintrack[train,synthesis]'"
            ) from None
        if not self.data:
            raise ConfigError("nothing to train on: at least one folder of recordings is needed")
        start = None
        if self.start is not None:
            start = load_weights(self.start, self.config.network.architecture)
        group = join_group(self.config)
        prepared = self._prepare() if group.leads else None
        group.agree(0.0)
        data, bank = prepared or self._prepare()
        facts = {"data": sources_of(self.data), "validation_data": sources_of(self.validation),
                 "command": _command(), "start": self.start and self.start.name}  # fmt: skip
        if group.leads:
            console.print(f"{len(data.train)} frames train, {len(data.validation)} validate")
        with _Bar(shown=group.leads) as bar:
            path = train(self.config, data, bank, self.output, facts, start, bar)
        if group.leads:
            console.print(f"written: {path}")

    def _prepare(self) -> tuple[Split, Bank]:
        """Packed data and rendered objects; both are kept for the next time."""
        from segmentation.augment.bank import load_bank
        from segmentation.augment.sample import Bank
        from segmentation.dataset import Split, everything, split
        from segmentation.pack import pack

        cache = self.cache or self.output / "cache"
        config = self.config
        packs, bank = [], Bank()
        with StepProgress() as show:
            for root in (*self.data, *self.validation):
                packs.append(cache / f"{root.resolve().name}-{_crc(root):08x}")
                pack(root, packs[-1], partial(show, f"packing {root.name}"))
            if config.bank.cutouts or config.bank.rooms:
                size = f"{config.bank.cutouts}-{config.bank.rooms}-{config.bank.seed}"
                path = cache / f"bank-{size}.safetensors"
                bank = load_bank(path, config.bank, partial(show, "rendering objects"))
        own, others = packs[: len(self.data)], packs[len(self.data) :]
        if not others:
            return split(own, config.validation_share, config.validation_part), bank
        return Split(everything(own), everything(others)), bank


class _Bar:
    """Share, step, loss, IoU and time left; a line per validation where nobody watches."""

    def __init__(self, shown: bool):
        self._bar = Progress(
            TextColumn("training"),
            BarColumn(),
            TextColumn("{task.percentage:.1f} %"),
            TextColumn("{task.fields[note]}"),
            console=console,
            disable=not shown,
        )
        self._task = self._bar.add_task("train", total=1.0, note="")
        self._told: Scores | None = None

    def __enter__(self) -> _Bar:
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def __call__(self, progress: TrainProgress) -> None:
        """Show how far training is."""
        note = f"step {progress.step}  loss {progress.loss:.4f}"
        if progress.scores is not None:
            note += f"  IoU {100 * progress.scores.non_background_iou:.1f}"
        minutes = int(progress.left_s // 60)
        note += f"  left {minutes // 60}:{minutes % 60:02d} h"
        self._bar.update(self._task, completed=progress.share, note=note)
        if progress.scores is not self._told and not console.is_terminal:
            console.print(note)
        self._told = progress.scores


def _crc(root: Path) -> int:
    return zlib.crc32(str(root.resolve()).encode())


def _command() -> str:
    words: list[Any] = [os.path.basename(sys.argv[0]), *sys.argv[1:]]
    return " ".join(str(word) for word in words)
