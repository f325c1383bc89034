# SPDX-License-Identifier: Apache-2.0
"""Folders as Open3D's Azure Kinect and RealSense recorders leave them; no time stamps."""

from __future__ import annotations

import re
from pathlib import Path

from kintrack.errors import SequenceError
from kintrack.sequence.camera_file import check_positive, read_camera_file
from kintrack.sequence.recording import FrameFiles, Recording

DEFAULT_FPS = 30.0
"""Frames per second where the caller gives none [hz]."""


def open_azure(
    root: Path,
    *,
    camera_path: Path | None = None,
    depth_scale_m: float | None = None,
    fps: float = DEFAULT_FPS,
) -> Recording:
    """Open `intrinsic.json`, `depth/` and, where present, `color/`.

    Frames are the PNGs of `depth/` in the order of their names (2 before 10). Colour goes with
    depth by file stem; if no stem is common, by position, as Open3D does.

    Args:
        root: The sequence folder.
        camera_path: Camera file to use instead of `intrinsic.json`.
        depth_scale_m: Metres per depth unit; required if the camera file does not tell.
        fps: Frames per second, from which the time stamps are made [hz].

    Returns:
        The recording; the first frame is at 0 s.

    Raises:
        SequenceError: if the camera file is missing or broken, the depth scale is unknown, there
            is no depth image, or colour cannot be paired.
    """
    camera_path = camera_path or root / "intrinsic.json"
    camera, file_scale_m = read_camera_file(camera_path)
    scale_m = depth_scale_m if depth_scale_m is not None else file_scale_m
    if scale_m is None:
        raise SequenceError(
            f"{camera_path} does not tell the unit of the depth images: give metres per unit with "
            "`--depth-scale-m` (0.001 for millimetres), or add the key 'depth_scale', which "
            "counts units per metre (1000 for millimetres)"
        )
    check_positive("fps", fps, root)
    depth = _images(root / "depth", {".png"})
    if not depth:
        raise SequenceError(f"{root / 'depth'} holds no PNG; needed: 16-bit depth images")
    colors = _pair(depth, _images(root / "color", {".png", ".jpg", ".jpeg"}), root)
    return Recording(
        name=root.resolve().name,
        root=root,
        camera=camera,
        depth_scale_m=check_positive("depth_scale_m", scale_m, root),
        files=tuple(
            FrameFiles(i / fps, path, color)
            for i, (path, color) in enumerate(zip(depth, colors, strict=True))
        ),
    )


def _images(folder: Path, suffixes: set[str]) -> list[Path]:
    if not folder.is_dir():
        return []
    return sorted((p for p in folder.iterdir() if p.suffix.lower() in suffixes), key=_name_key)


def _name_key(path: Path) -> list[tuple[int, str]]:
    return [
        (int(part or 0), "") if part.isdigit() else (-1, part)
        for part in re.split(r"([0-9]+)", path.stem)
    ]


def _pair(depth: list[Path], colors: list[Path], root: Path) -> list[Path | None]:
    by_stem = {path.stem: path for path in colors}
    if not colors or any(path.stem in by_stem for path in depth):
        return [by_stem.get(path.stem) for path in depth]
    if len(colors) != len(depth):
        raise SequenceError(
            f"{root}: {len(colors)} images in color/ cannot be paired with {len(depth)} in depth/; "
            "allowed: common file stems, or as many of one as of the other"
        )
    return list(colors)
