# SPDX-License-Identifier: Apache-2.0
"""The accuracy bench: recordings made, changed, tracked by every method, scored.

Two loops: results are kept on disk and scored afterwards, so that a change of the scores runs
nothing again. A stopped bench goes on where it was.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from kintrack.bench import rgb
from kintrack.bench.cases import CLEAN, GAPS, REAL, SCENES, Case
from kintrack.bench.full_scenes import witnessed
from kintrack.bench.methods import GEOMETRY, RGB, Method, Task, methods_of
from kintrack.bench.recordings import AccuracyConfig, Report, Sources, made_cases
from kintrack.bench.running import Fitting, run_all
from kintrack.bench.scores import Errors, errors_of
from kintrack.bench.summary import content_of
from kintrack.errors import ResultError, SequenceError
from kintrack.files import make_result_folder, write_json
from kintrack.result import TRACK_FILE
from kintrack.sequence import open_sequence
from kintrack.sequence.reference import REFERENCE_FILE
from segmentation.weights import load_weights

RESULT_FILE = "accuracy.json"
KINECT = "kinect"
"""The real people against the joints that came with them."""


@dataclass(frozen=True)
class Bench:
    """What a run yields."""

    folder: Path
    """Where everything lies."""
    methods: tuple[Method, ...]
    """What was compared."""
    cases: tuple[Case, ...]
    """The recordings."""
    content: dict[str, Any] = field(repr=False)
    """Of `accuracy.json`."""

    def result_of(self, method: Method, case: Case) -> Path:
        """Result folder of a method on a recording."""
        return result_of(self.folder, method.name, case)


def run_accuracy(
    folder: Path,
    weights: Mapping[str, Path],
    config: AccuracyConfig,
    sources: Sources | None = None,
    on_progress: Report = lambda what, done, total: None,
) -> Bench:
    """Run the bench.

    Args:
        folder: Where recordings, results and scores go.
        weights: Name -> weights file, this project's own first.
        config: What to run.
        sources: Where clips and real recordings lie.
        on_progress: Shown how far it is.

    Returns:
        Everything; the content of `accuracy.json` is written too.

    Raises:
        KintrackError: if a folder or weights cannot be used, or a method is unknown.
    """
    methods = methods_of(weights, config.methods)
    for path in weights.values():
        load_weights(path)
    make_result_folder(folder)
    cases, left_out = made_cases(folder, config, sources or Sources(), on_progress)
    clean = {(c.group, c.name): c for c in cases if c.condition == CLEAN}
    fits = [
        _fitting(folder, method, case, clean, config)
        for method in methods
        for case in cases
        if method.runs_on(case)
    ]
    witness = Method(GEOMETRY, GEOMETRY)
    for case in clean.values():
        if case.group == REAL and witness not in methods:
            fits.append(_fitting(folder, witness, case, clean, config))
    todo = [fit for fit in fits if not fit.is_done()]
    todo, missing = _without_rgb(todo, config)
    if missing:
        methods = tuple(method for method in methods if method.kind != RGB)
        left_out[RGB] = missing
    total = sum(len(open_sequence(fit.task.case.sequence)) for fit in todo)
    failed = run_all(todo, config.workers, lambda done: on_progress("tracking", done, total))
    for fit, problem in failed.items():
        assert isinstance(fit, Fitting)
        raise SequenceError(f"{fit.method.name} on {fit.task.case.sequence}: {problem}")
    content = content_of(
        config.seed,
        {method.name: _scored(folder, method, cases, clean) for method in methods},
        {method.name: _scenes(folder, method, cases) for method in methods},
        left_out,
    )
    write_json(folder / RESULT_FILE, content)
    return Bench(folder, methods, tuple(cases), content)


def result_of(folder: Path, method: str, case: Case) -> Path:
    """Result folder of a method on a case."""
    return folder / "results" / method / case.key


def _fitting(
    folder: Path,
    method: Method,
    case: Case,
    clean: Mapping[tuple[str, str], Case],
    config: AccuracyConfig,
) -> Fitting:
    pixels = folder / "pixels" / case.key / f"{case.fingerprint()[:16]}.csv"
    task = Task(
        case,
        clean[case.group, case.name],
        result_of(folder, method.name, case),
        pixels,
        config.mediapipe,
    )
    return Fitting(method, task)


def _without_rgb(
    todo: Sequence[Fitting], config: AccuracyConfig
) -> tuple[list[Fitting], str | None]:
    """The fits without those that need MediaPipe, and why, if it cannot be had.

    Raises:
        ResultError: if it was asked for by name.
    """
    needed = [f for f in todo if f.method.kind == RGB and not f.task.pixels.is_file()]
    problem = rgb.obstacle(config.mediapipe) if needed else None
    if problem is None:
        return list(todo), None
    if RGB in config.methods:
        raise ResultError(problem)
    return [fit for fit in todo if fit.method.kind != RGB], problem


def _scored(
    folder: Path, method: Method, cases: Sequence[Case], clean: Mapping[tuple[str, str], Case]
) -> list[tuple[str, Errors]]:
    """Every case against its truth, real people against the Kinect's joints too.

    Joints of a synthetic person are exact. For a real one the geometric fit of the clean recording
    counts as true, as in [Wan19].
    """
    out = []
    for case in cases:
        if case.group == SCENES or not method.runs_on(case):
            continue
        found = result_of(folder, method.name, case)
        reference = clean[case.group, case.name].sequence / REFERENCE_FILE
        if case.group != REAL:
            truth = case.sequence if case.condition in GAPS else reference.parent
            out.append((case.group, errors_of(case, found, truth / REFERENCE_FILE)))
            continue
        own = result_of(folder, GEOMETRY, replace(case, condition=CLEAN))
        out.append((case.group, errors_of(case, found, own / TRACK_FILE)))
        if reference.is_file():
            out.append((KINECT, errors_of(case, found, reference)))
    return out


def _scenes(folder: Path, method: Method, cases: Sequence[Case]) -> dict[str, dict[str, Any]]:
    """Every full scene against its witness."""
    return {
        case.name: witnessed(case, result_of(folder, method.name, case))
        for case in cases
        if case.group == SCENES and method.runs_on(case)
    }
