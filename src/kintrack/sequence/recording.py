# SPDX-License-Identifier: Apache-2.0
"""A recording whose frames are image files: what every folder format is opened as."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from jaxtyping import UInt8
from numpy import ndarray

from kintrack.errors import FrameError, SequenceError
from kintrack.geometry import PinholeCamera
from kintrack.sequence.frame import Frame
from kintrack.sequence.images import read_color, read_depth, read_labels
from kintrack.sequence.reference import REFERENCE_FILE

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class FrameFiles:
    """Where one frame lies on disk."""

    timestamp_s: float
    """Time stamp [s]."""
    depth: Path
    """The depth image; it may be missing."""
    color: Path | None = None
    """The colour image; None if the recording has none for this frame."""
    labels: Path | None = None
    """The true labels; None if the recording has none for this frame."""


@dataclass(frozen=True)
class Recording:
    """Frames read from their files on demand; nothing is kept.

    Depth and labels must be readable for a frame to be good. An unreadable colour image costs
    only the colour and a warning in the log, since depth alone is enough everywhere.
    """

    name: str
    """Short name for tables and windows."""
    root: Path
    """Folder of the recording."""
    camera: PinholeCamera
    """Camera of the depth images."""
    depth_scale_m: float
    """Metres per unit of the depth images."""
    files: tuple[FrameFiles, ...]
    """The frames in time order."""

    @property
    def reference_joints_path(self) -> Path | None:
        """`reference_joints.csv` of the recording; None if it has none."""
        path = self.root / REFERENCE_FILE
        return path if path.is_file() else None

    def __len__(self) -> int:
        """How many frames the index lists."""
        return len(self.files)

    def __iter__(self) -> Iterator[Frame]:
        """Frames in time order; a bad one comes with `problem` set instead of an exception."""
        return map(self.frame, range(len(self)))

    def frame(self, index: int) -> Frame:
        """The frame at `index`.

        Args:
            index: Position in the recording, 0 <= index < len.

        Returns:
            The frame; `depth_m` is None and `problem` says why if it is unusable.

        Raises:
            SequenceError: if there is no such frame.
        """
        if not 0 <= index < len(self):
            raise SequenceError(f"frame {index} of {self.root}: allowed are 0 to {len(self) - 1}")
        files = self.files[index]
        try:
            return Frame(
                index=index,
                timestamp_s=files.timestamp_s,
                camera=self.camera,
                depth_m=read_depth(files.depth, self.camera, self.depth_scale_m),
                labels=read_labels(files.labels, self.camera) if files.labels else None,
                color=self._color(files.color),
            )
        except FrameError as error:
            return Frame(index, files.timestamp_s, self.camera, depth_m=None, problem=str(error))

    def _color(self, path: Path | None) -> UInt8[ndarray, "h w 3"] | None:
        if path is None:
            return None
        try:
            return read_color(path, self.camera)
        except FrameError as error:
            log.warning("frame without colour: %s", error)
            return None
