# SPDX-License-Identifier: Apache-2.0
"""`kintrack calibrate`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import tyro

from kintrack.calibration.config import BodyConfig, CalibrationConfig
from kintrack.commands.console import FitProgress, console
from kintrack.commands.recording import Recording
from kintrack.commands.segmenting import Segmentation
from kintrack.config import TrackerConfig

if TYPE_CHECKING:
    from kintrack.calibration.person import Person


@dataclass(frozen=True)
class Calibrate:
    """Learn a person's size and build from a recording, once."""

    sequence: tyro.conf.Positional[Path]
    """Folder of a recording in which the person moves arms and legs and turns."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])] = Path("person.json")
    """File to write; `kintrack fit --person` takes it."""
    urdf: Path | None = None
    """Also write the person's URDF and skin into this folder, for planners."""
    height_m: float | None = None
    """The person's height without shoes, if it is known [m]."""
    track: Path | None = None
    """Result folder of `kintrack fit` on this recording; tracked now if not given."""
    segmentation: Annotated[Segmentation, tyro.conf.OmitArgPrefixes] = field(
        default_factory=Segmentation
    )
    """What labels the pixels."""
    recording: Annotated[Recording, tyro.conf.OmitArgPrefixes] = field(default_factory=Recording)
    """How to read the recording."""
    calibration: CalibrationConfig = field(default_factory=CalibrationConfig)
    """How to calibrate."""
    config: TrackerConfig = field(default_factory=TrackerConfig)
    """The tracker."""

    def run(self) -> None:
        """Track, choose frames, calibrate; say what was found and how sure it is."""
        from kintrack.calibration.calibrator import check_stated
        from kintrack.calibration.person import write_person
        from kintrack.calibration.recording import calibrate_recording
        from kintrack.files import make_result_folder
        from kintrack.fit import fit_sequence, load_person
        from kintrack.geometry import camera_pose
        from kintrack.modelling.personal import write_personal_model
        from kintrack.result import TRACK_FILE, Track

        check_stated(self.height_m)
        sequence, segmenter = self.recording.open(self.sequence), self.segmentation.segmenter()
        make_result_folder(self.output.parent)
        with TemporaryDirectory() as scratch:
            folder = self.track or Path(scratch)
            if self.track is None:
                with FitProgress(len(sequence)) as progress:
                    fit_sequence(
                        sequence,
                        folder,
                        self.config,
                        T_world_camera=camera_pose(self.recording.camera_pitch_deg),
                        on_frame=progress,
                        segmenter=segmenter,
                        body=BodyConfig("template"),
                    )
            human, T_world_camera = load_person(folder)
            person = calibrate_recording(
                sequence,
                Track.load(folder / TRACK_FILE),
                human,
                T_world_camera,
                segmenter,
                self.calibration,
                tracker=self.config,
                stated_height_m=self.height_m,
            )
        report(person, console.print)
        write_person(person, self.output)
        written = [self.output]
        if self.urdf is not None:
            write_personal_model(person.shape, self.urdf)
            written.append(self.urdf)
        console.print("written: " + ", ".join(str(path) for path in written))


def report(person: Person, say: Callable[[str], None]) -> None:
    """Say what was estimated, and why it is not used where it is not."""
    say(f"estimated: {person.describe()}")
    for problem in person.problems:
        say(f"not used: {problem}")
    if person.is_template:
        say("the average adult is written instead; see docs/shape.md for what a recording needs")
