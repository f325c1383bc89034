# SPDX-License-Identifier: Apache-2.0
"""What a depth camera gives at one instant, and the seam behind which all formats hide."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np
from jaxtyping import Float, UInt8
from numpy import ndarray

from kintrack.geometry import PinholeCamera


@dataclass(frozen=True)
class Frame:
    """One depth image with its time; colour and labels where the recording has them."""

    index: int
    """Position in the recording, from 0; counts bad frames too."""
    timestamp_s: float
    """Time stamp [s]."""
    camera: PinholeCamera
    """Camera of the depth image."""
    depth_m: Float[ndarray, "h w"] | None
    """Depth along z [m], float32, 0 = no reading; None if the frame could not be read."""
    color: UInt8[ndarray, "h w 3"] | None = None
    """Colour registered to depth, R G B; None if there is none."""
    labels: UInt8[ndarray, "h2 w2"] | None = None
    """True part labels, any size with the depth's aspect; None if there are none."""
    problem: str | None = None
    """Why the frame is unusable; None for a good frame."""


def readable(frame: Frame) -> Frame:
    """The frame with 0 for every depth that is no reading: negative, infinite, or ROS's NaN."""
    depth = frame.depth_m
    if depth is None or bool(np.all((depth >= 0.0) & (depth < np.inf))):
        return frame
    return replace(frame, depth_m=np.where((depth >= 0.0) & (depth < np.inf), depth, 0.0))


class SequenceReader(Protocol):
    """A recording of one depth camera. Opening one checks everything but the images."""

    name: str
    """Short name for tables and windows."""
    root: Path
    """Folder of the recording."""
    camera: PinholeCamera
    """Camera of the depth images."""

    def __len__(self) -> int:
        """How many frames the index lists."""
        ...

    def __iter__(self) -> Iterator[Frame]:
        """Frames in time order; a bad one comes with `problem` set instead of an exception."""
        ...

    def frame(self, index: int) -> Frame:
        """The frame at `index`, 0 <= index < len."""
        ...
