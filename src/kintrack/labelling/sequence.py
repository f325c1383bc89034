# SPDX-License-Identifier: Apache-2.0
"""A whole recording labelled: beside it, or as a new sequence folder of the kept frames."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import cast

import cv2
import numpy as np
from jaxtyping import Float, UInt8
from numpy import ndarray

from kintrack import __version__
from kintrack.config import TrackerConfig
from kintrack.errors import ResultError
from kintrack.files import make_result_folder, write_atomically, write_json
from kintrack.geometry import T_LEVEL_WORLD_CAMERA
from kintrack.labelling.foreground import find_foreground, only_person
from kintrack.labelling.keeping import Reason, top_reasons
from kintrack.labelling.opinions import LabelledFrame, Labeller, LabellingConfig
from kintrack.labelling.passes import track_both_ways
from kintrack.labelling.picture import LabelStrip
from kintrack.sequence import SequenceReader
from kintrack.sequence.recording import Recording
from kintrack.sequence.write import SequenceWriter

REPORT_FILE = "labels.json"
PICTURE_FILE = "labels.png"
LABEL_FOLDER = "labels"

Progress = Callable[[str, int, int], None]
"""Called with the stage, how much of it is done, and how much there is."""


@dataclass
class Report:
    """What became of the frames; grows while a recording is labelled."""

    frames: list[dict] = field(default_factory=list)
    """A row per frame seen: index, kept, reasons, whose labels, and the numbers behind."""
    reasons: list[tuple[Reason, ...]] = field(default_factory=list)
    """Reasons of the dropped frames."""

    def add(self, labelled: LabelledFrame, stored_as: str | None) -> None:
        """Count a frame."""
        row = {
            "frame": labelled.frame.index,
            "kept": labelled.kept,
            "reasons": [f"{reason.kind}: {reason.text}" for reason in labelled.verdict.reasons],
            "way": labelled.verdict.way,
            "labels": stored_as,
        }
        if labelled.verdict.opinion is not None:
            row["measures"] = asdict(labelled.verdict.opinion)
        self.frames.append(row)
        if not labelled.kept:
            self.reasons.append(labelled.verdict.reasons)

    @property
    def kept(self) -> int:
        """Frames kept."""
        return len(self.frames) - len(self.reasons)

    def summary(self) -> dict:
        """Counts and the list of dropped frames."""
        return {
            "frames": len(self.frames),
            "kept": self.kept,
            "dropped": [row["frame"] for row in self.frames if not row["kept"]],
            "reasons": top_reasons(self.reasons),
        }


def label_sequence(
    sequence: Recording,
    output: Path | None = None,
    config: LabellingConfig | None = None,
    tracker: TrackerConfig | None = None,
    T_world_camera: Float[ndarray, "4 4"] = T_LEVEL_WORLD_CAMERA,
    empty_room: SequenceReader | None = None,
    overwrite: bool = False,
    on_progress: Progress = lambda stage, done, total: None,
) -> Report:
    """Label a clean recording of one person and drop the frames in doubt.

    Without `output`, `labels/` appears in the recording, for kept frames only. With it, a new
    sequence folder holds the kept frames with depth, colour and labels. Either gets `labels.json`
    and `labels.png`, also when Ctrl-C ends the work while labels are written.

    Args:
        sequence: The recording.
        output: A new sequence folder; None to label the recording in place.
        config: Tolerances and thresholds; the defaults if None.
        tracker: The tracker; the defaults if None.
        T_world_camera: Camera pose; a level camera if not given.
        empty_room: The same still camera with nobody in view, if there is such a recording.
        overwrite: Whether labels or a sequence already there may be replaced.
        on_progress: Called after every frame of every stage.

    Returns:
        What was kept and dropped.

    Raises:
        ResultError: if labels are there already, a folder cannot be written, or no frame is kept.
        SequenceError: if no frame can be read.
    """
    config = LabellingConfig() if config is None else config
    reader = cast(SequenceReader, sequence)  # frozen, while the protocol's fields are settable
    count, done = len(sequence), 0
    store = _Beside(sequence, overwrite) if output is None else _Apart(sequence, output, overwrite)

    def step(stage: str, total: int) -> None:
        nonlocal done
        done = done % total + 1
        on_progress(stage, done, total)

    foreground = find_foreground(
        reader, config.foreground, empty_room, lambda: step("finding the person", count)
    )
    done = 0
    alone = only_person(reader, foreground)
    passes = track_both_ways(
        alone, tracker, T_world_camera, lambda frame, result: step("tracking", 2 * count)
    )
    done = 0
    labeller = Labeller(reader, foreground, passes, T_world_camera, config)
    verdicts = labeller.verdicts(lambda: step("judging", count))
    done = 0
    report, strip, finished = Report(), LabelStrip(), False
    try:
        for labelled in labeller.frames(verdicts):
            report.add(labelled, store.keep(labelled) if labelled.kept else None)
            if labelled.frame.depth_m is not None:
                texts = [f"{reason.kind}: {reason.text}" for reason in labelled.verdict.reasons]
                strip.add(labelled.frame.depth_m, labelled.labels, labelled.frame.index, texts)
            step("labelling", count)
        finished = True
    finally:
        if report.kept:
            strip.write(store.folder / PICTURE_FILE)
            write_json(
                store.folder / REPORT_FILE,
                {
                    "sequence": sequence.name,
                    "version": __version__,
                    "finished": finished,
                    "background": foreground.kind,
                    "person": {"shape": passes.human.shape},
                    "thresholds": asdict(config),
                    **report.summary(),
                    "per_frame": report.frames,
                },
            )
    if not report.kept:
        top = ", ".join(f"{kind} ({n} of {count} frames)" for kind, n in _top(report))
        raise ResultError(
            f"{sequence.root}: no frame is kept: {top or 'it has none'}. A clean recording shows "
            "one whole person, nothing in front, standing freely at the start"
        )
    return report


def _top(report: Report) -> list[tuple[str, int]]:
    return list(report.summary()["reasons"].items())[:3]


class _Beside:
    """Labels in the recording's own folder, under the names of its depth images."""

    def __init__(self, sequence: Recording, overwrite: bool):
        self.sequence, self.folder = sequence, sequence.root
        if not (self.folder / "camera.json").is_file():
            raise ResultError(
                f"{self.folder} is no sequence folder of kintrack (it has no camera.json), so "
                "labels beside it would not be read; give a folder with --output"
            )
        self._old = sorted((self.folder / LABEL_FOLDER).glob("*.png"))
        if self._old and not overwrite:
            raise ResultError(
                f"{self.folder / LABEL_FOLDER} holds {len(self._old)} label images; allowed: "
                "--overwrite to replace them, or --output with another folder"
            )

    def keep(self, labelled: LabelledFrame) -> str:
        """Write a frame's labels; the first one takes the old ones away."""
        make_result_folder(self.folder / LABEL_FOLDER)
        while self._old:
            self._old.pop().unlink(missing_ok=True)
        depth = self.sequence.files[labelled.frame.index].depth
        path = self.folder / LABEL_FOLDER / f"{depth.stem}.png"
        assert labelled.labels is not None
        _write_labels(path, labelled.labels)
        return f"{LABEL_FOLDER}/{path.name}"


class _Apart:
    """A sequence folder of the kept frames, made with the first of them."""

    def __init__(self, sequence: Recording, folder: Path, overwrite: bool):
        self.sequence, self.folder, self._overwrite = sequence, folder, overwrite
        self._writer: SequenceWriter | None = None
        if folder.resolve() == sequence.root.resolve():
            raise ResultError(f"{folder} is the recording itself; allowed: another folder, or none")
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())) and not overwrite:
            raise ResultError(f"{folder} is not empty; choose another folder or --overwrite")

    def keep(self, labelled: LabelledFrame) -> str:
        """Append a frame with its labels."""
        if self._writer is None:
            self._writer = SequenceWriter(
                self.folder,
                self.sequence.camera,
                self.sequence.depth_scale_m,
                overwrite=self._overwrite,
            )
        frame = labelled.frame
        assert frame.depth_m is not None
        stored = f"{LABEL_FOLDER}/{len(self._writer):06d}.png"
        self._writer.write(
            frame.timestamp_s, frame.depth_m, color=frame.color, labels=labelled.labels
        )
        return stored


def _write_labels(path: Path, labels: UInt8[ndarray, "h w"]) -> None:
    data = cv2.imencode(".png", np.asarray(labels, dtype=np.uint8))[1].tobytes()
    write_atomically(path, lambda file: file.write(data))
