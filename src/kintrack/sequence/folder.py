# SPDX-License-Identifier: Apache-2.0
"""kintrack's own sequence folder: TUM's index files plus a camera file and true labels."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kintrack.errors import SequenceError
from kintrack.sequence.camera_file import check_positive, read_camera_file
from kintrack.sequence.index import pair_colors, read_ordered_index, timestamps
from kintrack.sequence.recording import FrameFiles, Recording

LONE_FRAME_TOLERANCE_S = 0.02
"""Colour tolerance of a recording with one depth image, which has no frame period [s]."""


def open_folder(
    root: Path, *, camera_path: Path | None = None, depth_scale_m: float | None = None
) -> Recording:
    """Open `camera.json`, `depth.txt` and, where present, `rgb.txt` and `labels/`.

    A colour image belongs to the depth image whose time is nearest, within half the median
    period of the depth images. Labels belong to the depth image of the same file stem.

    Args:
        root: The sequence folder.
        camera_path: Camera file to use instead of `camera.json`.
        depth_scale_m: Metres per depth unit, instead of the camera file's.

    Returns:
        The recording.

    Raises:
        SequenceError: if the camera file or an index is missing or broken, or time stamps do not
            increase strictly.
    """
    camera_path = camera_path or root / "camera.json"
    camera, file_scale_m = read_camera_file(camera_path)
    scale_m = depth_scale_m if depth_scale_m is not None else file_scale_m
    if scale_m is None:
        raise SequenceError(
            f"camera file {camera_path}: key 'depth_scale_m' is missing; it gives metres per "
            "depth unit, for example 0.001 for millimetres or 0.0002 for TUM's 1/5000 m"
        )
    depth = read_ordered_index(root / "depth.txt")
    colors = pair_colors(depth, root / "rgb.txt", _half_period_s(timestamps(depth)))
    labels = {path.stem: path for path in (root / "labels").glob("*.png")}
    return Recording(
        name=root.resolve().name,
        root=root,
        camera=camera,
        depth_scale_m=check_positive("depth_scale_m", scale_m, root),
        files=tuple(
            FrameFiles(entry.timestamp_s, entry.path, color, labels.get(entry.path.stem))
            for entry, color in zip(depth, colors, strict=True)
        ),
    )


def _half_period_s(times_s: np.ndarray) -> float:
    if len(times_s) < 2:
        return LONE_FRAME_TOLERANCE_S
    return float(np.median(np.diff(times_s))) / 2
