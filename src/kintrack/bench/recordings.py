# SPDX-License-Identifier: Apache-2.0
"""Which recordings the accuracy bench runs, and where they come from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kintrack.bench.cases import (
    ALONE,
    CLEAN,
    FULL_SCENES,
    GAPS,
    GROUPS,
    OBJECTS,
    REAL,
    ROOM,
    SCENE,
    SCENES,
    Case,
    cases_of,
)
from kintrack.bench.full_scenes import PIXELS_FILE
from kintrack.bench.gaps import Gap
from kintrack.bench.inserting import Insertion
from kintrack.bench.running import Making, run_all
from kintrack.bounds import check_bounds
from kintrack.errors import ConfigError, SequenceError
from kintrack.sequence import open_sequence
from synthesis.dataset.build import build_dataset, sequences
from synthesis.dataset.recipes import takes_of

UTD, KITCHEN = "utd_mhad", "scenes/redkitchen"
"""Real people without background, and the real room they are put into."""

Report = Callable[[str, int, int], None]
"""Called with what is going on, frames done, and frames in total."""


@dataclass(frozen=True)
class AccuracyConfig:
    """What the bench runs."""

    methods: tuple[str, ...] = ()
    """Methods to compare; all if none is named."""
    groups: tuple[str, ...] = GROUPS
    """Groups of recordings: synthetic people alone, the same in rooms, real people put into a real
    room, full scenes."""
    recordings: int = 8
    """Synthetic recordings of each group."""
    real_recordings: int = 10
    """Recordings of real people that are put into the room, evenly spread over those there are."""
    frames: int = 100
    """Frames of every synthetic recording, at 30 Hz."""
    seed: int = 0
    """Draws people, motions, rooms, objects and noise."""
    mediapipe: Path | None = None
    """Python interpreter that has MediaPipe, for the RGB regression; this one if not given."""
    workers: int = 2
    """Processes."""

    def __post_init__(self) -> None:
        if not self.groups or set(self.groups) - set(GROUPS):
            raise ConfigError(f"groups {self.groups!r}: allowed are {', '.join(GROUPS)}")
        check_bounds(
            self,
            recordings=(1, 8),
            real_recordings=(1, 10_000),
            frames=(1, 100_000),
            workers=(1, 256),
        )


@dataclass(frozen=True)
class Sources:
    """Where things lie that the bench cannot make."""

    mocap: Path | None = None
    """Folder of motion capture clips; authored motions only if None."""
    data: Path | None = None
    """Folder of the real recordings (utd_mhad, scenes, bonn_tablet, bonn_three, sofa, uva_turn);
    synthetic people only if None."""


def made_cases(
    folder: Path, config: AccuracyConfig, sources: Sources, on_progress: Report
) -> tuple[list[Case], dict[str, str]]:
    """All cases; those that are missing are made.

    Returns:
        The cases, and why some could not be made, by their keys.

    Raises:
        KintrackError: if a folder holds no recordings.
    """
    recordings = _synthetic(folder, config, sources.mocap, on_progress)
    if sources.data is not None:
        recordings |= _real(sources.data, config)
    cases: list[Case] = []
    jobs: list[Making] = []
    for group, paths in recordings.items():
        found = cases_of(group, paths, folder / "made", _conditions(group))
        cases += found
        clean = {case.name: case for case in found if case.condition == CLEAN}
        scenes = sources.data / KITCHEN if group == REAL and sources.data else None
        for case in found:
            if case.condition in GAPS:
                jobs.append(Making(Gap(case, clean[case.name], config.seed)))
            elif case.condition != CLEAN:
                jobs.append(Making(Insertion(case, clean[case.name], config.seed, scenes)))
    todo = [job for job in jobs if not job.what.is_made()]
    total = sum(len(open_sequence(job.what.clean.sequence)) for job in todo)
    failed = run_all(
        todo, config.workers, lambda done: on_progress("objects and scenes", done, total)
    )
    left_out = {
        job.what.case.key: problem for job, problem in failed.items() if isinstance(job, Making)
    }
    return [case for case in cases if case.key not in left_out], left_out


def _conditions(group: str) -> tuple[str, ...]:
    return {
        ALONE: (CLEAN, *OBJECTS),
        ROOM: (CLEAN, *OBJECTS, *GAPS),
        REAL: (CLEAN, SCENE, *OBJECTS),
        SCENES: (CLEAN,),
    }[group]


def _synthetic(
    folder: Path, config: AccuracyConfig, mocap: Path | None, on_progress: Report
) -> dict[str, list[Path]]:
    """Clean synthetic recordings by group, made where they are missing."""
    parts = [group for group in (ALONE, ROOM) if group in config.groups]
    takes = [
        take
        for take in takes_of("bench", config.seed, mocap, config.frames)
        if take.part in parts and int(take.name.partition("_")[0]) < config.recordings
    ]
    if not takes:
        return {}
    root = folder / "recordings"
    total = sum(take.frames for take in takes)
    build_dataset(
        root,
        takes,
        {"recipe": "bench", "seed": config.seed},
        mocap,
        config.workers,
        lambda progress: on_progress("filming", progress.frames, total),
    )
    found = sequences(root)
    return {part: [path for path in found if path.parent.name == part] for part in parts}


def _real(data: Path, config: AccuracyConfig) -> dict[str, list[Path]]:
    """Real recordings by group."""
    found: dict[str, list[Path]] = {}
    if REAL in config.groups:
        people = sorted(path.parent for path in (data / UTD).glob("*/depth.txt"))
        if not people:
            raise SequenceError(f"{data / UTD}: no recordings there; a folder of sequence folders "
                                "is needed")  # fmt: skip
        found[REAL] = _spread(people, config.real_recordings)
    if SCENES in config.groups:
        found[SCENES] = [
            data / name for name in FULL_SCENES if (data / name / PIXELS_FILE).is_file()
        ]
        if not found[SCENES]:
            raise SequenceError(f"{data}: no recordings there; at least one of "
                                f"{', '.join(FULL_SCENES)} is needed")  # fmt: skip
    return found


def _spread(paths: Sequence[Path], most: int) -> list[Path]:
    numbers = np.linspace(0, len(paths) - 1, min(len(paths), most)).round()
    return [paths[int(n)] for n in np.unique(numbers)]
