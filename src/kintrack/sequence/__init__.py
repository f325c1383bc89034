# SPDX-License-Identifier: Apache-2.0
"""Recordings of a depth camera, whatever format they come in."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from kintrack.errors import SequenceError
from kintrack.sequence.azure import open_azure
from kintrack.sequence.folder import open_folder
from kintrack.sequence.frame import Frame, SequenceReader
from kintrack.sequence.recording import Recording
from kintrack.sequence.tum import open_tum

__all__ = ["Frame", "SequenceReader", "open_sequence"]


@dataclass(frozen=True)
class _Format:
    needs: tuple[str, ...]
    open: Callable[..., Recording]
    has_time_stamps: bool = True


_FORMATS = {
    "folder": _Format(("camera.json", "depth.txt"), open_folder),
    "tum": _Format(("depth.txt", "rgb.txt"), open_tum),
    "azure": _Format(("intrinsic.json", "depth/"), open_azure, has_time_stamps=False),
}
"""Every format; "auto" takes the first whose files are there."""


def open_sequence(
    path: Path | str,
    *,
    format: str = "auto",
    camera: Path | None = None,
    depth_scale_m: float | None = None,
    fps: float | None = None,
) -> SequenceReader:
    """Open a recording; what is given here counts before what the folder says.

    Args:
        path: The folder.
        format: "folder", "tum", "azure", or "auto" to decide by the files present.
        camera: Camera file, `camera.json` or Open3D's `intrinsic.json`; "tum" requires it.
        depth_scale_m: Metres per unit of the depth images.
        fps: Frames per second of a format without time stamps ("azure") [hz].

    Returns:
        The reader; frames are read when they are asked for.

    Raises:
        SequenceError: if the folder cannot be opened; the message says what is needed.
    """
    root = Path(path)
    if format not in ("auto", *_FORMATS):
        raise SequenceError(f"format = {format!r}; allowed: auto, {', '.join(_FORMATS)}")
    if not root.is_dir():
        found = "is a file" if root.exists() else "does not exist"
        raise SequenceError(f"{root} {found}; needed: a sequence folder. {_all_needs(root)}")
    name = _detect(root) if format == "auto" else format
    rate = {} if fps is None else {"fps": fps}
    if rate and _FORMATS[name].has_time_stamps:
        untimed = ", ".join(key for key, value in _FORMATS.items() if not value.has_time_stamps)
        raise SequenceError(
            f"fps = {fps!r} does not apply to {root}: its format, {name!r}, has time stamps; "
            f"formats that take fps: {untimed}"
        )
    recording = _FORMATS[name].open(root, camera_path=camera, depth_scale_m=depth_scale_m, **rate)
    return cast(SequenceReader, recording)  # frozen, while the protocol's fields are settable


def _detect(root: Path) -> str:
    for name, candidate in _FORMATS.items():
        if all((root / need).exists() for need in candidate.needs):
            return name
    found = "is empty" if not any(root.iterdir()) else "is of no known format"
    raise SequenceError(f"{root} {found}. {_all_needs(root)}")


def _all_needs(root: Path) -> str:
    def show(need: str) -> str:
        return need if (root / need).exists() else f"{need} (missing)"

    return "Formats: " + "; ".join(
        f"{name} needs {' and '.join(map(show, candidate.needs))}"
        for name, candidate in _FORMATS.items()
    )
