# SPDX-License-Identifier: Apache-2.0
"""Fit many recordings, a few at a time; what is finished and still valid is not done again."""

from __future__ import annotations

import json
import multiprocessing
import os
import zlib
from collections.abc import Sequence
from concurrent.futures import Future, ProcessPoolExecutor, wait
from dataclasses import asdict, dataclass
from multiprocessing.sharedctypes import Synchronized
from pathlib import Path

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from kintrack import __version__
from kintrack.bench.digest import code_digest
from kintrack.commands.segmenting import Segmentation
from kintrack.config import TrackerConfig
from kintrack.fit import fit_sequence
from kintrack.geometry import camera_pose
from kintrack.result_writer import SUMMARY_FILE
from kintrack.sequence import open_sequence
from segmentation.weights import SHIPPED

CODE_FILE = "code.sha256"
"""Digest of the tracker's code that made a result, written beside it once it is finished."""


@dataclass(frozen=True)
class Job:
    """One recording to fit."""

    sequence: Path
    """Folder of the recording."""
    result: Path
    """Result folder."""
    pitch_deg: float = 0.0
    """How far its camera looks down [deg]."""
    labels: str = "network"
    """What labels the pixels, as of `kintrack fit`."""

    def finished(self, digest: str) -> bool:
        """Whether the result is whole and was made by this code, version and configuration."""
        try:
            summary = json.loads((self.result / SUMMARY_FILE).read_text())
            code = (self.result / CODE_FILE).read_text().strip()
        except (OSError, ValueError):
            return False
        return (
            bool(summary.get("finished"))
            and summary.get("versions", {}).get("kintrack") == __version__
            and _plain(summary.get("config", {})) == json.loads(json.dumps(asdict(TrackerConfig())))
            and summary.get("T_world_camera") == camera_pose(self.pitch_deg).tolist()
            and code == f"{digest} {self.labels}"
        )


def _plain(config: dict[str, object]) -> dict[str, object]:
    """The tracker's configuration without what belongs to labels."""
    return {name: part for name, part in config.items() if name not in ("labelled", "segmenter")}


def fit_all(jobs: Sequence[Job], processes: int, fresh: bool = False) -> dict[Path, str]:
    """Fit every recording whose result is not finished.

    Each process computes on one thread, so that results do not depend on how many run at once.

    Args:
        jobs: The recordings.
        processes: How many run at once, at least 1.
        fresh: Fit them all again.

    Returns:
        Recording -> why its fit broke off, for those that did.
    """
    digest = f"{code_digest()} {zlib.crc32(SHIPPED.read_bytes()):08x}"
    todo = [job for job in jobs if fresh or not job.finished(digest)]
    if len(todo) < len(jobs):
        print(f"{len(jobs) - len(todo)} of {len(jobs)} recordings are fitted already")
    if not todo:
        return {}
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"  # inherited by the processes started below
    context = multiprocessing.get_context("spawn")
    frames_done = context.Value("i", 0)
    pool = ProcessPoolExecutor(processes, context, _share, (frames_done,))
    try:
        futures = {pool.submit(_fit, job, digest): job for job in todo}
        total = sum(len(open_sequence(job.sequence)) for job in todo)
        _watch(list(futures), frames_done, total)
        return {
            job.sequence: f"{type(error).__name__}: {error}"
            for future, job in futures.items()
            if (error := future.exception()) is not None
        }
    except KeyboardInterrupt:
        for child in multiprocessing.active_children():
            child.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


_frames_done: Synchronized[int] | None = None


def _share(frames_done: Synchronized[int]) -> None:
    """Start of a worker: where it counts frames."""
    global _frames_done
    _frames_done = frames_done


def _fit(job: Job, digest: str) -> None:
    """Fit one recording inside a worker."""

    def count(frame: object, result: object) -> None:
        if _frames_done is not None:
            with _frames_done.get_lock():
                _frames_done.value += 1

    code = job.result / CODE_FILE
    for left_over in (code, *job.result.glob(".*.part")):
        left_over.unlink(missing_ok=True)
    T_world_camera = camera_pose(job.pitch_deg)
    segmenter = Segmentation(job.labels).segmenter()
    sequence = open_sequence(job.sequence)
    fit_sequence(sequence, job.result, None, None, None, T_world_camera, count, None, segmenter)
    code.write_text(f"{digest} {job.labels}\n")


def _watch(futures: list[Future[None]], frames_done: Synchronized[int], total: int) -> None:
    """Show frames done and the time left until every future is."""
    with Progress(
        TextColumn("fitting"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("frames, left"),
        TimeRemainingColumn(),
    ) as bar:
        task = bar.add_task("fit", total=total)
        left = set(futures)
        while left:
            left = wait(left, timeout=0.5).not_done
            bar.update(task, completed=frames_done.value)
