# SPDX-License-Identifier: Apache-2.0
"""Time the tracker, stage by stage, over a recording that is read while it runs."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from itertools import islice

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.export.overlay import upscaled
from kintrack.segmenter import Segmenter
from kintrack.sequence import Frame
from kintrack.tracker import Tracker

STAGES = ("observe", "skin", "associate", "solve", "report", "rival")
"""Stages of a frame that is tracked, in order; "observe" contains prediction and labels, "rival"
the wait for rivals, who run beside the other stages and slow them."""


@dataclass
class StageClock:
    """Adds up the time between calls under the name of the stage that just ended."""

    spent_ms: dict[str, float] = field(default_factory=dict)
    """Stage -> time in the present frame [ms]."""
    last_s: float = 0.0
    """When the last stage ended [s]."""

    def begin(self) -> None:
        """Start a frame."""
        self.spent_ms, self.last_s = {}, time.perf_counter()

    def __call__(self, stage: str) -> None:
        now = time.perf_counter()
        self.spent_ms[stage] = self.spent_ms.get(stage, 0.0) + 1e3 * (now - self.last_s)
        self.last_s = now


@dataclass(frozen=True)
class Timing:
    """One recording, run one or more times; F tracked frames, S starts."""

    name: str
    """What was run."""
    frames_ms: Float[ndarray, " f"]
    """Whole frames after the start, reading left out [ms], shape (F,)."""
    stages_ms: dict[str, Float[ndarray, " f"]]
    """Stage -> its share of each of these frames [ms], shape (F,)."""
    starts_ms: Float[ndarray, " s"]
    """Frames in which the tracker looked for the person [ms], shape (S,)."""
    statuses: dict[str, int]
    """Status -> frames."""
    cores_used: float
    """Processor time over wall time within the tracker."""


def median_p95(values: Float[ndarray, " n"]) -> tuple[float, float]:
    """Median and 95th percentile; NaN if there are no values."""
    if len(values) == 0:
        return float("nan"), float("nan")
    return float(np.median(values)), float(np.percentile(values, 95))


def time_tracker(
    name: str,
    recording: Iterable[Frame],
    passes: int,
    limit: int | None = None,
    segmenter: Segmenter | None = None,
) -> Timing:
    """Track a recording a few times, each time with a new tracker.

    Args:
        name: For the tables.
        recording: Iterated once a pass.
        passes: How many times.
        limit: Frames a pass; None for all.
        segmenter: Labels every frame; None for the geometry alone.

    Returns:
        The times of all passes.
    """
    frames_ms: list[float] = []
    starts_ms: list[float] = []
    stages: dict[str, list[float]] = {stage: [] for stage in STAGES}
    statuses: Counter[str] = Counter()
    wall_s, processor_s = 0.0, 0.0
    for _ in range(passes):
        clock = StageClock()
        tracker = Tracker(clock=clock, segmenter=segmenter)
        for frame in islice(recording, limit):
            starting = tracker.belief is None
            began, processor = time.perf_counter(), time.process_time()
            clock.begin()
            result = tracker.step(frame)
            took_s = time.perf_counter() - began
            wall_s += took_s
            processor_s += time.process_time() - processor
            statuses[result.status] += 1
            if result.status == "skipped":
                continue
            if starting:
                starts_ms.append(1e3 * took_s)
                continue
            frames_ms.append(1e3 * took_s)
            for stage in STAGES:
                stages[stage].append(clock.spent_ms.get(stage, 0.0))
    return Timing(
        name=name,
        frames_ms=np.array(frames_ms),
        stages_ms={stage: np.array(values) for stage, values in stages.items()},
        starts_ms=np.array(starts_ms),
        statuses=dict(statuses),
        cores_used=processor_s / max(wall_s, 1e-9),
    )


@dataclass(frozen=True)
class Doubled:
    """A recording whose every pixel became 2 x 2 pixels."""

    recording: Iterable[Frame]
    """The recording."""

    def __iter__(self) -> Iterator[Frame]:
        """Its frames, twice as wide and high."""
        for frame in self.recording:
            depth_m = frame.depth_m
            if depth_m is not None:
                depth_m = depth_m.repeat(2, axis=0).repeat(2, axis=1)
            yield replace(
                frame, camera=upscaled(frame.camera, 2), depth_m=depth_m, color=None, labels=None
            )
