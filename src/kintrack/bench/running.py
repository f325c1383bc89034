# SPDX-License-Identifier: Apache-2.0
"""Many jobs over a few processes, each on one thread; finished ones are kept."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.sharedctypes import Synchronized
from pathlib import Path

from kintrack.bench.cases import Case, make_occluded
from kintrack.bench.digest import code_digest
from kintrack.bench.methods import METHODS, Task
from kintrack.errors import KintrackError
from synthesis.workers import serve_parent

CODE_FILE = "code.sha256"
"""Digest of the code that made a result, written beside it once it is finished."""
POLL_S = 0.5


@dataclass(frozen=True)
class Occlusion:
    """An object to be put into a recording."""

    case: Case
    """What is to be made."""
    clean: Path
    """The recording without it."""
    seed: int
    """Draws it."""

    def run(self) -> None:
        """Make it."""
        make_occluded(self.case, self.clean, self.seed, lambda n: _count())


@dataclass(frozen=True)
class Fitting:
    """A method to be run on a recording."""

    method: str
    """Name of the method."""
    task: Task
    """What it works on."""

    def is_done(self, digest: str) -> bool:
        """Whether the result was made by this code."""
        try:
            return (self.task.result / CODE_FILE).read_text().strip() == digest
        except OSError:
            return False

    def run(self) -> None:
        """Run it."""
        (self.task.result / CODE_FILE).unlink(missing_ok=True)
        METHODS[self.method](self.task, _count)
        (self.task.result / CODE_FILE).write_text(code_digest() + "\n")


Job = Occlusion | Fitting


def run_all(
    jobs: Sequence[Job], workers: int, on_progress: Callable[[int], None]
) -> dict[Job, str]:
    """Run jobs, a few at a time.

    Args:
        jobs: What is to be done.
        workers: Processes.
        on_progress: Called with the frames done about twice a second.

    Returns:
        Job -> why it failed, for those whose input was at fault.
    """
    if not jobs:
        return {}
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"  # inherited by the processes started below
    context = get_context("spawn")
    frames = context.Value("i", 0)
    pool = ProcessPoolExecutor(workers, context, _share, (frames,))
    failed: dict[Job, str] = {}
    try:
        running: dict[Future[None], Job] = {pool.submit(job.run): job for job in jobs}
        left = set(running)
        while left:
            finished, left = wait(left, timeout=POLL_S, return_when=FIRST_COMPLETED)
            for future in finished:
                error = future.exception()
                if isinstance(error, KintrackError):
                    failed[running[future]] = str(error)
                elif error is not None:
                    raise error
            on_progress(frames.value)
    except BaseException:
        processes = list((pool._processes or {}).values())
        pool.shutdown(wait=False, cancel_futures=True)
        for process in processes:
            process.terminate()
        raise
    pool.shutdown()
    return failed


_frames_done: Synchronized[int] | None = None


def _share(frames: Synchronized[int]) -> None:
    """Start of a worker: where it counts frames."""
    global _frames_done
    _frames_done = frames
    serve_parent()


def _count() -> None:
    if _frames_done is not None:
        with _frames_done.get_lock():
            _frames_done.value += 1
