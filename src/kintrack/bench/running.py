# SPDX-License-Identifier: Apache-2.0
"""Many jobs over a few processes, each on one thread; finished ones are kept."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.sharedctypes import Synchronized
from typing import Protocol

from kintrack.bench.digest import result_digest
from kintrack.bench.gaps import Gap
from kintrack.bench.inserting import Insertion
from kintrack.bench.methods import RGB, Method, Task, run_method
from kintrack.errors import KintrackError
from synthesis.workers import serve_parent

CODE_FILE = "code.sha256"
"""Digest of what made a result, written beside it once it is finished."""
POLL_S = 0.5


class Job(Protocol):
    """Something to be done in a process of its own."""

    def run(self) -> None:
        """Do it."""
        ...


@dataclass(frozen=True)
class Making:
    """A recording to be made."""

    what: Insertion | Gap
    """From what, and how."""

    def run(self) -> None:
        """Make it."""
        self.what.run(_count)


@dataclass(frozen=True)
class Fitting:
    """A method to be run on a recording."""

    method: Method
    """The method."""
    task: Task
    """What it works on."""

    def digest(self) -> str:
        """Tells whether a kept result is still valid."""
        method, task = self.method, self.task
        recordings = (task.case.fingerprint(), "" if method.cold else task.clean.fingerprint())
        how = (method.cold, method.targets, method.calibrated, method.soft)
        return result_digest(method.kind == RGB, method.weights, how, recordings)

    def is_done(self) -> bool:
        """Whether the result was made by this code from these recordings and weights."""
        try:
            return (self.task.result / CODE_FILE).read_text().strip() == self.digest()
        except OSError:
            return False

    def run(self) -> None:
        """Run it."""
        digest = self.digest()
        (self.task.result / CODE_FILE).unlink(missing_ok=True)
        run_method(self.method, self.task, _count)
        (self.task.result / CODE_FILE).write_text(digest + "\n")


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
    context = get_context("spawn")
    frames = context.Value("i", 0)
    failed: dict[Job, str] = {}
    with one_thread_for_children():
        pool = ProcessPoolExecutor(workers, context, _share, (frames,))
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


@contextmanager
def one_thread_for_children() -> Iterator[None]:
    """Processes started meanwhile use one thread each; afterwards the environment is as before.

    Libraries that this process loads later would take the setting for their own.
    """
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    before = {name: os.environ.get(name) for name in names}
    os.environ.update(dict.fromkeys(names, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


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
