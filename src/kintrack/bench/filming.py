# SPDX-License-Identifier: Apache-2.0
"""How many frames a second the data engine makes, noise, colour and writing included."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from kintrack.errors import ConfigError
from synthesis.dataset.build import Progress, build_dataset
from synthesis.dataset.recipes import takes_of
from synthesis.takes import Take


@dataclass(frozen=True)
class FilmingConfig:
    """What is timed."""

    frames: int = 300
    """Frames of every take."""
    takes: int = 2
    """Takes of each kind."""
    workers: int = 2
    """Processes."""
    seed: int = 0
    """Draws the takes."""

    def __post_init__(self) -> None:
        for name in ("frames", "takes", "workers"):
            if getattr(self, name) < 1:
                raise ConfigError(f"{name} = {getattr(self, name)}: at least 1 is needed")


def run_filming(
    config: FilmingConfig, on_progress: Callable[[str, int, int], None] = lambda *_: None
) -> dict[str, Any]:
    """Make takes of rooms at 512 x 424 and time them, with a still and with a moving camera.

    The time runs from the first finished frame on, so that starting processes and compiling do
    not count, whereas drawing people and rooms does.

    Args:
        config: How many frames and processes.
        on_progress: Shown how far it is.

    Returns:
        Frames per second by kind, and bytes per frame.
    """
    found: dict[str, Any] = {}
    for kind, moving in (("still camera", False), ("moving camera", True)):
        takes = [
            replace(take, frames=config.frames, moving_camera=moving)
            for take in takes_of("paper", config.seed, None, config.frames)[: config.takes]
        ]
        with tempfile.TemporaryDirectory() as folder:
            times = _build(Path(folder) / "set", takes, config.workers, kind, on_progress)
            size = sum(path.stat().st_size for path in Path(folder).rglob("*"))
        seconds, frames = np.array(times).T
        first = int(np.argmax(frames > 0))
        found[kind] = {
            "frames_per_second": float(
                (frames[-1] - frames[first]) / (seconds[-1] - seconds[first])
            ),
            "bytes_per_frame": size / sum(take.frames for take in takes),
        }
    return found


def _build(
    folder: Path,
    takes: list[Take],
    workers: int,
    kind: str,
    on_progress: Callable[[str, int, int], None],
) -> list[tuple[float, int]]:
    """Make the takes; (time [s], frames done) through the build."""
    total = sum(take.frames for take in takes)
    times: list[tuple[float, int]] = []

    def note(progress: Progress) -> None:
        times.append((time.perf_counter(), progress.frames))
        on_progress(f"filming, {kind}", progress.frames, total)

    build_dataset(folder, takes, {"recipe": "filming"}, None, workers, note)
    return times
