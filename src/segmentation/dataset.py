# SPDX-License-Identifier: Apache-2.0
"""Which pictures train and which validate, and the batches that are made of them."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int, UInt8
from numpy import ndarray

from kintrack.errors import DatasetError
from segmentation.augment.sample import AugmentConfig, Bank, augmented, plain_sample
from segmentation.pack_files import Packed, Planes, open_pack, picture
from segmentation.picture import Picture


@dataclass(frozen=True)
class Pictures:
    """Some pictures of some packs; the packs are opened when the first is looked at."""

    packs: tuple[Path, ...]
    """Folders of the packs."""
    where: Int[ndarray, "n 3"]
    """Pack, recording in it, and picture in that, of each."""

    def __len__(self) -> int:
        return len(self.where)

    def __getitem__(self, index: int) -> Picture:
        pack, entry, at = (int(i) for i in self.where[index])
        entries, planes = self._open[pack]
        return picture(entries[entry], planes, at)

    def __getstate__(self) -> dict[str, Any]:
        return {"packs": self.packs, "where": self.where}

    @cached_property
    def _open(self) -> list[tuple[list[Packed], Planes]]:
        return [open_pack(folder) for folder in self.packs]

    def spread(self, count: int) -> Pictures:
        """At most so many of them, evenly spread."""
        chosen = np.linspace(0, len(self) - 1, min(count, len(self))).round().astype(int)
        return Pictures(self.packs, self.where[chosen])

    def crc(self) -> int:
        """Tells these pictures from others."""
        crc = zlib.crc32(np.ascontiguousarray(self.where, dtype="<i4").tobytes())
        for entries, _ in self._open:
            for entry in entries:
                crc = zlib.crc32(f"{entry.name} {entry.fingerprint}".encode(), crc)
        return crc


@dataclass(frozen=True)
class Split:
    """What trains and what validates."""

    train: Pictures
    """Pictures to learn from."""
    validation: Pictures
    """Pictures of other people or recordings."""


def split(packs: Sequence[Path], share: float, part: str = "") -> Split:
    """Divide pictures by person or, where that is unknown, by recording; never by chance.

    Args:
        packs: Folders of packs.
        share: About which share of people or recordings validates. At least one of each.
        part: A part of a dataset that validates as a whole, for example `test`.

    Returns:
        Both.

    Raises:
        DatasetError: if there are not two people or recordings to divide.
    """
    opened = [open_pack(folder)[0] for folder in packs]
    entries = [
        (number, n, entry)
        for number, recordings in enumerate(opened)
        for n, entry in enumerate(recordings)
        if entry.frames
    ]
    place = {key: zlib.crc32(key.encode()) / 2**32 for key in {_who(e) for _, _, e in entries}}
    if len(place) < 2:
        raise DatasetError(
            f"{', '.join(str(folder) for folder in packs)}: training and validation need "
            f"recordings of their own; there is {len(place)} of one person"
        )
    ordered = sorted(place, key=lambda key: (place[key], key))
    held = {key for key in ordered if place[key] < share} or {ordered[0]}
    if len(held) == len(place):
        held.remove(ordered[-1])
    by_part = {e.facts.get("part") == part for _, _, e in entries} == {True, False}

    def chosen(validates: bool) -> Pictures:
        rows = [
            (number, n, at)
            for number, n, entry in entries
            if ((entry.facts.get("part") == part) if by_part else (_who(entry) in held))
            is validates
            for at in range(entry.frames)
        ]
        return Pictures(tuple(packs), np.array(rows, dtype=np.int64).reshape(-1, 3))

    return Split(chosen(False), chosen(True))


def everything(packs: Sequence[Path]) -> Pictures:
    """All pictures of some packs."""
    rows = [
        (number, n, at)
        for number, folder in enumerate(packs)
        for n, entry in enumerate(open_pack(folder)[0])
        for at in range(entry.frames)
    ]
    return Pictures(tuple(packs), np.array(rows, dtype=np.int64).reshape(-1, 3))


def _who(entry: Packed) -> str:
    return f"person {entry.facts['person']}" if "person" in entry.facts else entry.name


class Shuffled:
    """The endless row of epochs, each in an order of its own."""

    def __init__(self, count: int, seed: int):
        """Orders of `count` things, drawn by the seed."""
        self._count, self._seed = count, seed
        self._epoch, self._order = -1, np.zeros(0, dtype=np.int64)

    def at(self, position: int) -> int:
        """Which thing stands at a place."""
        epoch, place = divmod(position, self._count)
        if epoch != self._epoch:
            rng = np.random.default_rng((self._seed, 2, epoch))
            self._epoch, self._order = epoch, rng.permutation(self._count)
        return int(self._order[place])


@dataclass
class Batches:
    """Batch by number, each a function of its number alone: of no worker and of no batch before.

    Pictures come in an order drawn anew for each epoch; every picture comes once an epoch.
    """

    pictures: Pictures
    """What to draw from."""
    augment: AugmentConfig | None
    """How pictures change; None leaves them as they are."""
    bank: Bank
    """What is put into them."""
    batch: int
    """Samples a batch and process."""
    seed: int
    """Draws all."""
    rank: int = 0
    """Which of the processes this is."""
    world: int = 1
    """Processes that train together."""

    def __getitem__(
        self, step: int
    ) -> tuple[Float[ndarray, "b 4 106 128"], UInt8[ndarray, "b 106 128"]]:
        samples = []
        order = self.__dict__.setdefault("_order", Shuffled(len(self.pictures), self.seed))
        first = (step * self.world + self.rank) * self.batch
        for position in range(first, first + self.batch):
            one = self.pictures[order.at(position)]
            if self.augment is None:
                samples.append(plain_sample(one))
            else:
                rng = np.random.default_rng((self.seed, 1, position))
                samples.append(augmented(one, self.augment, self.bank, rng))
        return np.stack([s.image for s in samples]), np.stack([s.labels for s in samples])
