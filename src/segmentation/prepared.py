# SPDX-License-Identifier: Apache-2.0
"""Changed samples that are made once and learnt from many times.

A GPU learns faster than processors change pictures, and several networks that are compared should
see the same. Samples lie in chunks, a file each, written whole or not at all, so that a stopped
preparation goes on.
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import cached_property
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt8
from numpy import ndarray

from segmentation.augment.bank import BankConfig
from segmentation.augment.sample import AugmentConfig, Bank
from segmentation.dataset import Batches, Pictures, Shuffled
from segmentation.errors import SegmentationError
from segmentation.labels import INPUT_CHANNELS, INPUT_HEIGHT, INPUT_WIDTH, MIRRORED

CHUNK = 500
"""Samples in a file."""
ROW = np.dtype(
    [
        ("image", "<f2", (len(INPUT_CHANNELS), INPUT_HEIGHT, INPUT_WIDTH)),
        ("labels", "u1", (INPUT_HEIGHT, INPUT_WIDTH)),
    ]
)
"""A sample as it is kept."""
SWAPPED = np.append(MIRRORED, np.arange(len(MIRRORED), 256, dtype=np.uint8))
"""`MIRRORED` for every byte."""


@dataclass(frozen=True)
class Prepared:
    """Samples in the files of a folder, opened when the first is looked at."""

    folder: Path
    """Where the chunks lie."""
    count: int
    """How many samples."""

    def __len__(self) -> int:
        return self.count

    def sample(self, index: int) -> tuple[Float[ndarray, "4 106 128"], UInt8[ndarray, "106 128"]]:
        """Network input and labels."""
        row = self._chunks[index // CHUNK][index % CHUNK]
        return row["image"].astype(np.float32), np.array(row["labels"])

    @cached_property
    def _chunks(self) -> list[ndarray]:
        files = [_chunk(self.folder, n) for n in range(-(-self.count // CHUNK))]
        return [np.load(path, mmap_mode="r", allow_pickle=False) for path in files]


def prepare(
    cache: Path,
    pictures: Pictures,
    augment: AugmentConfig,
    bank: Bank,
    bank_config: BankConfig,
    count: int,
    seed: int,
    workers: int = 1,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
) -> Prepared:
    """Make samples, or go on where an earlier preparation of the same ones stopped.

    Args:
        cache: Folder in which these samples get one of their own.
        pictures: What is changed.
        augment: How often what happens to it.
        bank: Things and rooms that are put in.
        bank_config: What drew them.
        count: Samples, rounded up to whole chunks.
        seed: Draws all.
        workers: Processes.
        on_progress: Called with samples done and in all.

    Raises:
        SegmentationError: if samples cannot be written.
    """
    chunks = -(-count // CHUNK)
    source = {"augment": asdict(augment), "bank": asdict(bank_config), "seed": seed}
    crc = zlib.crc32(json.dumps([source, pictures.crc()]).encode())
    folder = cache / f"prepared-{crc:08x}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        todo = [n for n in range(chunks) if not _chunk(folder, n).is_file()]
        done = chunks - len(todo)
        if todo:
            with ProcessPoolExecutor(
                max(1, min(workers, len(todo))),
                get_context("spawn"),
                initializer=_begin,
                initargs=(folder, Batches(pictures, augment, bank, CHUNK, seed)),
            ) as pool:
                try:
                    for _ in pool.map(_write, todo):
                        done += 1
                        on_progress(done * CHUNK, chunks * CHUNK)
                except BaseException:
                    pool.shutdown(cancel_futures=True)
                    raise
    except OSError as error:
        raise SegmentationError(f"{folder}: samples cannot be prepared there ({error})") from error
    return Prepared(folder, chunks * CHUNK)


@dataclass
class PreparedBatches:
    """Batch by number from prepared samples, mirrored by chance; each a function of its number."""

    samples: Prepared
    """What to draw from; every sample comes once an epoch."""
    batch: int
    """Samples a batch and process."""
    seed: int
    """Draws order and mirroring."""
    rank: int = 0
    """Which of the processes this is."""
    world: int = 1
    """Processes that train together."""

    def __getitem__(
        self, step: int
    ) -> tuple[Float[ndarray, "b 4 106 128"], UInt8[ndarray, "b 106 128"]]:
        first = (step * self.world + self.rank) * self.batch
        order = self.__dict__.setdefault("_order", Shuffled(len(self.samples), self.seed))
        coins = np.random.default_rng((self.seed, 3, first)).random(self.batch)
        chosen = []
        for position, coin in zip(range(first, first + self.batch), coins, strict=True):
            image, labels = self.samples.sample(order.at(position))
            if coin < 0.5:
                image, labels = image[:, :, ::-1], SWAPPED[labels[:, ::-1]]
            chosen.append((image, labels))
        return np.stack([image for image, _ in chosen]), np.stack([labels for _, labels in chosen])


_work: dict[str, object] = {}


def _begin(folder: Path, batches: Batches) -> None:
    import cv2

    cv2.setNumThreads(1)
    _work.update(folder=folder, batches=batches)


def _write(number: int) -> None:
    folder, batches = _work["folder"], _work["batches"]
    assert isinstance(folder, Path) and isinstance(batches, Batches)
    rows = np.zeros(CHUNK, ROW)
    rows["image"], rows["labels"] = batches[number]
    path = _chunk(folder, number)
    beside = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    with beside.open("wb") as file:
        np.save(file, rows, allow_pickle=False)
    beside.replace(path)


def _chunk(folder: Path, number: int) -> Path:
    return folder / f"{number:05d}.npy"
