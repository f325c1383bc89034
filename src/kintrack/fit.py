# SPDX-License-Identifier: Apache-2.0
"""A whole recording through the tracker: result folder, video, page, live view, progress."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, UInt8
from numpy import ndarray

from kintrack.body import run_kinematics
from kintrack.calibration.acquaintance import Acquaintance, Again
from kintrack.calibration.config import BodyConfig
from kintrack.calibration.person import Person, human_of
from kintrack.clothing import dressed_human
from kintrack.config import TrackerConfig
from kintrack.errors import ResultError
from kintrack.export import HtmlRecorder, VideoWriter, draw_overlay
from kintrack.export.overlay import depth_range
from kintrack.files import make_result_folder
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, invert_rigid, transform_points
from kintrack.human import Human
from kintrack.joints import JOINT_NAMES
from kintrack.labelled_config import LabelledConfig
from kintrack.result import FrameResult, Track
from kintrack.result_writer import TrackWriter
from kintrack.segmenter import Segmenter
from kintrack.sequence.frame import Frame, SequenceReader
from kintrack.skin import skinned_vertices
from kintrack.tracker import Tracker
from kintrack.viewer import NullViewer, Viewer

RESULT_FOLDER = "kintrack"
"""Default result folder inside a sequence."""


@dataclass(frozen=True)
class Outputs:
    """What a fit writes besides the result folder."""

    video: Path | None = None
    """Overlay video (mp4) of depth, skin and skeleton."""
    html: Path | None = None
    """Page with the animated body and point cloud."""


def fit_sequence(
    sequence: SequenceReader,
    folder: Path,
    config: TrackerConfig | None = None,
    outputs: Outputs | None = None,
    viewer: Viewer | None = None,
    T_world_camera: Float[ndarray, "4 4"] = T_LEVEL_WORLD_CAMERA,
    on_frame: Callable[[Frame, FrameResult], None] = lambda frame, result: None,
    begun: tuple[Frame, Float[ndarray, "j 3"]] | None = None,
    segmenter: Segmenter | None = None,
    person: Person | None = None,
    labelled: LabelledConfig | None = None,
    body: BodyConfig | None = None,
) -> Track:
    """Track a recording into a result folder that is valid at every moment.

    Unless the person is given or `body` says otherwise, she is calibrated after the first second
    of tracking, and the recording is tracked from its beginning with her body, so that a result has
    one body throughout. If that follows her worse than before, or she is in doubt, the template
    stays.

    Args:
        sequence: The recording.
        folder: Result folder; made where missing.
        config: All weights; the defaults if None.
        outputs: Video and page, if wanted.
        viewer: Shown every frame, if given.
        T_world_camera: Camera pose; a level camera if not given.
        on_frame: Called after every frame, for progress; frames tracked again come again.
        begun: A frame, and the joints in it as far as they are known (`Tracker.begin`), with which
            the tracker starts before the first frame; it starts by itself if None.
        segmenter: Labels every frame; None for the geometry alone.
        person: Who it is; if None, she is calibrated while tracking. The template that stands in
            for somebody in doubt is sized at the start.
        labelled: What belongs to labels; the defaults if None.
        body: Which body; the defaults if None.

    Returns:
        The track; also written when an exception or Ctrl-C ends the loop.

    Raises:
        ResultError: if an output cannot be written, before any work.
        ConfigError: if the solver is not installed, before anything written earlier is touched.
        CalibrationError: if a person or height is given that `body` has no use for, or nobody is as
            tall as stated.
    """
    body = BodyConfig() if body is None else body
    outputs = Outputs() if outputs is None else outputs
    for path in (outputs.video, outputs.html):
        if path is not None:
            make_result_folder(path.parent)
    config = body.applied(TrackerConfig() if config is None else config)
    acquaintance = Acquaintance(body, person, T_world_camera, config)
    while True:
        who = acquaintance.person
        human = None if who is None else human_of(who)
        tracker = Tracker(config, human, T_world_camera, segmenter=segmenter, labelled=labelled)
        try:
            return _pass(
                sequence,
                folder,
                tracker,
                acquaintance,
                outputs,
                NullViewer() if viewer is None else viewer,
                on_frame,
                begun,
            )
        except Again:
            continue


def _pass(
    sequence: SequenceReader,
    folder: Path,
    tracker: Tracker,
    acquaintance: Acquaintance,
    outputs: Outputs,
    viewer: Viewer,
    on_frame: Callable[[Frame, FrameResult], None],
    begun: tuple[Frame, Float[ndarray, "j 3"]] | None,
) -> Track:
    """Track from the first frame to the last, or until another body should be tried (`Again`)."""
    if begun is not None:
        tracker.begin(*begun)
    T_world_camera, facts = tracker.T_world_camera, asdict(tracker.config)
    if tracker.segmenter is not None:
        facts |= {"labelled": asdict(tracker.labelled), "segmenter": tracker.segmenter.name}
    with ExitStack() as stack:
        writer = stack.enter_context(
            TrackWriter(
                folder,
                JOINT_NAMES,
                sequence_name=sequence.name,
                camera=sequence.camera,
                config=facts,
            )
        )
        writer.note(T_world_camera=T_world_camera, body=acquaintance.told())
        video = outputs.video and stack.enter_context(VideoWriter(outputs.video, _rate(sequence)))
        page = None
        if outputs.html is not None:
            page = HtmlRecorder(tracker.human.skin, T_world_camera, title=sequence.name)
            stack.callback(page.write, outputs.html)
        shades = None
        for frame, result, human, labels in _settled(sequence, tracker):
            writer.append(result)
            writer.note(person={"shape": human.shape, "clothing_m": dict(human.clothing_m)})
            vertices = posed_skin(human, result.q, T_world_camera)
            joints = result.joint_positions_camera_m
            text = caption(result)
            viewer.show(frame, vertices, joints, result.status, text)
            if page is not None:
                page.add(frame, vertices, joints, result.status, text)
            if video:
                shades = depth_range(frame.depth_m) if shades is None else shades
                skin = human.skin
                video.write(
                    draw_overlay(
                        frame,
                        vertices,
                        skin.faces,
                        skin.labels,
                        joints,
                        result.status,
                        f"frame {frame.index}  {text}",
                        shades,
                    )
                )
            on_frame(frame, result)
            acquaintance.see(frame, result, human, labels)
            writer.note(body=acquaintance.told())
        acquaintance.conclude()
        writer.note(body=acquaintance.told())
        return writer.close()


class _Tracked(NamedTuple):
    """A frame, and what was made of it."""

    frame: Frame
    result: FrameResult
    human: Human
    labels: UInt8[ndarray, "r c"] | None


def _settled(sequence: SequenceReader, tracker: Tracker) -> Iterator[_Tracked]:
    """Track every frame, and hold those back whose results may still be amended."""
    held: list[_Tracked] = []
    try:
        for frame in sequence:
            result, segmenter = tracker.step(frame), tracker.segmenter
            labels = None if segmenter is None else segmenter.last
            held.append(_Tracked(frame, result, tracker.human, labels))
            amended = tracker.amended
            for n, better in enumerate(amended, len(held) - len(amended)):
                held[n] = held[n]._replace(result=better, human=tracker.human)
            if not tracker.in_doubt:
                yield from held
                held = []
    except (Exception, KeyboardInterrupt):
        yield from held
        raise
    yield from held


def posed_skin(
    human: Human, q: Float[ndarray, " nq"], T_world_camera: Float[ndarray, "4 4"]
) -> Float[ndarray, "v 3"] | None:
    """Skin vertices at q in the camera frame [m]; None where q is not known."""
    if not np.isfinite(q).all():
        return None
    vertices = skinned_vertices(run_kinematics(human.body, q), human.skin)
    return transform_points(invert_rigid(T_world_camera), vertices)


def caption(result: FrameResult) -> str:
    """One line about a frame for pictures: speed and residual, or why it was skipped."""
    if result.reason is not None:
        return result.reason
    text = f"{result.milliseconds:.0f} ms"
    if np.isfinite(result.residual_rms_m):
        text += f"  residual {1e3 * result.residual_rms_m:.0f} mm"
    return text


def load_person(folder: Path) -> tuple[Human, Float[ndarray, "4 4"]]:
    """The human and the camera pose that a result was tracked with.

    Args:
        folder: Result folder.

    Returns:
        The human and T_world_camera.

    Raises:
        ResultError: if the summary is missing or broken.
    """
    path = folder / "summary.json"
    try:
        summary = json.loads(path.read_text())
        who = summary.get("person", {})
        shape, worn = np.array(who.get("shape", []), dtype=float), who.get("clothing_m", {})
        T_world_camera = np.array(summary["T_world_camera"], dtype=float).reshape(4, 4)
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise ResultError(f"{path}: no readable summary of a result ({error!r})") from error
    return dressed_human(shape if len(shape) else None, worn), T_world_camera


def _rate(sequence: SequenceReader) -> float:
    """Frames per second of a recording by its first two time stamps [hz]; 30 if there is one."""
    if len(sequence) < 2:
        return 30.0
    step_s = sequence.frame(1).timestamp_s - sequence.frame(0).timestamp_s
    return float(np.clip(1.0 / step_s, 1.0, 120.0))
