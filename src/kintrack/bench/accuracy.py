# SPDX-License-Identifier: Apache-2.0
"""The accuracy bench: recordings made, occluded, tracked by every method, scored.

Two loops: results are kept on disk and scored afterwards, so that a change of the scores runs
nothing again. A stopped bench goes on where it was.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from kintrack.bench.cases import DISTANCES_M, Case, cases_of, thing_of
from kintrack.bench.digest import code_digest
from kintrack.bench.methods import METHODS, Task
from kintrack.bench.running import Fitting, Job, Occlusion, run_all
from kintrack.bench.scores import Errors, errors_of, summary
from kintrack.errors import ConfigError, SequenceError
from kintrack.evaluate import REFERENCE_FILE
from kintrack.result import TRACK_FILE, make_result_folder, write_json
from kintrack.sequence import open_sequence
from synthesis.dataset.build import build_dataset, sequences
from synthesis.dataset.recipes import takes_of
from synthesis.occlusion.occlude import FACTS_FILE

RESULT_FILE = "accuracy.json"
GROUPS = ("alone", "room", "real")
"""Synthetic people with nothing around them, the same in rooms, real recordings."""
KINECT = "kinect"
"""The real recordings against the joints that came with them."""


@dataclass(frozen=True)
class AccuracyConfig:
    """What the bench runs."""

    methods: tuple[str, ...] = ("geometry",)
    """Methods to compare."""
    groups: tuple[str, ...] = GROUPS
    """Groups of recordings: synthetic ones with nothing around, the same in rooms, real ones."""
    seed: int = 0
    """Draws people, motions, rooms, objects and noise."""
    frames: int | None = None
    """Frames of every synthetic recording; the recipe's own length if not given."""
    workers: int = 2
    """Processes."""

    def __post_init__(self) -> None:
        for name, known in (("methods", tuple(METHODS)), ("groups", GROUPS)):
            given = getattr(self, name)
            if not given or set(given) - set(known):
                raise ConfigError(f"{name} {given!r}: allowed are {', '.join(known)}")
        if self.workers < 1:
            raise ConfigError(f"workers = {self.workers}: at least 1 is needed")


Report = Callable[[str, int, int], None]
"""Called with what is going on, frames done, and frames in total."""


def run_accuracy(
    folder: Path,
    config: AccuracyConfig,
    mocap: Path | None = None,
    real: Path | None = None,
    on_progress: Report = lambda what, done, total: None,
) -> dict[str, Any]:
    """Run the bench.

    Args:
        folder: Where recordings, results and scores go.
        config: What to run.
        mocap: Folder of motion capture clips; authored motions only if None.
        real: Folder of real recordings without background; synthetic people only if None.
        on_progress: Shown how far it is.

    Returns:
        The content of `accuracy.json`, which is written too.

    Raises:
        KintrackError: if a folder cannot be used or a recording cannot be made.
    """
    make_result_folder(folder)
    recordings = _recordings(folder, config, mocap, real, on_progress)
    cases = [
        case
        for group, paths in recordings.items()
        for case in cases_of(group, paths, folder / "occluded")
    ]
    clean = {(c.group, c.name): c.sequence for c in cases if c.distance_m is None}
    inserting = [
        Occlusion(c, clean[c.group, c.name], config.seed)
        for c in cases
        if c.distance_m is not None and not (c.sequence / FACTS_FILE).is_file()
    ]
    failed = _run("inserting objects", inserting, clean_of(inserting), config, on_progress)
    for case in failed:
        shutil.rmtree(case.sequence, ignore_errors=True)
    cases = [case for case in cases if case not in failed]
    digest = code_digest()
    fits = [
        Fitting(
            method,
            Task(
                case.sequence,
                clean[case.group, case.name],
                case.pitch_deg,
                result_of(folder, method, case),
            ),
        )
        for method in config.methods
        for case in cases
    ]
    todo = [fit for fit in fits if not fit.is_done(digest)]
    _run("tracking", todo, [fit.task.sequence for fit in todo], config, on_progress)
    errors = {method: list(_scored(folder, method, cases, clean)) for method in config.methods}
    content = _content(config, errors, failed)
    write_json(folder / RESULT_FILE, content)
    return content


def result_of(folder: Path, method: str, case: Case) -> Path:
    """Result folder of a case."""
    return folder / "results" / method / case.key


def clean_of(jobs: Sequence[Occlusion]) -> list[Path]:
    """Recordings that objects go into."""
    return [job.clean for job in jobs]


def _recordings(folder, config, mocap, real, on_progress) -> dict[str, list[Path]]:
    """Clean recordings by group; synthetic ones are made where they are missing."""
    takes = [
        take
        for take in takes_of("bench", config.seed, mocap, config.frames)
        if take.part in config.groups
    ]
    root = folder / "recordings"
    total = sum(take.frames for take in takes)
    by_group: dict[str, list[Path]] = {group: [] for group in GROUPS}
    if takes:
        build_dataset(
            root,
            takes,
            {"recipe": "bench", "seed": config.seed},
            mocap,
            config.workers,
            lambda progress: on_progress("filming", progress.frames, total),
        )
        for path in sequences(root):
            by_group[path.parent.name].append(path)
    if real is not None and "real" in config.groups:
        by_group["real"] = sorted(p for p in real.iterdir() if (p / "depth.txt").is_file())
        if not by_group["real"]:
            raise SequenceError(
                f"{real}: no recordings there; a folder of sequence folders is needed"
            )
    return by_group


def _run(
    what: str, jobs: Sequence[Job], sequences_of: Sequence[Path], config, on_progress: Report
) -> dict[Case, str]:
    """Run jobs with progress; cases whose object could not be placed, and why."""
    total = sum(len(open_sequence(path)) for path in sequences_of)
    failed = run_all(jobs, config.workers, lambda done: on_progress(what, done, total))
    for job, problem in failed.items():
        if isinstance(job, Fitting):
            raise SequenceError(f"{job.task.sequence}: {problem}")
    return {job.case: problem for job, problem in failed.items() if isinstance(job, Occlusion)}


def _scored(
    folder: Path, method: str, cases: Sequence[Case], clean: dict[tuple[str, str], Path]
) -> Iterator[Errors]:
    """Every case against its truth, real ones against the Kinect's joints too.

    Joints of a synthetic person are exact. For a real one the geometric fit of the clean recording
    counts as true, as in [Wan19].
    """
    for case in cases:
        found = result_of(folder, method, case)
        reference = clean[case.group, case.name] / REFERENCE_FILE
        if case.group != "real":
            yield errors_of(case, found, reference)
            continue
        own = result_of(folder, "geometry", replace(case, distance_m=None))
        yield errors_of(case, found, own / TRACK_FILE)
        if reference.is_file():
            yield errors_of(replace(case, group=KINECT), found, reference)


def _content(
    config: AccuracyConfig, errors: dict[str, list[Errors]], failed: dict[Case, str]
) -> dict[str, Any]:
    conditions = ("clean", *(f"{100 * d:.0f} cm" for d in DISTANCES_M))
    scores: dict[str, Any] = {}
    for method, found in errors.items():
        for group in (*GROUPS, KINECT):
            for condition in conditions:
                chosen = [
                    e for e in found if e.case.group == group and e.case.condition == condition
                ]
                if chosen:
                    scores.setdefault(method, {}).setdefault(group, {})[condition] = summary(
                        chosen
                    ) | {
                        "sequences": {
                            e.case.name: _short(summary([e])) | {"object": thing_of(e.case)}
                            for e in chosen
                        }
                    }
    return {
        "seed": config.seed,
        "scores": scores,
        "not_made": {case.key: problem for case, problem in failed.items()},
    }


def _short(whole: dict[str, Any]) -> dict[str, Any]:
    """A recording's summary without curves and single joints."""
    return {
        "frames": whole["frames"],
        "tracking": whole["tracking"],
        "hidden_share": whole["hidden_share"],
        **{
            part: {key: whole[part][key] for key in ("mean_m", "p95_m", "posed")}
            for part in ("all", "visible", "hidden")
        },
    }
