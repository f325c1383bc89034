# SPDX-License-Identifier: Apache-2.0
"""What a body of one's own buys: average adult, template, calibrated, deformable; docs/results.md.

Films dressed synthetic people one by one (Kinect v2, nobody and nothing else in view but what they
use), fits each with every kind of body, once with true labels and once with the network that
ships, and compares joints, surface, height and limbs with the truth. Real recordings have no truth:
heights of the same person from different recordings are compared with each other.

    python tests/benchmarks/shape.py                      # held-out people, docs/results.md
    python tests/benchmarks/shape.py --people training    # for development; docs/ is left alone
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
import report
from command import OUT, parser, refuse_quick_baseline, run
from shape_figure import draw
from shape_scoring import Row, joint_error_m, lengths_of, tracked, true_lengths
from shape_tables import real_tables, synthetic_tables, targets

from kintrack.bench.cases import pitch_of
from kintrack.calibration.config import BodyKind
from kintrack.calibration.errors import CalibrationError
from kintrack.calibration.recording import calibrate_recording
from kintrack.commands.segmenting import Segmentation
from kintrack.config import StartConfig, TrackerConfig
from kintrack.files import make_result_folder, write_json
from kintrack.fit import load_person
from kintrack.geometry import camera_pose
from kintrack.result import TRACK_FILE, Track
from kintrack.segmenter import Segmenter
from kintrack.sequence import open_sequence
from synthesis.dataset.recipes import (
    HELD_OUT_ACTIONS,
    held_out_clips,
    held_out_people,
    training_actions,
    training_people,
)
from synthesis.dataset.record import folder_of, is_recorded, record
from synthesis.takes import Take

GROUP = "shape"
FRAMES, STRIDE = 60, 3
"""Six seconds of every authored action, two of every clip."""
PEOPLE = {"held-out": 16, "training": 24}
"""How many are filmed."""
REAL_ACTIONS = ("a03", "a22", "a27")
"""Recordings of UTD-MHAD that are fitted, of each of its people."""
BODIES: tuple[BodyKind, ...] = ("template", "calibrated", "deformable")
"""Values of `kintrack fit --body`."""
UNSIZED = TrackerConfig(start=StartConfig(shape_coefficients=0))
"""The average adult as he is."""


@dataclass(frozen=True)
class Job:
    """One recording with labels of one kind."""

    folder: Path
    """Where recordings and results go."""
    labels: Literal["network", "recording", "none"]
    """As of `kintrack fit`."""
    take: Take | None = None
    """A synthetic recording, filmed where it is missing."""
    real: Path | None = None
    """A real recording."""
    mocap: Path = Path()
    """Folder of motion capture clips."""


def main() -> int:
    """Film, fit, score, write."""
    arguments = _arguments()
    refuse_quick_baseline(arguments)
    folder = make_result_folder(OUT / GROUP)
    jobs = _jobs(arguments, folder)
    rows = _run(jobs, arguments.jobs)
    made_up = [row for row in rows if np.isfinite(row.height_m)]
    real = [row for row in rows if not np.isfinite(row.height_m)]
    text = f"{targets(rows)}\n\n{synthetic_tables(made_up)}"
    text += "\n\n" + real_tables(real) if real else ""
    print(text)
    write_json(folder / f"{arguments.people}.json", {"rows": [asdict(row) for row in rows]})
    if arguments.people == "held-out" and not arguments.quick:
        facts = report.conditions(
            data=f"{PEOPLE['held-out']} held-out people of `synthesis.people`, held-out actions "
            f"and clips, Kinect v2; UTD-MHAD {', '.join(REAL_ACTIONS)}",
            seeds="78 for people; (5, 1, n) for recording n",
        )
        body = f"## A body of one's own\n\n{text}\n\n{report.bullets(facts)}"
        report.rewrite_section(report.RESULTS, GROUP, body)
    return 0


def _arguments() -> argparse.Namespace:
    made = parser(__doc__)
    made.add_argument("--people", choices=list(PEOPLE), default="held-out")
    made.add_argument("--jobs", type=int, default=2, help="recordings at once")
    return made.parse_args()


def _jobs(arguments: argparse.Namespace, folder: Path) -> list[Job]:
    mocap = arguments.data / "mocap"
    filmed = takes(arguments.people, PEOPLE[arguments.people], mocap)
    found = sorted((arguments.data / "utd_mhad").glob("a??_s?_t?"))
    real = [path for path in found if path.name.split("_")[0] in REAL_ACTIONS]
    if arguments.quick:
        filmed, real = filmed[:2], real[:1]
    jobs = []
    for take in filmed:
        jobs.append(Job(folder, "recording", take=take, mocap=mocap))
        jobs.append(Job(folder, "network", take=take, mocap=mocap))
    if arguments.people == "held-out":
        jobs += [Job(folder, "none", real=path) for path in real]
    return jobs


def takes(people: str, count: int, mocap: Path) -> list[Take]:
    """Who does what: each person once, actions in turn."""
    held_out = people == "held-out"
    unseen = [*HELD_OUT_ACTIONS, *held_out_clips(mocap, FRAMES)]
    actions = unseen if held_out else list(training_actions())
    rng = np.random.default_rng(78 if held_out else 77)
    who = rng.choice(held_out_people() if held_out else training_people(), count, replace=False)
    out = []
    for n, person in enumerate(who):
        action = actions[n % len(actions)]
        out.append(
            Take(
                name=f"{n:02d}_{action}",
                part=people,
                seed=(5, int(held_out), n),
                person=int(person),
                action=action,
                sensor="kinect_v2",
                frames=FRAMES,
                stride=1 if action.startswith("cmu") else STRIDE,
                room=False,
                facing=True,
                held_out_things=held_out,
            )
        )
    return out


def _run(jobs: Sequence[Job], processes: int) -> list[Row]:
    """All rows, in the order of the jobs."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"  # inherited by the processes started below
    context = multiprocessing.get_context("spawn")
    rows: dict[int, list[Row]] = {}
    with ProcessPoolExecutor(processes, context) as pool:
        filmed = [pool.submit(film, job) for job in jobs if job.labels == "recording"]
        for made in as_completed(filmed):
            made.result()
        futures = {pool.submit(score, job): n for n, job in enumerate(jobs)}
        for future in as_completed(futures):
            found = future.result()
            rows[futures[future]] = found
            said = ", ".join(
                f"{row.body} {100 * row.joints_m:.2f} cm ({row.used})" for row in found
            )
            print(f"{found[0].name} {found[0].labels}: {said}", flush=True)
    return [row for n in sorted(rows) for row in rows[n]]


def film(job: Job) -> None:
    """Make a synthetic recording where it is missing."""
    assert job.take is not None
    if not is_recorded(job.folder, job.take):
        record(job.take, job.folder, job.mocap)


def score(job: Job) -> list[Row]:
    """Fit a recording with every kind of body."""
    path = folder_of(job.folder, job.take) if job.take is not None else job.real
    assert path is not None
    sequence, segmenter = open_sequence(path), Segmentation(job.labels).segmenter()
    T = camera_pose(pitch_of(path) if job.take is not None else 0.0)
    results = job.folder / "results" / path.name / job.labels
    rows = []

    def fitted(name: str, body: BodyKind, config: TrackerConfig | None = None, person=None) -> None:
        track, surface_m, said = tracked(
            sequence, results / name, body, segmenter, T, person, config
        )
        tall, limbs = lengths_of(said)
        row = Row(
            name=path.name,
            labels=job.labels,
            body=name,
            used=said["used"],
            joints_m=joint_error_m(track, path),
            tracked=float(np.mean(track.status == "tracking")),
            surface_m=surface_m,
            height=tall,
            limbs=limbs,
        )
        if job.take is not None:
            height_m, limbs_m = true_lengths(path)
            row = replace(row, height_m=height_m, limbs_m=limbs_m)
        rows.append(row)

    fitted("average", "template", UNSIZED)
    for body in BODIES:
        fitted(body, body)
    if job.take is not None:
        _whole(fitted, sequence, results, segmenter, T)
        if job.labels == "recording":
            shown = [results / name for name in ("average", "template", "calibrated")]
            picture = job.folder / "pictures" / f"{path.name}.png"
            draw(sequence.frame(len(sequence) // 2), shown, T, picture)
    return rows


def _whole(fitted, sequence, results: Path, segmenter: Segmenter | None, T: np.ndarray) -> None:
    """As `kintrack calibrate` and `kintrack fit --person` do."""
    human, _ = load_person(results / "template")
    track = Track.load(results / "template" / TRACK_FILE)
    try:
        person = calibrate_recording(sequence, track, human, T, segmenter)
    except CalibrationError as error:
        print(f"{sequence.name}: {error}", flush=True)
        return
    fitted("whole", "calibrated", None, person)


if __name__ == "__main__":
    run(main)
