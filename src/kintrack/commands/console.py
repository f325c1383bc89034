# SPDX-License-Identifier: Apache-2.0
"""Where commands print, and their progress bars."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)

if TYPE_CHECKING:
    from kintrack.result import FrameResult
    from kintrack.sequence.frame import Frame

console = Console()
errors = Console(stderr=True, soft_wrap=True)


class FitProgress:
    """A bar with frame, speed, residual and status; one line at a time where nobody watches."""

    def __init__(self, total: int):
        self._bar = Progress(
            TextColumn("fitting"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[note]}"),
            TimeRemainingColumn(),
            console=console,
        )
        self._task = self._bar.add_task("fit", total=total, note="")
        self._began = time.perf_counter()
        self._done = 0

    def __enter__(self) -> FitProgress:
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def __call__(self, frame: Frame, result: FrameResult) -> None:
        """Count a frame; one that is fitted again moves the bar back."""
        self._done += 1
        fps = self._done / (time.perf_counter() - self._began)
        note = f"{fps:.0f} fps  {1e3 * result.residual_rms_m:.0f} mm  {result.status}"
        self._bar.update(self._task, completed=frame.index + 1, note=note)


class StepProgress:
    """A bar for work of several steps, each with what is done, what there is, and time left."""

    def __init__(self, unit: str = "frames") -> None:
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn(f"{unit}, left"),
            TimeRemainingColumn(),
            console=console,
        )
        self._tasks: dict[str, TaskID] = {}

    def __enter__(self) -> StepProgress:
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def __call__(self, what: str, done: int, total: int) -> None:
        """Show how far a step is."""
        if what not in self._tasks:
            self._tasks[what] = self._bar.add_task(what, total=total)
        self._bar.update(self._tasks[what], completed=done)
