# SPDX-License-Identifier: Apache-2.0
"""Weights before and after fine-tuning, judged on the same held-out pictures."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import UInt8
from numpy import ndarray

from segmentation.augment.sample import (
    AugmentConfig,
    Bank,
    Sample,
    as_sample,
    changed,
    plain_sample,
)
from segmentation.dataset import Pictures
from segmentation.errors import RuntimeFallbackWarning
from segmentation.evaluate import N, Scores, confusion, scores_of
from segmentation.runtime import NetworkSegmenter, labels_of, segmenter
from segmentation.weights import Weights

OCCLUDED = AugmentConfig(
    zoomed=0.0, mirrored=0.0, inserted=1.0, nobody=0.0, other_room=0.0, background_removed=0.0,
    depth_only=0.0, recolored=0.0, spoilt=0.0, absorbed=0.0, focal_spread=0.0,
)  # fmt: skip
"""Objects are put in and nothing else is changed; a picture without background may get a room."""
FRAMES = 300
"""Pictures that weights are judged on, at most, in each condition."""


@dataclass(frozen=True)
class Compared:
    """Scores under one condition."""

    name: str
    """The condition."""
    pictures: int
    """How many."""
    start: Scores
    """Of the weights that training began with."""
    tuned: Scores
    """Of those that it ended with."""

    @property
    def gain(self) -> float:
        """Change of the non-background IoU."""
        return self.tuned.non_background_iou - self.start.non_background_iou


@dataclass(frozen=True)
class Shown:
    """One picture as both weights label it."""

    condition: str
    """What was done with it."""
    sample: Sample
    """Input and true labels."""
    start: UInt8[ndarray, "106 128"]
    """Labels by the weights that training began with."""
    tuned: UInt8[ndarray, "106 128"]
    """Labels by those that it ended with."""


def conditions(pictures: Pictures, bank: Bank, seed: int) -> dict[str, Callable[[int], Sample]]:
    """Samples by number under each condition: as recorded, and with objects in front.

    Args:
        pictures: Held-out pictures.
        bank: Objects that were not trained with; none to leave that condition out.
        seed: Draws the objects and their places.
    """

    def occluded(number: int) -> Sample:
        rng = np.random.default_rng((seed, 3, number))
        return as_sample(changed(pictures[number], OCCLUDED, bank, rng))

    made: dict[str, Callable[[int], Sample]] = {"as recorded": lambda n: plain_sample(pictures[n])}
    if len(pictures) and any(pictures[n].color is not None for n in (0, len(pictures) - 1)):
        made["without colour"] = lambda n: plain_sample(pictures[n], depth_only=True)
    if len(bank.cutouts):
        made["objects in front"] = occluded
    return made


def compare(
    start: Weights,
    tuned: Weights,
    parts: dict[str, tuple[int, Callable[[int], Sample]]],
    shown: int = 3,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
) -> tuple[list[Compared], list[Shown], str]:
    """Scores of both weights, on whatever labels fastest here.

    Args:
        start: Weights before.
        tuned: Weights after.
        parts: Condition -> how many samples, and a sample by its number.
        shown: Samples of each condition to return with both labels.
        on_progress: Called with samples judged and in all.

    Returns:
        Scores by condition, some samples, and what computed the labels.
    """
    both = [_quietly(weights) for weights in (start, tuned)]
    compared, pictures, done = [], [], 0
    total = sum(count for count, _ in parts.values())
    for name, (count, sample_of) in parts.items():
        counts = np.zeros((2, N, N), dtype=np.int64)
        wanted = set(np.linspace(0, count - 1, shown + 2).round().astype(int)[1:-1].tolist())
        for number in range(count):
            sample = sample_of(number)
            found = [labels_of(one.logits_of(sample.image)) for one in both]
            for k, labels in enumerate(found):
                counts[k] += confusion(sample.labels, labels)
            if number in wanted:
                pictures.append(Shown(name, sample, *found))
            done += 1
            on_progress(done, total)
        compared.append(Compared(name, count, *map(scores_of, counts)))
    return compared, pictures, both[1].runtime


def _quietly(weights: Weights) -> NetworkSegmenter:
    """A segmenter; that another runtime stands in for the preferred one changes no verdict."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeFallbackWarning)
        return segmenter(weights)
