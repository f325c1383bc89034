# SPDX-License-Identifier: Apache-2.0
"""`methods.png`: the same frames as the camera saw them, and as each method understood them."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import UInt8
from matplotlib.figure import Figure
from numpy import ndarray

from kintrack.bench.accuracy import Bench
from kintrack.bench.cases import OBJECTS, REAL, ROOM, SCENES, Case
from kintrack.bench.figure import in_words
from kintrack.bench.full_scenes import PIXELS_FILE
from kintrack.bench.methods import GEOMETRY, RGB, Method
from kintrack.bench.rgb import VISIBLE, lift
from kintrack.export import draw_overlay
from kintrack.export.overlay import BAR_PX, depth_picture, depth_range
from kintrack.files import write_atomically
from kintrack.fit import load_person, posed_skin
from kintrack.joints import JOINT_NAMES
from kintrack.result import TRACK_FILE, Track
from kintrack.sequence import open_sequence
from kintrack.sequence.frame import Frame
from kintrack.sequence.reference import read_reference_pixels

METHODS_FILE = "methods.png"
ROWS = 6
"""Most frames shown."""
MOMENT = 0.6
"""Which frame of a recording is shown, share of its length; chosen once, not by what it shows."""
_WIDTH_PX = 420


def write_methods(bench: Bench) -> Path | None:
    """Draw `methods.png`: input, geometry alone, RGB regression, ours.

    Args:
        bench: A finished run.

    Returns:
        The file; None if there is nothing to compare.

    Raises:
        ResultError: if it cannot be written.
    """
    cases = shown_cases(bench.cases)
    own = [method for method in bench.methods if method.main]
    if not cases or not own:
        return None
    kinds = (GEOMETRY, RGB, own[0].kind)
    figure = Figure(figsize=(2.6 * 4, 2.25 * len(cases) + 0.3), layout="constrained")
    axes = figure.subplots(len(cases), 4, squeeze=False)
    for axis in axes.flat:
        axis.set_axis_off()
    for row, case in zip(axes, cases, strict=True):
        sequence = open_sequence(case.sequence)
        frame = sequence.frame(round(MOMENT * (len(sequence) - 1)))
        row[0].imshow(_input(frame))
        for axis, kind in zip(row[1:], kinds, strict=True):
            picture, says = _understood(bench, kind, case, frame)
            axis.imshow(picture)
            axis.set_title(says, fontsize=7, pad=2)
        row[0].set_title(f"{case.name}, {case.condition}, frame {frame.index}", fontsize=7, pad=2)
    for axis, says in zip(
        axes[0], ("input", in_words(GEOMETRY), in_words(RGB), in_words(own[0].name)), strict=True
    ):
        axis.set_title(f"{says}\n{axis.get_title()}", fontsize=8, pad=2)
    path = bench.folder / METHODS_FILE
    write_atomically(path, partial(figure.savefig, format="png", dpi=150))
    return path


def shown_cases(cases: tuple[Case, ...]) -> list[Case]:
    """One recording at each distance, one real person behind an object, then full scenes."""
    out: list[Case] = []
    for n, condition in enumerate(reversed(OBJECTS)):
        there = [c for c in cases if c.group == ROOM and c.condition == condition]
        out += there[2 * n + 1 : 2 * n + 2] or there[:1]
    out += [c for c in cases if c.group == REAL and c.condition == OBJECTS[0]][:1]
    out += [c for c in cases if c.group == SCENES and c.name in ("sofa", "bonn_tablet")]
    return out[:ROWS]


def _method(bench: Bench, kind: str, case: Case) -> Method | None:
    """The method of a kind that ran on a recording."""
    fits = [m for m in bench.methods if m.kind == kind and m.runs_on(case)]
    fits = [m for m in fits if m.main] or fits
    return min(fits, key=lambda method: method.cold, default=None)


def _understood(
    bench: Bench, kind: str, case: Case, frame: Frame
) -> tuple[UInt8[ndarray, "h w 3"], str]:
    """The frame with the joints and the skin that a method found, and what it says of itself."""
    vertices, human, status = None, None, "tracking"
    joints = np.full((len(JOINT_NAMES), 3), np.nan)
    method = _method(bench, kind, case)
    if method is not None:
        track = Track.load(bench.result_of(method, case) / TRACK_FILE)
        joints = track.joint_positions_camera_m[frame.index]
        status = str(track.status[frame.index])
        if kind != RGB:
            human, T_world_camera = load_person(bench.result_of(method, case))
            vertices = posed_skin(human, track.q[frame.index], T_world_camera)
    elif kind == RGB and case.group == SCENES:
        names, pixels, sure = read_reference_pixels(case.sequence / PIXELS_FILE)
        if frame.index < len(pixels):
            seen = np.where(sure[frame.index, :, None] > VISIBLE, pixels[frame.index], np.nan)
            joints = lift(frame, dict(zip(names, seen, strict=True)))
    else:
        return _shrunk(_input(frame) // 3), "no colour" if kind == RGB else "not run"
    shown = draw_overlay(
        frame,
        vertices,
        np.zeros((0, 3), dtype=int) if human is None else human.skin.faces,
        np.zeros(0, np.uint8) if human is None else human.skin.labels,
        joints,
        status,
        "",
    )
    panel = shown[BAR_PX:, (shown.shape[1] + 4) // 2 :]
    posed = int(np.isfinite(joints).all(axis=1).sum())
    says = f"{posed} of {len(JOINT_NAMES)} joints" if kind == RGB else status
    return _shrunk(panel), says


def _input(frame: Frame) -> UInt8[ndarray, "h w 3"]:
    if frame.color is not None:
        return _shrunk(frame.color)
    assert frame.depth_m is not None
    return _shrunk(depth_picture(frame.depth_m, depth_range(frame.depth_m)))


def _shrunk(picture: UInt8[ndarray, "h w 3"]) -> UInt8[ndarray, "h w 3"]:
    height = round(picture.shape[0] * _WIDTH_PX / picture.shape[1])
    return cv2.resize(picture, (_WIDTH_PX, height), interpolation=cv2.INTER_AREA)
