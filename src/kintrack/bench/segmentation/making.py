# SPDX-License-Identifier: Apache-2.0
"""Recordings that the bench makes itself: some frames of longer ones, and objects before people.

Each folder holds `made.txt` once it is whole; what is written there tells whether it still is what
is asked for.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import cast

import numpy as np

import kintrack.labelling
from kintrack.bench import running
from kintrack.bench.cases import REDRAWS, SHARE, pitch_of
from kintrack.bench.digest import code_digest, code_of
from kintrack.bench.inserting import view_of
from kintrack.bench.made import MADE_FILE, finish, is_made, recipe_of
from kintrack.errors import SceneError
from kintrack.geometry import camera_pose
from kintrack.joints import JOINT_NAMES
from kintrack.labelling.sequence import label_sequence
from kintrack.sequence import open_sequence
from kintrack.sequence.folder import open_folder
from kintrack.sequence.occlusion import OCCLUSION_FILE, read_occlusion
from kintrack.sequence.recording import Recording
from kintrack.sequence.reference import read_reference_joints
from kintrack.sequence.write import SequenceWriter
from synthesis.objects.catalogue import held_out_things
from synthesis.occlusion.occlude import OccludeConfig, occlude
from synthesis.occlusion.placing import PlacingConfig


@dataclass(frozen=True)
class Excerpt:
    """Some frames of a recording, evenly spread."""

    source: Path
    """The recording."""
    folder: Path
    """Where the excerpt goes."""
    frames: int
    """How many frames it has at most."""
    labelled: bool
    """Whether the source has labels; if not, the geometric tracker's fit makes them and only
    frames in which they can be trusted are taken."""

    def recipe(self) -> str:
        """What the folder must have been made of."""
        code = "" if self.labelled else _labelling_digest()
        return recipe_of(self.source.resolve(), _index(self.source), self.frames, code)

    def run(self) -> None:
        """Make it."""
        _fresh(self.folder)
        if self.labelled:
            _thin(open_folder(self.source), self.folder, self.frames)
        else:
            whole = self.folder.with_name(f".{self.folder.name}.labelled")
            _fresh(whole)
            try:
                label_sequence(open_folder(self.source), whole)
                _thin(open_folder(whole), self.folder, self.frames)
            finally:
                _fresh(whole)
        finish(self.folder, self.recipe())


@dataclass(frozen=True)
class Composite:
    """A recording with an object before the person, a real scene around her, or both."""

    clean: Path
    """The labelled recording, an `Excerpt`."""
    source: Path
    """What that was taken from; tells how the camera stood."""
    folder: Path
    """Where the composite goes."""
    distance_m: float | None
    """From the object's farthest point to the person's nearest place [m]; None for no object."""
    scenes: Path | None
    """Folder of views of a real room; None for no scene."""
    seed: int
    """Draws object, view, place and noise; distance does not change the draws."""

    def recipe(self) -> str:
        """What the folder must have been made of."""
        made = (self.clean / MADE_FILE).read_text() if (self.clean / MADE_FILE).is_file() else ""
        return recipe_of(made, self.distance_m, self.scenes and self.scenes.name, self.seed)

    def run(self) -> None:
        """Make it; another object or view is drawn where one cannot be placed.

        Raises:
            SceneError: if none of the draws can.
        """
        problem = SceneError(f"{self.clean.name}: nothing to insert")
        for draw in range(REDRAWS):
            rng = np.random.default_rng((self.seed, draw, *self.clean.name.encode()))
            things = held_out_things()
            thing = things[str(rng.choice(sorted(things)))](rng)
            view, seed = rng.random(), int(rng.integers(2**31))
            _fresh(self.folder)
            try:
                occlude(
                    open_sequence(self.clean),
                    self.folder,
                    None if self.distance_m is None else thing,
                    None if self.scenes is None else view_of(self.scenes, view),
                    OccludeConfig(
                        PlacingConfig(distance_m=self.distance_m or 0.45, share=SHARE), seed=seed
                    ),
                    camera_pose(pitch_of(self.source)),
                )
            except SceneError as error:
                problem = error
                continue
            return finish(self.folder, self.recipe())
        shutil.rmtree(self.folder, ignore_errors=True)
        raise problem


Making = Excerpt | Composite


def make_all(
    jobs: Sequence[Making], workers: int, on_progress: Callable[[int, int], None]
) -> dict[Path, str]:
    """Make what is not there yet.

    Args:
        jobs: What is wanted.
        workers: Processes.
        on_progress: Called with folders done and in all.

    Returns:
        Folder -> why it cannot be made.
    """
    todo = [job for job in jobs if not is_made(job.folder, job.recipe())]
    ready = len(jobs) - len(todo)
    for job in todo:
        _fresh(job.folder)

    def show(_: int) -> None:
        whole = sum((job.folder / MADE_FILE).is_file() for job in todo)
        on_progress(ready + whole, len(jobs))

    show(0)
    with _own_environment():
        failed = running.run_all(cast(Sequence[running.Job], todo), workers, show)
    show(0)
    return {cast(Making, job).folder: why for job, why in failed.items()}


@contextmanager
def _own_environment() -> Iterator[None]:
    """Put the environment back afterwards.

    Processes that film are told to use one thread; libraries that are loaded and timed later in
    this one would believe it too.
    """
    before = dict(os.environ)
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


def _thin(recording: Recording, folder: Path, frames: int) -> None:
    joints = recording.reference_joints_path
    names, positions = ((), None) if joints is None else read_reference_joints(joints)
    shares, hidden = _hidden(recording.root / OCCLUSION_FILE)
    writer = SequenceWriter(folder, recording.camera, recording.depth_scale_m, joint_names=names)
    for n in spread(len(recording), frames):
        frame = recording.frame(n)
        if frame.depth_m is None or frame.labels is None:
            continue
        writer.write(
            frame.timestamp_s,
            frame.depth_m,
            color=frame.color,
            labels=frame.labels,
            joint_positions_m=None if positions is None or n >= len(positions) else positions[n],
            hidden_share=float(shares[n]) if n < len(shares) else None,
            hidden_joints=hidden[n] if n < len(shares) else (),
        )


def _hidden(path: Path) -> tuple[Sequence[float], list[list[str]]]:
    """Share of the person that is hidden and names of hidden joints of every frame."""
    if not path.is_file():
        return (), []
    shares, hidden = read_occlusion(path)
    return list(shares), [[JOINT_NAMES[j] for j in np.flatnonzero(row)] for row in hidden]


def spread(count: int, most: int) -> list[int]:
    """At most so many numbers from 0 to count - 1, evenly spread."""
    return [int(n) for n in np.unique(np.linspace(0, count - 1, min(count, most)).round())]


def _index(folder: Path) -> bytes:
    """Tells recordings of one folder and length from each other."""
    sizes = [path.stat().st_size for path in sorted((folder / "depth").glob("*.png"))]
    return (folder / "depth.txt").read_bytes() + str(sizes).encode()


@cache
def _labelling_digest() -> str:
    """Of the code that fits the body and makes labels of it."""
    folder = Path(kintrack.labelling.__file__).parent
    return recipe_of(code_digest(), *map(code_of, sorted(folder.glob("*.py"))))


def _fresh(folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
