# SPDX-License-Identifier: Apache-2.0
"""Recordings in which nobody is to be seen for two seconds: behind a board, or gone."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8
from numpy import ndarray

from kintrack.bench.cases import ABSENT, HIDDEN, Case
from kintrack.bench.made import finish, is_made, recipe_of
from kintrack.errors import SceneError
from kintrack.geometry import camera_pose
from kintrack.joints import JOINT_NAMES
from kintrack.sequence import open_sequence
from kintrack.sequence.frame import Frame, SequenceReader
from kintrack.sequence.occlusion import OCCLUSION_FILE, read_occlusion
from kintrack.sequence.reference import REFERENCE_FILE, read_reference_joints
from kintrack.sequence.write import SequenceWriter
from synthesis.objects.finishes import board as board_finish
from synthesis.objects.shapes import box
from synthesis.occlusion.layer import Layer, composite, layer
from synthesis.occlusion.sensing import sensor_for
from synthesis.occlusion.silhouette import person_mask

GAP_S = 2.0
"""How long nobody is seen [s]."""
BEFORE_SHARE = 0.25
"""Share of the recording before the gap."""
AHEAD_M, MARGIN_M = 0.15, 0.2
"""The board stands so far before the person's nearest point and juts out beyond her [m]."""
THICK_M = 0.03
RIM_PX = 4
"""The person's outline is taken out with such a rim."""
FILL_PX = 5
"""How far around a pixel the filling looks."""
BACKGROUNDS = 24
"""Frames that tell what is behind the person."""


@dataclass(frozen=True)
class Gap:
    """A recording to be made from a clean one of a camera that stands still."""

    case: Case
    """What is to be made, `HIDDEN` or `ABSENT`."""
    clean: Case
    """The recording without a gap."""
    seed: int
    """Draws the board's colour and noise."""

    def recipe(self) -> str:
        """What the folder must have been made of."""
        made_of = self.clean.fingerprint()
        return recipe_of(made_of, self.case.condition, self.seed, GAP_S, BEFORE_SHARE)

    def is_made(self) -> bool:
        """Whether it is there, whole, and made of what is asked for."""
        return is_made(self.case.sequence, self.recipe())

    def run(self, on_frame: Callable[[], None]) -> None:
        """Make it.

        Args:
            on_frame: Called after every frame.

        Raises:
            SceneError: if the recording is too short, or nobody is in it during the gap.
        """
        folder, sequence = self.case.sequence, open_sequence(self.clean.sequence)
        rng = np.random.default_rng((self.seed, *self.case.key.encode()))
        gap = gap_of(sequence)
        change = self._absent(sequence) if self.case.condition == ABSENT else None
        if self.case.condition == HIDDEN:
            inserted = _board(sequence, gap, self.case.pitch_deg, rng)
            change = lambda frame: composite(frame, inserted, rng).frame  # noqa: E731
        assert change is not None
        shutil.rmtree(folder, ignore_errors=True)
        names, joints = read_reference_joints(self.clean.sequence / REFERENCE_FILE)
        shares, hidden = read_occlusion(self.clean.sequence / OCCLUSION_FILE)
        writer = SequenceWriter(folder, sequence.camera, joint_names=names)
        for n, frame in enumerate(sequence):
            away = n in gap
            shown = change(frame) if away else frame
            assert shown.depth_m is not None
            behind = np.ones(len(JOINT_NAMES), dtype=bool) if away else hidden[n]
            writer.write(
                frame.timestamp_s,
                shown.depth_m,
                color=shown.color,
                labels=shown.labels,
                joint_positions_m=None if away and self.case.condition == ABSENT else joints[n],
                hidden_share=1.0 if away else float(shares[n]),
                hidden_joints=[JOINT_NAMES[j] for j in np.flatnonzero(behind)],
            )
            on_frame()
        finish(folder, self.recipe())

    def _absent(self, sequence: SequenceReader) -> Callable[[Frame], Frame]:
        """What makes a frame one of the room alone."""
        depth, color = empty_room(sequence)

        def change(frame: Frame) -> Frame:
            assert frame.depth_m is not None and frame.labels is not None
            person = _grown(person_mask(frame))
            shown = None if frame.color is None else np.where(person[..., None], color, frame.color)
            return replace(
                frame,
                depth_m=np.where(person, depth, frame.depth_m).astype(np.float32),
                color=shown,
                labels=np.zeros_like(frame.labels),
            )

        return change


def gap_of(sequence: SequenceReader) -> range:
    """Frames in which nobody is seen.

    Raises:
        SceneError: if the recording is too short to have frames after them.
    """
    count = len(sequence)
    rate_hz = (count - 1) / max(
        sequence.frame(count - 1).timestamp_s - sequence.frame(0).timestamp_s, 1e-6
    )
    begin, length = round(BEFORE_SHARE * count), round(GAP_S * rate_hz)
    if count < 2 or begin + length >= count:
        raise SceneError(f"{sequence.name}: {count} frames are too few for a gap of {length}")
    return range(begin, begin + length)


def empty_room(
    sequence: SequenceReader,
) -> tuple[Float[ndarray, "h w"], UInt8[ndarray, "h w 3"]]:
    """What stands behind the person: medians of depth [m] and colour over frames.

    What she covers in all of them is filled in from around (Telea 2004).
    """
    numbers = np.unique(np.linspace(0, len(sequence) - 1, BACKGROUNDS).astype(int))
    depths, colors = [], []
    covered: Bool[ndarray, "h w"] | None = None
    for frame in (sequence.frame(int(n)) for n in numbers):
        if frame.depth_m is None:
            continue
        person = _grown(person_mask(frame))
        depths.append(np.where(person | (frame.depth_m == 0), np.nan, frame.depth_m))
        color = np.zeros((*person.shape, 3)) if frame.color is None else frame.color
        colors.append(np.where(person[..., None], np.nan, color).astype(np.float32))
        covered = person if covered is None else covered & person
    if covered is None:
        raise SceneError(f"{sequence.name}: no frame can be read")
    hole = covered.astype(np.uint8)
    depth = _median(np.stack(depths)).astype(np.float32)
    color = _median(np.stack(colors)).astype(np.uint8)
    return (
        cv2.inpaint(depth, hole, FILL_PX, cv2.INPAINT_TELEA),
        cv2.inpaint(color, hole, FILL_PX, cv2.INPAINT_TELEA),
    )


def _median(values: ndarray) -> ndarray:
    """Median of the finite values along the first axis, 0 where there is none."""
    ordered = np.sort(values, axis=0)
    count = np.isfinite(ordered).sum(axis=0)
    middle = np.take_along_axis(ordered, np.maximum(count - 1, 0)[None] // 2, axis=0)[0]
    return np.where(count > 0, middle, 0.0)


def _grown(mask: Bool[ndarray, "h w"]) -> Bool[ndarray, "h w"]:
    size = 2 * RIM_PX + 1
    return cv2.dilate(mask.astype(np.uint8), np.ones((size, size), np.uint8)) > 0


def _board(
    sequence: SequenceReader, gap: range, pitch_deg: float, rng: np.random.Generator
) -> Layer:
    """An upright board before everything that the person does in the gap."""
    T_world_camera = camera_pose(pitch_deg)
    points = []
    for n in gap:
        frame = sequence.frame(n)
        if frame.depth_m is not None:
            v, u = np.nonzero(person_mask(frame) & (frame.depth_m > 0))
            points.append(frame.camera.back_project(frame.depth_m)[v, u])
    seen = np.concatenate(points) if points else np.zeros((0, 3))
    if len(seen) == 0:
        raise SceneError(f"{sequence.name}: nobody is seen in frames {gap.start} to {gap.stop}")
    world = seen @ T_world_camera[:3, :3].T
    forward = T_world_camera[:3, 2] * [1, 1, 0]
    forward /= np.linalg.norm(forward)
    aside = np.cross([0.0, 0.0, 1.0], forward)
    place = max(np.percentile(world @ forward, 0.5) - AHEAD_M, 0.5)
    # seen from the camera, what stands behind fills the wider an angle the nearer it is
    lines = world / np.maximum(world @ forward, 1e-3)[:, None] * place
    low, high = (
        np.array([f(lines @ aside), f(lines[:, 2])]) + sign * MARGIN_M
        for f, sign in ((np.min, -1), (np.max, 1))
    )
    mesh = box((THICK_M, high[0] - low[0], high[1] - low[1]), board_finish(rng))
    T = np.eye(4)
    T[:3, :3] = np.column_stack([forward, aside, [0.0, 0.0, 1.0]])
    T[:3, 3] = T_world_camera[:3, 3] + place * forward + 0.5 * (low[0] + high[0]) * aside
    T[2, 3] = T_world_camera[2, 3] + low[1]
    return layer(mesh.moved(T), T_world_camera, sensor_for("auto", sequence.camera), rng)
