# SPDX-License-Identifier: Apache-2.0
"""`kintrack train`."""

from __future__ import annotations

import os
import sys
import zlib
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro
from rich.progress import BarColumn, Progress, TextColumn

from kintrack.commands.console import StepProgress, console
from kintrack.commands.recording import Recording
from kintrack.commands.tuning import tune
from kintrack.errors import ConfigError
from segmentation.architecture import NetworkConfig
from segmentation.augment.bank import BankConfig
from segmentation.recordings import TuningConfig
from segmentation.training_config import TrainConfig

if TYPE_CHECKING:
    from segmentation.augment.sample import Bank
    from segmentation.dataset import Split
    from segmentation.evaluate import Scores
    from segmentation.prepared import Prepared
    from segmentation.train import TrainProgress


def _default() -> TrainConfig:
    return TrainConfig(network=NetworkConfig.left_open())


@dataclass(frozen=True)
class Train:
    """Train the part segmentation on labelled recordings; a stopped run goes on."""

    data: tyro.conf.Positional[tuple[Path, ...]]
    """Recordings or folders of recordings, with labels."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """Folder of the run: checkpoints, log, curves, weights.safetensors."""
    from_recordings: tuple[Path, ...] = ()
    """Clean recordings of your own, each of one person with nothing in front, or folders of them:
    the tracker labels them, and weights are adapted to them. DATA, if given, is mixed in."""
    validation: tuple[Path, ...] = ()
    """Recordings to validate with; a share of the others if none. With --from-recordings they are
    labelled, too."""
    start: Path | None = None
    """Weights to begin with, for fine-tuning; with --from-recordings those that are installed if
    none are given."""
    cache: Path | None = None
    """Folder of labels, packed recordings and rendered objects, for several runs; inside OUTPUT if
    not given."""
    tuning: TuningConfig = field(default_factory=TuningConfig)
    """How weights are adapted with --from-recordings."""
    recording: Annotated[Recording, tyro.conf.OmitArgPrefixes] = field(default_factory=Recording)
    """How to read the recordings of --from-recordings."""
    config: Annotated[TrainConfig, tyro.conf.arg(name="")] = field(default_factory=_default)
    """How to train."""

    def __post_init__(self) -> None:
        network = replace(self.config.network)
        object.__setattr__(self, "config", replace(self.config, network=network))

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
        if self.from_recordings:
            tune(self, _command())
            return
        if not self.data:
            raise ConfigError("nothing to train on: at least one folder of recordings is needed")
        start = None
        if self.start is not None:
            start = load_weights(self.start, self.config.network.architecture)
        group = join_group(self.config)
        ready = self._prepare() if group.leads else None
        group.agree(0.0)
        data, bank, samples = ready or self._prepare()
        facts = {"data": sources_of(self.data), "validation_data": sources_of(self.validation),
                 "command": _command(), "start": self.start and self.start.name}  # fmt: skip
        if group.leads:
            console.print(f"{len(data.train)} frames train, {len(data.validation)} validate")
        with self.bar(group.leads) as bar:
            path = train(self.config, data, bank, self.output, facts, start, samples, bar)
        if group.leads:
            console.print(f"written: {path}")

    @property
    def cache_folder(self) -> Path:
        """Where packs and objects lie."""
        return self.cache or self.output / "cache"

    @property
    def labels(self) -> Path:
        """Where the labels of somebody's own recordings lie."""
        return (self.cache or self.output) / "labels"

    def pack_folder(self, root: Path) -> Path:
        """Where a folder of recordings is packed."""
        return self.cache_folder / f"{root.resolve().name}-{_crc(root):08x}"

    def bank_file(self, bank: BankConfig) -> Path:
        """Where rendered objects lie."""
        return self.cache_folder / f"bank-{bank.cutouts}-{bank.rooms}-{bank.seed}.safetensors"

    def bar(self, shown: bool = True) -> AbstractContextManager[Callable[[TrainProgress], None]]:
        """Progress of training."""
        return _Bar(shown)

    def _prepare(self) -> tuple[Split, Bank, Prepared | None]:
        """Packed data and rendered objects; both are kept for the next time."""
        from segmentation.augment.bank import load_bank
        from segmentation.augment.sample import Bank
        from segmentation.dataset import Split, everything, split
        from segmentation.pack import pack
        from segmentation.prepared import prepare

        config = self.config
        packs, bank = [], Bank()
        with StepProgress() as show:
            for root in (*self.data, *self.validation):
                packs.append(self.pack_folder(root))
                pack(root, packs[-1], partial(show, f"packing {root.name}"))
            if config.bank.cutouts or config.bank.rooms:
                path = self.bank_file(config.bank)
                bank = load_bank(path, config.bank, partial(show, "rendering objects"))
            own, others = packs[: len(self.data)], packs[len(self.data) :]
            data = (
                Split(everything(own), everything(others))
                if others
                else split(own, config.validation_share, config.validation_part)
            )
            if not config.prepared:
                return data, bank, None
            show_samples = partial(show, "changing samples")
            return data, bank, prepare(self.cache_folder, data.train, config.augment, bank,
                                       config.bank, config.prepared, config.seed, config.workers,
                                       show_samples)  # fmt: skip


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
