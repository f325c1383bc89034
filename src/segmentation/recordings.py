# SPDX-License-Identifier: Apache-2.0
"""Fine-tuning with somebody's own recordings: what is held out, what is mixed in, how it trains."""

from __future__ import annotations

import zlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from kintrack.bounds import check_bounds
from kintrack.errors import ConfigError, DatasetError
from segmentation.dataset import Pictures, Split, everything, split
from segmentation.errors import WeightsError
from segmentation.training_config import TrainConfig

if TYPE_CHECKING:
    from segmentation.weights import Weights

GAP = 15
"""Pictures between the two parts of a single recording that belong to neither."""
LEAST = 10
"""Fewest pictures on either side of a division."""
VALIDATION_STEPS, VALIDATION_FRAMES, WARMUP_STEPS, CHECKPOINT_MINUTES = 100, 120, 20, 2.0
"""A short training looks at itself more often, and starts with what is right already."""


@dataclass(frozen=True)
class TuningConfig:
    """How weights are adapted to recordings."""

    minutes: float = 20.0
    """Length by the clock, labelling left out [min]; --steps counts in steps instead."""
    rate: float = 2e-4
    """Highest learning rate."""
    held_out: float = 0.2
    """About which share of people, or of recordings where people are unknown, is held out."""
    person: str = ""
    """Regular expression that finds the person in a recording's path, for example "_(s[0-9]+)_";
    people are then held out whole."""

    def __post_init__(self) -> None:
        check_bounds(self, minutes=(0.01, 1e5), rate=(1e-8, 1.0), held_out=(0.01, 0.9))


@dataclass(frozen=True)
class Division:
    """Which recordings train and which are held out."""

    train: tuple[str, ...]
    """Recordings."""
    held: tuple[str, ...]
    """Recordings."""
    by: str
    """`people`, `recordings`, `choice`, or `time` for one recording cut in two."""
    caution: str = ""
    """What the scores of the held-out part do not say; empty if nothing."""


def divide(
    frames: Mapping[str, int],
    people: Mapping[str, str],
    share: float,
    chosen: Collection[str] = (),
) -> Division:
    """Hold out whole people, else whole recordings, else the end of the only recording.

    Args:
        frames: Recording -> its usable pictures.
        people: Recording -> person, where that is known.
        share: About which share is held out; at least one is, and at least one is not.
        chosen: Recordings to hold out; none to choose by `share`.

    Returns:
        The division.

    Raises:
        DatasetError: if one side would be empty.
    """
    names = [name for name, count in frames.items() if count]
    held: Collection[str]
    if chosen:
        held, by = [name for name in names if name in chosen], "choice"
    elif len(names) < 2:
        return _in_time(names, sum(frames.values()))
    else:
        by = "people" if len({people.get(name) for name in names} - {None}) > 1 else "recordings"
        who = {name: people.get(name, name) if by == "people" else name for name in names}
        held_who = _drawn(sorted(set(who.values())), share)
        held = [name for name in names if who[name] in held_who]
    train = [name for name in names if name not in held]
    if not train or not held:
        side = "held out" if train else "left to train on"
        raise DatasetError(f"no recording with usable frames is {side}; give more recordings, or "
                           "choose others with --validation")  # fmt: skip
    both = {people.get(name) for name in train} & {people.get(name) for name in held} - {None}
    caution = ""
    if both:
        caution = (f"{', '.join(sorted(map(str, both)))} both trained and was held out: somebody "
                   "who is new will be labelled less well")  # fmt: skip
    elif not all(name in people for name in names):
        caution = (
            "recordings were held out, not people: if the same person is in both parts, somebody "
            "new will be labelled less well; --tuning.person tells who is who"
        )
    return Division(tuple(train), tuple(held), by, caution)


def divided(packs: Mapping[str, Path], division: Division, share: float) -> Split:
    """Pictures of a division's two sides.

    Args:
        packs: Recording -> folder of its pack.
        division: Which recordings are on which side.
        share: Share of a single recording that is held out; `LEAST` pictures train in any case.
    """
    train, held = (
        everything([packs[name] for name in names]) for names in (division.train, division.held)
    )
    if division.by != "time":
        return Split(train, held)
    first = max(len(held) - max(LEAST, round(share * len(held))), LEAST + GAP)
    return Split(
        Pictures(train.packs, train.where[: first - GAP]), Pictures(held.packs, held.where[first:])
    )


def mixed(own: Pictures, other: Pictures) -> Pictures:
    """Both, the smaller part repeated until about half of the pictures are somebody's own."""
    times = max(1, round(len(other) / len(own)))
    again = max(1, round(len(own) / len(other)))
    moved = other.where + np.array([len(own.packs), 0, 0])
    where = np.concatenate([np.tile(own.where, (times, 1)), np.tile(moved, (again, 1))])
    return Pictures((*own.packs, *other.packs), where)


def split_others(packs: Sequence[Path], config: TrainConfig) -> tuple[Pictures, Pictures | None]:
    """Other labelled pictures that train, and those that show whether they are forgotten.

    All train if there are not two people or recordings to divide.
    """
    try:
        both = split(packs, config.validation_share, config.validation_part)
    except DatasetError:
        return everything(packs), None
    return both.train, both.validation


def tuning_config(config: TrainConfig, tuning: TuningConfig, start: Weights) -> TrainConfig:
    """How to train from weights that are right already.

    Raises:
        ConfigError: if an option is given that fine-tuning has another one for.
        WeightsError: if another network is asked for than the weights are for.
    """
    usual = TrainConfig()
    for name, instead in (("hours", "minutes"), ("rate", "rate")):
        if getattr(config, name) != getattr(usual, name):
            raise ConfigError(f"{name} = {getattr(config, name)}: with --from-recordings it is "
                              f"--tuning.{instead}")  # fmt: skip
    if config.prepared:
        raise ConfigError(f"prepared = {config.prepared}: it cannot be had with --from-recordings")
    if config.network not in (usual.network, start.config):
        raise WeightsError(f"weights of {start.config} cannot begin {config.network}")
    return replace(
        config,
        network=start.config,
        hours=tuning.minutes / 60.0,
        rate=tuning.rate,
        normalised=False,
        warmup_steps=min(config.warmup_steps, WARMUP_STEPS),
        validation_steps=min(config.validation_steps, VALIDATION_STEPS),
        validation_frames=min(config.validation_frames, VALIDATION_FRAMES),
        checkpoint_minutes=min(config.checkpoint_minutes, CHECKPOINT_MINUTES),
    )


def _in_time(names: Sequence[str], count: int) -> Division:
    """The only recording's beginning trains, its end is held out."""
    if count < 2 * LEAST + GAP:
        raise DatasetError(f"{count} usable frames of one recording: nothing can be held out; "
                           f"{2 * LEAST + GAP}, or a second recording, are needed")  # fmt: skip
    caution = (
        "there is one recording only: its end was held out, which looks much like its beginning, "
        "so these scores say little; record a second one"
    )
    return Division(tuple(names), tuple(names), "time", caution)


def _drawn(names: Sequence[str], share: float) -> set[str]:
    """About a share of the names, always the same ones; at least one, and not all."""
    ordered = sorted(names, key=lambda name: (zlib.crc32(name.encode()), name))
    count = min(max(1, round(share * len(ordered))), len(ordered) - 1)
    return set(ordered[:count])
