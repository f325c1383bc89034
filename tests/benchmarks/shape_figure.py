# SPDX-License-Identifier: Apache-2.0
"""One frame of a recording with several bodies' skins over it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.export import draw_overlay
from kintrack.fit import load_person, posed_skin
from kintrack.result import TRACK_FILE, Track
from kintrack.sequence.frame import Frame

RIM_PX = 12
"""Shown around the person [px]."""


def draw(
    frame: Frame, results: Sequence[Path], T_world_camera: Float[ndarray, "4 4"], path: Path
) -> None:
    """Draw the depth, then the skin of every result over it, cut to the person.

    Args:
        frame: A frame with true labels.
        results: Result folders of its recording.
        T_world_camera: Camera pose.
        path: PNG to write.
    """
    assert frame.labels is not None
    rows, columns = (np.flatnonzero((frame.labels > 0).any(axis=a)) for a in (1, 0))
    pictures: list[ndarray] = []
    for folder in results:
        track, (human, _) = Track.load(folder / TRACK_FILE), load_person(folder)
        if track.status[frame.index] != "tracking":
            continue
        whole = draw_overlay(
            frame,
            posed_skin(human, track.q[frame.index], T_world_camera),
            human.skin.faces,
            human.skin.labels,
            track.joint_positions_camera_m[frame.index],
            "tracking",
            "",
            None,
        )
        bar, width = len(whole) - frame.camera.height, frame.camera.width
        tall = slice(bar + max(rows[0] - RIM_PX, 0), bar + rows[-1] + RIM_PX)
        left, right = max(columns[0] - RIM_PX, 0), columns[-1] + RIM_PX
        if not pictures:
            pictures.append(whole[tall, left:right])
        pictures.append(whole[tall, width + left : width + right])
    if not pictures:
        return
    sheet = cv2.resize(np.hstack(pictures), None, fx=2, fy=2, interpolation=cv2.INTER_NEAREST)
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), cv2.cvtColor(sheet, cv2.COLOR_RGB2BGR))
