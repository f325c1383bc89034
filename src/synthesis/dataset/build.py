# SPDX-License-Identifier: Apache-2.0
"""A whole dataset: takes made in parallel; a build that was stopped goes on where it was."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import asdict, dataclass
from multiprocessing import get_context
from multiprocessing.sharedctypes import Synchronized
from pathlib import Path

import kintrack
from kintrack.errors import DatasetError
from kintrack.files import write_json
from synthesis.dataset.record import folder_of, is_recorded, partial_of, record
from synthesis.sensors.catalogue import SENSORS
from synthesis.takes import Take
from synthesis.workers import serve_parent

MANIFEST = "dataset.json"
BYTES_PER_PIXEL = 1.3
"""Depth, colour and labels of a frame on disk, measured on whole rooms [bytes/px]."""
MARGIN = 1.1
"""How much more than estimated must be free."""
POLL_S = 0.5


@dataclass(frozen=True)
class Progress:
    """How far a build is."""

    frames: int
    """Frames done."""
    takes: int
    """Takes done."""


def estimated_bytes(takes: Sequence[Take]) -> int:
    """What takes will need on disk [bytes]."""
    pixels = {name: sensor().camera for name, sensor in SENSORS.items()}
    return int(
        sum(
            take.frames * pixels[take.sensor].width * pixels[take.sensor].height * BYTES_PER_PIXEL
            for take in takes
        )
    )


def pending(root: Path, takes: Sequence[Take]) -> list[Take]:
    """The takes that are not there yet.

    Raises:
        DatasetError: if other takes have their names.
    """
    return [take for take in takes if not is_recorded(root, take)]


def build_dataset(
    root: Path,
    takes: Sequence[Take],
    facts: dict[str, object],
    mocap: Path | None = None,
    workers: int | None = None,
    on_progress: Callable[[Progress], None] = lambda progress: None,
) -> None:
    """Make every take that is not there yet.

    A take appears under its name only when it is whole. The result does not depend on the number
    of workers or on how often the build was stopped.

    Args:
        root: Folder of the dataset; made where missing.
        takes: All takes.
        facts: What the manifest says about them: recipe, seed.
        mocap: Folder of motion capture clips, if takes need it.
        workers: Processes; one per core if None.
        on_progress: Called about twice a second.

    Raises:
        DatasetError: if the folder holds another dataset, the disk is too small or full, or a
            take cannot be made; takes made before are intact.
    """
    todo = _prepare(root, takes, facts)
    for take in todo:
        shutil.rmtree(partial_of(root, take), ignore_errors=True)
    ready = sum(take.frames for take in takes) - sum(take.frames for take in todo)
    count = max(1, min(workers or os.cpu_count() or 1, len(todo)))
    context = get_context("spawn")
    pool = ProcessPoolExecutor(
        count, context, initializer=_start_worker, initargs=(context.Value("i", 0),)
    )
    running: dict[Future[Path], Take] = {}
    waiting, done_frames, done_takes = list(reversed(todo)), ready, len(takes) - len(todo)
    try:
        while waiting or running:
            while waiting and len(running) < count:
                take = waiting.pop()
                running[pool.submit(record, take, root, mocap)] = take
            finished, _ = wait(running, timeout=POLL_S, return_when=FIRST_COMPLETED)
            for future in finished:
                future.result()
                done_frames += running.pop(future).frames
                done_takes += 1
            in_work = sum(_frames_in(partial_of(root, take)) for take in running.values())
            on_progress(Progress(done_frames + in_work, done_takes))
    except BaseException:
        _stop(pool)
        for take in running.values():
            shutil.rmtree(partial_of(root, take), ignore_errors=True)
        raise
    pool.shutdown()


def _prepare(root: Path, takes: Sequence[Take], facts: dict[str, object]) -> list[Take]:
    """Check the folder and the disk, write the manifest, and list what is to be made."""
    try:
        root.mkdir(parents=True, exist_ok=True)
        manifest = root / MANIFEST
        wanted = json.loads(
            json.dumps(
                {
                    "kintrack": kintrack.__version__,
                    **facts,
                    "takes": [asdict(take) for take in takes],
                }
            )
        )
        if manifest.exists():
            there = json.loads(manifest.read_text(encoding="utf-8"))
            if there != wanted:
                raise DatasetError(
                    f"{manifest} describes another dataset "
                    f"({ {name: there.get(name) for name in ('kintrack', *facts)} }); "
                    f"choose another folder"
                )
        elif any(root.iterdir()):
            raise DatasetError(
                f"{root} is not empty and holds no {MANIFEST}; choose another folder"
            )
        todo = pending(root, takes)
        need, free = int(MARGIN * estimated_bytes(todo)), shutil.disk_usage(root).free
        if need > free:
            raise DatasetError(
                f"{root}: {need / 1e9:.1f} GB are needed, {free / 1e9:.1f} GB are free"
            )
        write_json(manifest, wanted)
    except (OSError, ValueError) as error:
        raise DatasetError(f"{root}: cannot be used for a dataset ({error})") from error
    return todo


def _frames_in(partial: Path) -> int:
    """Frames that a take in work has so far."""
    try:
        return max(0, (partial / "depth.txt").read_bytes().count(b"\n") - 1)
    except OSError:
        return 0


def _start_worker(started: Synchronized[int]) -> None:
    """One core each; the ray tracer would start as many threads in each as there are cores."""
    import cv2

    serve_parent()
    cv2.setNumThreads(1)
    with started.get_lock():
        number = started.value
        started.value += 1
    if hasattr(os, "sched_setaffinity"):
        cores = sorted(os.sched_getaffinity(0))
        os.sched_setaffinity(0, {cores[number % len(cores)]})


def _stop(pool: ProcessPoolExecutor) -> None:
    processes = list((pool._processes or {}).values())
    pool.shutdown(wait=False, cancel_futures=True)
    for process in processes:
        process.terminate()
    for process in processes:
        process.join()


def sequences(root: Path) -> list[Path]:
    """Folders of all whole takes of a dataset, in the manifest's order.

    Raises:
        DatasetError: if there is no manifest.
    """
    path = root / MANIFEST
    try:
        takes = [Take(**_tuples(take)) for take in json.loads(path.read_text())["takes"]]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DatasetError(f"{path}: no dataset's manifest ({error})") from error
    return [folder_of(root, take) for take in takes if is_recorded(root, take)]


def _tuples(take: dict) -> dict:
    return {**take, "seed": tuple(take["seed"])}
