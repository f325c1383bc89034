# SPDX-License-Identifier: Apache-2.0
"""What the segmentation bench runs."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from kintrack.bounds import check_bounds
from kintrack.errors import ConfigError
from segmentation.runtime import RuntimeConfig


@dataclass(frozen=True)
class SegmentationBenchConfig:
    """How much is measured."""

    frames: int = 60
    """Frames judged of every synthetic recording, evenly spread."""
    real_recordings: int = 26
    """Real recordings without background that are put into real scenes, evenly spread."""
    real_frames: int = 16
    """Frames judged of each of these, evenly spread over those that could be labelled."""
    agreement_frames: int = 64
    """Frames on which the runtimes are compared with each other."""
    timing_s: float = 3.0
    """How long each runtime of each network is timed, twice [s]."""
    runtime: str = "auto"
    """What computes the labels that are judged; auto takes what a user gets."""
    seed: int = 0
    """Draws recordings, objects, scenes, places and noise."""
    length: int | None = None
    """Length of synthetic recordings that have to be made [frames]; the recipe's if not given."""
    workers: int = 2
    """Processes that make recordings."""

    def __post_init__(self) -> None:
        check_bounds(
            self, frames=(1, 10_000), real_recordings=(1, 10_000), real_frames=(1, 10_000),
            agreement_frames=(1, 10_000), timing_s=(0.0, 600.0), seed=(0, 2**31),
            workers=(1, 256),
        )  # fmt: skip
        RuntimeConfig(self.runtime)


def named_weights(given: Sequence[str]) -> dict[str, Path]:
    """Weights files by name from words like `fast_fcn=weights.safetensors`.

    Raises:
        ConfigError: if there is none, a word has another form, or a name comes twice.
    """
    found: dict[str, Path] = {}
    for word in given:
        name, equals, path = word.partition("=")
        if not equals or not path or not re.fullmatch(r"[A-Za-z0-9_.-]+", name):
            raise ConfigError(
                f"weights {word!r}: NAME=FILE is needed, NAME of letters, digits, _.-"
            )
        if name in found:
            raise ConfigError(f"weights {word!r}: the name {name} is taken by {found[name]}")
        found[name] = Path(path)
    if not found:
        raise ConfigError("no weights to measure: at least one NAME=FILE is needed")
    return found
