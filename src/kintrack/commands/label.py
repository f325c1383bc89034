# SPDX-License-Identifier: Apache-2.0
"""`kintrack label`."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, cast

import tyro

from kintrack.commands.console import StepProgress, console
from kintrack.commands.recording import Recording
from kintrack.config import TrackerConfig
from kintrack.geometry import camera_pose
from kintrack.labelling.opinions import LabellingConfig
from kintrack.labelling.sequence import LABEL_FOLDER, PICTURE_FILE, REPORT_FILE, label_sequence
from kintrack.sequence.recording import Recording as OpenRecording


@dataclass(frozen=True)
class Label:
    """Label the body parts in a clean recording of one person, dropping frames in doubt."""

    sequence: tyro.conf.Positional[Path]
    """Folder of the recording: one person, nothing in front."""
    output: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """New sequence folder for the kept frames; labels/ inside SEQUENCE if not given."""
    background: Path | None = None
    """Recording of the same still camera with nobody in view."""
    overwrite: bool = False
    """Replace labels that are there already."""
    recording: Annotated[Recording, tyro.conf.OmitArgPrefixes] = field(default_factory=Recording)
    """How to read the recording."""
    config: TrackerConfig = field(default_factory=TrackerConfig)
    """The tracker."""
    labelling: LabellingConfig = field(default_factory=LabellingConfig)
    """Removing the room, tolerances, and the drop rule."""

    def run(self) -> None:
        """Label with progress; Ctrl-C leaves valid files."""
        sequence = self.recording.open(self.sequence)
        empty = None if self.background is None else self.recording.open(self.background)
        with StepProgress() as show:
            report = label_sequence(
                cast(OpenRecording, sequence),
                self.output,
                self.labelling,
                self.config,
                camera_pose(self.recording.camera_pitch_deg),
                empty,
                self.overwrite,
                show,
            )
        folder = self.output or self.sequence
        summary = report.summary()
        console.print(f"{summary['kept']} of {summary['frames']} frames kept")
        for kind, frames in summary["reasons"].items():
            console.print(f"  dropped for {kind}: {frames}")
        names = f"{LABEL_FOLDER}/, {REPORT_FILE}, {PICTURE_FILE}"
        console.print(f"written: {names} in {folder}")
