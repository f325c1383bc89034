# SPDX-License-Identifier: Apache-2.0
"""`kintrack fit`."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Literal

import tyro

from kintrack.calibration.person import read_person
from kintrack.commands.console import FitProgress, console
from kintrack.commands.recording import Recording
from kintrack.commands.segmenting import Segmentation
from kintrack.commands.view import live_viewer
from kintrack.config import TrackerConfig
from kintrack.fit import RESULT_FOLDER, Outputs, fit_sequence
from kintrack.geometry import camera_pose
from kintrack.person import LabelledConfig
from kintrack.result import TRACK_FILE, Track
from kintrack.viewer import NullViewer


@dataclass(frozen=True)
class Fit:
    """Fit the body to every frame of a recording."""

    sequence: tyro.conf.Positional[Path]
    """Folder of the recording."""
    output: Path | None = None
    """Result folder; SEQUENCE/kintrack if not given."""
    video: Path | None = None
    """Also write an overlay video (mp4) here."""
    html: Path | None = None
    """Also write a page with the moving body and the points here."""
    view: bool = False
    """Watch live in a browser."""
    person: Path | None = None
    """Who it is, from kintrack calibrate; sized from the first frame if not given."""
    segmentation: Annotated[Segmentation, tyro.conf.OmitArgPrefixes] = field(
        default_factory=Segmentation
    )
    """What labels the pixels."""
    solver: Literal["gauss-newton", "ipopt"] | None = None
    """Short for --config.solver.method; ipopt needs the extra `ipopt`."""
    recording: Annotated[Recording, tyro.conf.OmitArgPrefixes] = field(default_factory=Recording)
    """How to read the recording."""
    config: TrackerConfig = field(default_factory=TrackerConfig)
    """The tracker."""
    labelled: LabelledConfig = field(default_factory=LabelledConfig)
    """What belongs to labels: who is a person, when tracking begins and ends."""

    def run(self) -> None:
        """Track with progress; Ctrl-C leaves a valid result."""
        sequence = self.recording.open(self.sequence)
        folder = self.output or self.sequence / RESULT_FOLDER
        config = self.config
        if self.solver is not None:
            config = replace(config, solver=replace(config.solver, method=self.solver))
        person = None if self.person is None else read_person(self.person)
        segmenter = self.segmentation.segmenter()
        viewer = live_viewer(None) if self.view else NullViewer()
        with FitProgress(len(sequence)) as progress:
            try:
                fit_sequence(
                    sequence,
                    folder,
                    config,
                    Outputs(self.video, self.html),
                    viewer,
                    camera_pose(self.recording.camera_pitch_deg),
                    progress,
                    segmenter=segmenter,
                    person=person,
                    labelled=self.labelled,
                )
            finally:
                viewer.close()
        _print_summary(folder, self.video, self.html)


def _print_summary(folder: Path, *others: Path | None) -> None:
    track = Track.load(folder / TRACK_FILE)
    counts = Counter(str(status) for status in track.status)
    shares = ", ".join(f"{n} {status}" for status, n in counts.most_common())
    console.print(f"{len(track)} frames: {shares}")
    console.print("written: " + ", ".join(str(p) for p in (folder, *others) if p is not None))
