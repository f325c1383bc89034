# SPDX-License-Identifier: Apache-2.0
"""The command line: parse, call the library, print; nothing else happens here."""

from __future__ import annotations

import sys
import time
import webbrowser
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from kintrack.config import TrackerConfig
from kintrack.errors import KintrackError
from kintrack.evaluate import evaluate, print_evaluation, write_evaluation
from kintrack.fit import RESULT_FOLDER, Outputs, fit_sequence, load_person
from kintrack.geometry import camera_pose
from kintrack.human import load_human
from kintrack.modelling.build import ModelBuildConfig, build_model
from kintrack.modelling.pictures import draw_model
from kintrack.result import TRACK_FILE, Track
from kintrack.sequence import SequenceReader, open_sequence
from kintrack.strip import write_strip
from kintrack.viewer import MeshcatViewer, NullViewer, Viewer, replay

console = Console()
errors = Console(stderr=True, soft_wrap=True)


@dataclass(frozen=True)
class Recording:
    """How to read the recording."""

    format: str = "auto"
    """Layout: folder, tum, azure, or auto to tell by the files present."""
    camera: Path | None = None
    """Camera file with the intrinsics; TUM folders need one."""
    depth_scale_m: float | None = None
    """Metres per unit of the depth images, if the recording does not say."""
    fps: float | None = None
    """Frames per second of a recording without time stamps."""
    camera_pitch_deg: float = 0.0
    """How far the camera looks down [deg]."""

    def open(self, path: Path) -> SequenceReader:
        """The recording at a path."""
        return open_sequence(
            path,
            format=self.format,
            camera=self.camera,
            depth_scale_m=self.depth_scale_m,
            fps=self.fps,
        )


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
    recording: Annotated[Recording, tyro.conf.OmitArgPrefixes] = field(default_factory=Recording)
    """How to read the recording."""
    config: TrackerConfig = field(default_factory=TrackerConfig)
    """The tracker."""

    def run(self) -> None:
        """Track with progress; Ctrl-C leaves a valid result."""
        sequence = self.recording.open(self.sequence)
        folder = self.output or self.sequence / RESULT_FOLDER
        viewer = _live_viewer(None) if self.view else NullViewer()
        with _Progress(len(sequence)) as progress:
            try:
                fit_sequence(
                    sequence,
                    folder,
                    self.config,
                    Outputs(self.video, self.html),
                    viewer,
                    camera_pose(self.recording.camera_pitch_deg),
                    progress,
                )
            finally:
                viewer.close()
        _print_summary(folder, self.video, self.html)


@dataclass(frozen=True)
class View:
    """Replay a result in a browser."""

    result: tyro.conf.Positional[Path]
    """Result folder, or the recording that holds it."""
    sequence: Path | None = None
    """Recording; the folder that holds the result if not given."""
    port: int | None = None
    """Port on this machine; any free one if not given."""
    replay_fps: float | None = None
    """Replay speed [frames/s]; the recording's own if not given."""
    once: bool = False
    """Stop after one replay."""
    recording: Annotated[Recording, tyro.conf.OmitArgPrefixes] = field(default_factory=Recording)
    """How to read the recording."""

    def run(self) -> None:
        """Serve until interrupted."""
        folder = self.result if (self.result / TRACK_FILE).exists() else self.result / RESULT_FOLDER
        human, T_world_camera = load_person(folder)
        sequence = self.recording.open(self.sequence or folder.parent)
        viewer = _live_viewer(self.port)
        try:
            replay(
                folder,
                sequence,
                viewer,
                human.body,
                human.skin,
                T_world_camera=T_world_camera,
                fps=self.replay_fps,
                loop=not self.once,
            )
        finally:
            viewer.close()


@dataclass(frozen=True)
class Evaluate:
    """Compare a result with reference joints."""

    result: tyro.conf.Positional[Path]
    """Result folder or track.npz."""
    reference: tyro.conf.Positional[Path]
    """reference_joints.csv, a recording that holds one, or another result."""
    output: Path | None = None
    """Where evaluation.json and evaluation.png go; the result folder if not given."""
    truth: bool = False
    """The reference is exact, so distances are errors; otherwise they are agreement."""

    def run(self) -> None:
        """Print the table, write the JSON and the plot."""
        folder = self.output or (self.result if self.result.is_dir() else self.result.parent)
        evaluation = evaluate(self.result, self.reference, reference_is_truth=self.truth)
        write_evaluation(evaluation, folder)
        print_evaluation(evaluation, console)
        console.print(f"written to {folder}/evaluation.json and .png")


@dataclass(frozen=True)
class Demo:
    """Fit the recording that ships, write its page and video, and compare with the truth."""

    output: Path = Path("kintrack-demo")
    """Folder for everything the demo makes."""
    no_open: bool = False
    """Do not open the page in a browser."""

    def run(self) -> None:
        """Fit, evaluate, show."""
        recording = Path(__file__).parent / "demo"
        page = self.output / "track.html"
        Fit(
            sequence=recording, output=self.output, video=self.output / "overlay.mp4", html=page
        ).run()
        Evaluate(self.output, recording, truth=True).run()
        write_strip(self.output, open_sequence(recording), self.output / "overlay.png")
        if not self.no_open:
            webbrowser.open(page.resolve().as_uri())


@dataclass(frozen=True)
class ModelBuild:
    """Rebuild the human from the adult population (needs the extra `model`)."""

    output: Path = Path("model")
    """Folder for human.urdf and skin/."""
    config: Annotated[ModelBuildConfig, tyro.conf.OmitArgPrefixes] = field(
        default_factory=ModelBuildConfig
    )
    """Sizes and seed."""

    def run(self) -> None:
        """Build, with a line per step."""
        build_model(self.output, self.config, console.print)


@dataclass(frozen=True)
class ModelPictures:
    """Draw the human in extreme but legal poses, and what its shape coefficients do."""

    output: Path = Path("docs")
    """Folder for model_poses.png and model_shapes.png."""

    def run(self) -> None:
        """Draw both pictures."""
        for path in draw_model(self.output):
            console.print(f"written: {path}")


@dataclass(frozen=True)
class Model:
    """The human itself: build or draw it."""

    action: Annotated[
        Annotated[ModelBuild, tyro.conf.subcommand("build")]
        | Annotated[ModelPictures, tyro.conf.subcommand("pictures")],
        tyro.conf.OmitSubcommandPrefixes,
        tyro.conf.OmitArgPrefixes,
    ]
    """What to do."""

    def run(self) -> None:
        """Do it."""
        self.action.run()


def _live_viewer(port: int | None) -> Viewer:
    viewer = MeshcatViewer(load_human().skin, port)
    console.print(f"watch at {viewer.url}")
    return viewer


class _Progress:
    """A bar with frame, speed, residual and status; one line at a time where nobody watches."""

    def __init__(self, total: int):
        self._bar = Progress(
            TextColumn("fitting"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[note]}"),
            TimeRemainingColumn(),
            console=console,
        )
        self._task = self._bar.add_task("fit", total=total, note="")
        self._began = time.perf_counter()
        self._done = 0

    def __enter__(self) -> _Progress:
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def __call__(self, frame, result) -> None:
        self._done += 1
        fps = self._done / (time.perf_counter() - self._began)
        note = f"{fps:.0f} fps  {1e3 * result.residual_rms_m:.0f} mm  {result.status}"
        self._bar.update(self._task, completed=self._done, note=note)


def _print_summary(folder: Path, *others: Path | None) -> None:
    track = Track.load(folder / TRACK_FILE)
    counts = Counter(str(status) for status in track.status)
    shares = ", ".join(f"{n} {status}" for status, n in counts.most_common())
    console.print(f"{len(track)} frames: {shares}")
    console.print("written: " + ", ".join(str(p) for p in (folder, *others) if p is not None))


def main(arguments: list[str] | None = None) -> None:
    """Entry point: exit code 0, 2 for a caller's mistake, 130 for Ctrl-C."""
    try:
        tyro.cli(Fit | View | Evaluate | Demo | Model, prog="kintrack", args=arguments).run()
    except KintrackError as error:
        errors.print(f"kintrack: {error}", style="red", highlight=False, markup=False)
        sys.exit(2)
    except KeyboardInterrupt:
        errors.print("stopped; what was done so far is written")
        sys.exit(130)
