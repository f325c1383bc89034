# SPDX-License-Identifier: Apache-2.0
"""Which recordings make up a dataset.

Held-out people, motions and objects never reach a part that is trained on.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from kintrack.errors import DatasetError
from synthesis.motions.actions import (
    HELD_OUT_ACTIONS,
    HOLDING_ACTIONS,
    SITTING_ACTIONS,
    training_actions,
)
from synthesis.motions.mocap import HELD_OUT, clips_in, load_clip
from synthesis.people.population import held_out_people, training_people
from synthesis.takes import Take

PAPER_FRAMES = 300
PAPER_PEOPLE, PAPER_NEW_PEOPLE = 6, 2
"""People of the training and of the test part; together the eight of [Wan19]."""
PAPER_TRAIN, PAPER_TEST = 28, 4
"""Clean recordings in either part."""
WITH_OBJECTS = (
    "walking_with_suitcase",
    "sitting_down_and_rising",
    "carrying_box",
    "bending_and_lifting",
    "sitting_and_gesturing",
    "walking_with_suitcase",
    "sitting_down_and_rising",
)
"""The seven recordings with objects."""
TRAINING_FRAMES, TRAINING_STRIDE = 10, 10
"""Length of a training take [frames], motion frames per recorded one."""
TRAINING_TOTAL = 12_000
"""Frames altogether, unless told otherwise."""
TRAINING_SENSORS = {
    "kinect_v2": 0.25,
    "kinect_v2_far": 0.25,
    "kinect_v1": 0.2,
    "kinect_v1_320": 0.1,
    "stereo": 0.2,
}
"""Share of each sensor."""
TRAINING_CLIPS = 0.15
"""Share of takes with motion capture, if there is any."""
ARMS_CLIPS = 0.3
"""The same for `arms`; legs and trunks of real people, then, twice as often."""
SOFAS_ROAMING, SOFAS_FACING = 0.4, 0.75
"""Of takes on sofas, share with arms that go anywhere and share before the camera."""
BENCH_FRAMES, BENCH_ACTIONS = 120, 8
"""Length and number of motions of the bench."""


def paper(seed: int, mocap: Path | None, frames: int | None = None) -> tuple[Take, ...]:
    """The set of [Wan19]: 8 people, 32 clean recordings and 7 with objects, 300 frames each.

    28 clean recordings train; 4 with people and motions that training does not see test. The two
    unseen objects are what `kintrack occlude` and the bench put before them.

    Args:
        seed: Draws people, motions and all else.
        mocap: Folder of motion capture clips; authored motions only if None.
        frames: Length of every recording; 300 if None.
    """
    length = PAPER_FRAMES if frames is None else frames
    rng = np.random.default_rng((seed, 0))
    people = rng.choice(training_people(), PAPER_PEOPLE, replace=False)
    strangers = rng.choice(held_out_people(), PAPER_NEW_PEOPLE, replace=False)
    motions = _shuffled([*training_actions(), *training_clips(mocap, length)], rng)
    new_motions = _shuffled([*HELD_OUT_ACTIONS, *held_out_clips(mocap, length)], rng)
    takes: list[Take] = []
    for part, names, who, count in (
        ("train", motions, people, PAPER_TRAIN),
        ("test", new_motions, strangers, PAPER_TEST),
        ("objects", WITH_OBJECTS, people, len(WITH_OBJECTS)),
    ):
        for n in range(count):
            takes.append(
                Take(
                    name=f"{n:02d}_{names[n % len(names)]}",
                    part=part,
                    seed=(seed, 1, len(takes)),
                    person=int(who[n % len(who)]),
                    action=names[n % len(names)],
                    sensor="kinect_v2",
                    frames=length,
                    facing=True,
                    held_out_things=part == "test",
                )
            )
    return tuple(takes)


def training(seed: int, mocap: Path | None, frames: int | None = None) -> tuple[Take, ...]:
    """Many short takes of many people, rooms and sensors.

    Args:
        seed: Draws all.
        mocap: Folder of motion capture clips; authored motions only if None.
        frames: Frames altogether, rounded up to whole takes; `TRAINING_TOTAL` if None.
    """
    return _short_takes((seed, 2), seed, 3, mocap, frames, training_actions(), TRAINING_CLIPS)


def arms(seed: int, mocap: Path | None, frames: int | None = None) -> tuple[Take, ...]:
    """As `training`, but arms go anywhere (`synthesis.motions.roaming`).

    Args:
        seed: Draws all.
        mocap: Folder of motion capture clips; authored motions only if None.
        frames: Frames altogether, rounded up to whole takes; `TRAINING_TOTAL` if None.
    """
    empty = tuple(name for name in training_actions() if name not in HOLDING_ACTIONS)
    takes = _short_takes((seed, 6), seed, 7, mocap, frames, empty, ARMS_CLIPS)
    return tuple(replace(take, roaming_arms=True) for take in takes)


def sofas(seed: int, mocap: Path | None, frames: int | None = None) -> tuple[Take, ...]:
    """As `training`, but everybody sits on a sofa or in an armchair, some with arms that roam.

    Args:
        seed: Draws all.
        mocap: Not used.
        frames: Frames altogether, rounded up to whole takes; `TRAINING_TOTAL` if None.
    """
    takes = _short_takes((seed, 8), seed, 9, None, frames, SITTING_ACTIONS, 0.0)
    rng = np.random.default_rng((seed, 10))
    return tuple(
        replace(
            take,
            on_sofa=True,
            roaming_arms=bool(rng.random() < SOFAS_ROAMING),
            facing=bool(rng.random() < SOFAS_FACING),
        )
        for take in takes
    )


def _short_takes(
    draws: tuple[int, int],
    seed: int,
    stream: int,
    mocap: Path | None,
    frames: int | None,
    actions: tuple[str, ...],
    clips_share: float,
) -> tuple[Take, ...]:
    """Takes for training: another person, action, sensor and room each."""
    total = TRAINING_TOTAL if frames is None else frames
    rng = np.random.default_rng(draws)
    clips = training_clips(mocap, TRAINING_FRAMES * TRAINING_STRIDE)
    sensors, shares = list(TRAINING_SENSORS), list(TRAINING_SENSORS.values())
    takes: list[Take] = []
    for n in range(-(-total // TRAINING_FRAMES)):
        from_clip = bool(clips) and rng.random() < clips_share
        takes.append(
            Take(
                name=f"{n:05d}",
                part="train",
                seed=(seed, stream, n),
                person=int(rng.choice(training_people())),
                action=str(rng.choice(clips if from_clip else actions)),
                sensor=str(rng.choice(sensors, p=shares)),
                frames=TRAINING_FRAMES,
                stride=TRAINING_STRIDE,
                room=bool(rng.random() < 0.93),
                barrier=bool(rng.random() < 0.35),
                moving_camera=bool(rng.random() < 0.3),
                truncated=bool(rng.random() < 0.25),
            )
        )
    return tuple(takes)


def bench(seed: int, mocap: Path | None, frames: int | None = None) -> tuple[Take, ...]:
    """Held-out people doing held-out motions, each once alone and once in a room.

    Args:
        seed: Draws all.
        mocap: Folder of motion capture clips; authored motions only if None.
        frames: Length of every recording; 120 if None.
    """
    length = BENCH_FRAMES if frames is None else frames
    rng = np.random.default_rng((seed, 4))
    motions = _shuffled([*HELD_OUT_ACTIONS, *held_out_clips(mocap, length)], rng)
    takes: list[Take] = []
    for n in range(BENCH_ACTIONS):
        action, person = motions[n % len(motions)], int(rng.choice(held_out_people()))
        for part in ("alone", "room"):
            takes.append(
                Take(
                    name=f"{n:02d}_{action}",
                    part=part,
                    seed=(seed, 5, n),
                    person=person,
                    action=action,
                    sensor="kinect_v2",
                    frames=length,
                    room=part == "room",
                    held_out_things=True,
                )
            )
    return tuple(takes)


Recipe = Callable[[int, Path | None, int | None], tuple[Take, ...]]

RECIPES: dict[str, Recipe] = {
    "paper": paper,
    "training": training,
    "arms": arms,
    "sofas": sofas,
    "bench": bench,
}
"""Every recipe by name."""


def takes_of(
    recipe: str, seed: int, mocap: Path | None, frames: int | None = None
) -> tuple[Take, ...]:
    """The takes of a recipe.

    Raises:
        DatasetError: if the recipe is unknown or the number of frames is not above zero.
    """
    if recipe not in RECIPES:
        raise DatasetError(f"recipe {recipe!r}; allowed: {', '.join(RECIPES)}")
    if frames is not None and frames < 1:
        raise DatasetError(f"frames = {frames}; at least 1 is needed")
    return RECIPES[recipe](seed, mocap, frames)


def training_clips(folder: Path | None, frames: int) -> list[str]:
    """Names of clips of at least some length that may be trained on; none without a folder."""
    return [name for name in _clips(folder, frames) if name not in HELD_OUT]


def held_out_clips(folder: Path | None, frames: int) -> list[str]:
    """Names of clips of at least some length that are never trained on."""
    return [name for name in _clips(folder, frames) if name in HELD_OUT]


def _clips(folder: Path | None, frames: int) -> list[str]:
    if folder is None:
        return []
    return [path.stem for path in clips_in(folder) if len(load_clip(path).times_s) >= frames]


def _shuffled(names: Sequence[str], rng: np.random.Generator) -> list[str]:
    return [str(name) for name in rng.permutation(np.array(names, dtype=str))]
