# SPDX-License-Identifier: Apache-2.0
"""A few frames of a result in one picture: the depth above, the fit below."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from kintrack.errors import ResultError
from kintrack.export import contact_sheet, draw_overlay
from kintrack.export.overlay import depth_range, upscale_factor
from kintrack.fit import load_person, posed_skin
from kintrack.result import TRACK_FILE, Track
from kintrack.sequence import SequenceReader


def write_strip(folder: Path, sequence: SequenceReader, path: Path, columns: int = 4) -> None:
    """Write evenly spread frames of a result, each around the person.

    Args:
        folder: Result folder.
        sequence: The recording that was tracked.
        path: Picture to make or replace (png).
        columns: How many frames.

    Raises:
        ResultError: if the result cannot be read, has no pose, or the picture cannot be written.
    """
    track = Track.load(folder / TRACK_FILE)
    human, T_world_camera = load_person(folder)
    known = np.flatnonzero(np.isfinite(track.q).all(axis=1))
    if len(known) == 0:
        raise ResultError(f"{folder}: no frame has a pose to draw")
    pictures = []
    for i in known[np.linspace(0, len(known) - 1, columns + 1).astype(int)[1:]]:
        frame = sequence.frame(int(i))
        picture = draw_overlay(
            frame,
            posed_skin(human, track.q[i], T_world_camera),
            human.skin.faces,
            human.skin.labels,
            track.joint_positions_camera_m[i],
            str(track.status[i]),
            f"frame {i}",
            depth_range(frame.depth_m),
        )
        below_bar = picture[-sequence.camera.height * upscale_factor(sequence.camera) :]
        plain, fitted = np.array_split(below_bar, 2, axis=1)
        width = fitted.shape[1]
        u = sequence.camera.project(track.joint_positions_camera_m[i])[:, 0]
        centre = int(np.median(u) / sequence.camera.width * width)
        left = int(np.clip(centre - width // 4, 0, width - width // 2))
        pictures.append((plain[:, left : left + width // 2], fitted[:, left : left + width // 2]))
    rows = [plain for plain, _ in pictures] + [fitted for _, fitted in pictures]
    sheet = contact_sheet(rows, columns)
    if not cv2.imwrite(str(path), cv2.cvtColor(sheet, cv2.COLOR_RGB2BGR)):
        raise ResultError(f"cannot write {path}")
