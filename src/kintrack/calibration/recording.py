# SPDX-License-Identifier: Apache-2.0
"""A person from a recording that has been tracked."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float, UInt8
from numpy import ndarray

from kintrack.alignment import view_skin
from kintrack.association.observation import Observation, box_around, observe, within
from kintrack.body import run_kinematics
from kintrack.calibration.calibrator import Calibrator
from kintrack.calibration.config import CalibrationConfig
from kintrack.calibration.person import Person
from kintrack.calibration.selection import varied
from kintrack.config import TrackerConfig
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, invert_rigid
from kintrack.human import Human
from kintrack.result import Track
from kintrack.segmenter import Segmenter, checked_labels, region_of
from kintrack.sequence.frame import Frame, SequenceReader
from kintrack.settling import settle

MARGIN_M = 0.12
"""Points further than this from the tracked body's box are not the person's [m]."""


def calibrate_recording(
    sequence: SequenceReader,
    track: Track,
    human: Human,
    T_world_camera: Float[ndarray, "4 4"] = T_LEVEL_WORLD_CAMERA,
    segmenter: Segmenter | None = None,
    config: CalibrationConfig | None = None,
    tracker: TrackerConfig | None = None,
    stated_height_m: float | None = None,
    on_frame: Callable[[int], None] = lambda index: None,
) -> Person:
    """Calibrate the person of a recording from a few varied frames of its track.

    Args:
        sequence: The recording.
        track: Its track.
        human: With whom it was tracked.
        T_world_camera: Camera pose it was tracked with.
        segmenter: Tells the person from what is around; None for a recording of her alone.
        config: How to calibrate.
        tracker: Association and pose priors.
        stated_height_m: Height of the person, if somebody knows it [m].
        on_frame: Called with every frame's number once it is read.

    Returns:
        The person, or the template with the reasons why.

    Raises:
        CalibrationError: if no frame is tracked or the stated height is impossible.
    """
    calibrator = Calibrator(human, T_world_camera, config, tracker, stated_height_m)
    good = np.flatnonzero(track.status == "tracking")
    seen = track.joint_visible[good].mean(axis=1)
    wanted = varied(track.joint_positions_camera_m[good], seen, calibrator.config.frames)
    for n in wanted:
        frame = sequence.frame(int(good[n]))
        on_frame(frame.index)
        if frame.problem is not None or frame.depth_m is None:
            continue
        labels, q = None, track.q[good[n]]
        if segmenter is not None:
            where = region_of(track.joint_positions_camera_m[good[n]], frame.camera)
            labels = checked_labels(segmenter, frame, where)
        shown = person_in(frame, q, human, T_world_camera, labels, calibrator.tracker)
        calibrator.add(frame.index, shown, q, float(seen[n]))
    return calibrator.result()


def person_in(
    frame: Frame,
    q: Float[ndarray, " nq"],
    human: Human,
    T_world_camera: Float[ndarray, "4 4"],
    labels: UInt8[ndarray, "r c"] | None,
    tracker: TrackerConfig,
) -> Observation:
    """What a frame shows of the person near her pose.

    That is her labels, settled as while tracking (`settling.py`), or everything without labels.

    Args:
        frame: A good frame.
        q: Her pose in it.
        human: Her body.
        T_world_camera: Camera pose.
        labels: The frame's labels; None if it is not labelled.
        tracker: How a frame is observed.
    """
    a, T_camera_world = tracker.association, invert_rigid(T_world_camera)
    seen = observe(frame, a.max_width_px, a.background_share, labels)
    view = view_skin(human, run_kinematics(human.body, q), T_camera_world, seen, tracker)
    near = within(seen, box_around(view.vertices_camera, MARGIN_M))
    return settle(near, view, a.doubt_m, a.side_m)
