# SPDX-License-Identifier: Apache-2.0
"""`kintrack fit`."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from kintrack.calibration.config import BodyConfig, BodyKind, MeetingConfig
from kintrack.commands.console import FitProgress, console
from kintrack.commands.recording import Recording
from kintrack.commands.segmenting import Segmentation
from kintrack.commands.view import live_viewer
from kintrack.config import TrackerConfig
from kintrack.labelled_config import LabelledConfig


@dataclass(frozen=True)
class Fit:
    """Fit the body to every frame of a recording."""

    sequence: tyro.conf.Positional[Path]
    """Folder of the recording."""
    output: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """Result folder; SEQUENCE/kintrack if not given."""
    video: Path | None = None
    """Also write an overlay video (mp4) here."""
    html: Path | None = None
    """Also write a page with the moving body and the points here."""
    view: bool = False
    """Watch live in a browser."""
    body: BodyKind = "calibrated"
    """template: the average adult, stature and build sized in the first frame; calibrated: the
    person's own body and clothes, from `--person` or from the first second; deformable: the same,
    and the skin follows cloth and folds."""
    person: Path | None = None
    """Who it is, from kintrack calibrate; she is calibrated on the way if not given."""
    height_m: float | None = None
    """The person's height without shoes, if it is known and no person is given [m]."""
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
    meeting: MeetingConfig = field(default_factory=MeetingConfig)
    """When and how a person who is not given is calibrated."""
    labelled: LabelledConfig = field(default_factory=LabelledConfig)
    """What belongs to labels: who is a person, when tracking begins and ends."""

    def run(self) -> None:
        """Track with progress; Ctrl-C leaves a valid result."""
        from kintrack.calibration.person import read_person
        from kintrack.fit import RESULT_FOLDER, Outputs, fit_sequence
        from kintrack.geometry import camera_pose
        from kintrack.viewer import NullViewer

        body = BodyConfig(self.body, self.height_m, self.meeting)
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
                    body=body,
                )
            finally:
                viewer.close()
        _print_summary(folder, self.video, self.html)


def _print_summary(folder: Path, *others: Path | None) -> None:
    from kintrack.result import TRACK_FILE, Track
    from kintrack.result_writer import SUMMARY_FILE

    track = Track.load(folder / TRACK_FILE)
    counts = Counter(str(status) for status in track.status)
    shares = ", ".join(f"{n} {status}" for status, n in counts.most_common())
    console.print(f"{len(track)} frames: {shares}")
    for line in said_of_body(json.loads((folder / SUMMARY_FILE).read_text()).get("body", {})):
        console.print(line)
    console.print("written: " + ", ".join(str(p) for p in (folder, *others) if p is not None))


def said_of_body(body: Mapping[str, Any]) -> list[str]:
    """What a summary's `body` says, for people: whose body, what was estimated, how sure.

    Args:
        body: See `Acquaintance.told`.
    """
    attempts = body.get("attempts", [])
    if not attempts:
        return []
    last = attempts[-1]
    lines = [f"calibrated after {last['tracked_s']:.1f} s: {last['estimated']}"]
    if body["used"] == "calibrated":
        return lines
    if last["problems"]:
        why = "; ".join(last["problems"])
        lines[0] = f"estimated: {last['estimated']}" if last["estimated"] else "nothing estimated"
    else:
        why = body["dropped"]
    return [*lines, f"not used: {why}", "tracked with the template; see docs/shape.md"]
