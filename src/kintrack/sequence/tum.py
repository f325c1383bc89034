# SPDX-License-Identifier: Apache-2.0
"""Folders of the TUM RGB-D benchmark (Sturm et al., IROS 2012) and of those who follow it."""

from __future__ import annotations

from pathlib import Path

from kintrack.errors import SequenceError
from kintrack.sequence.camera_file import CAMERA_FORMAT, check_positive, read_camera_file
from kintrack.sequence.index import pair_colors, read_ordered_index
from kintrack.sequence.recording import FrameFiles, Recording

DEPTH_SCALE_M = 1 / 5000
"""Metres per depth unit, by the format's definition."""
TOLERANCE_S = 0.02
"""Colour and depth closer than this belong together, as in TUM's tools [s]."""

_PUBLISHED = (
    "freiburg1: fx 517.3, fy 516.5, cx 318.6, cy 255.3; "
    "freiburg2: fx 520.9, fy 521.0, cx 325.1, cy 249.7; "
    "freiburg3: fx 535.4, fy 539.2, cx 320.1, cy 247.6"
)


def open_tum(
    root: Path, *, camera_path: Path | None = None, depth_scale_m: float | None = None
) -> Recording:
    """Open `depth.txt` and `rgb.txt` of a folder that does not describe its camera.

    Args:
        root: The sequence folder.
        camera_path: Camera file, required; its depth scale counts if it has one.
        depth_scale_m: Metres per depth unit, instead of the camera file's or the format's 1/5000.

    Returns:
        The recording.

    Raises:
        SequenceError: if no camera is given, the camera file or an index is missing or broken, or
            time stamps do not increase strictly.
    """
    if camera_path is None:
        raise SequenceError(
            f"{root} is a TUM RGB-D folder, which does not tell its camera: give a camera file "
            f"with `--camera camera.json`. Format: {CAMERA_FORMAT} (depth_scale_m may be left "
            f"out; the format's is 1/5000). Published for 640x480: {_PUBLISHED}"
        )
    camera, file_scale_m = read_camera_file(camera_path)
    scale_m = depth_scale_m if depth_scale_m is not None else file_scale_m or DEPTH_SCALE_M
    depth = read_ordered_index(root / "depth.txt")
    colors = pair_colors(depth, root / "rgb.txt", TOLERANCE_S)
    return Recording(
        name=root.resolve().name,
        root=root,
        camera=camera,
        depth_scale_m=check_positive("depth_scale_m", scale_m, root),
        files=tuple(
            FrameFiles(entry.timestamp_s, entry.path, color)
            for entry, color in zip(depth, colors, strict=True)
        ),
    )
