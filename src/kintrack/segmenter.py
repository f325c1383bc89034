# SPDX-License-Identifier: Apache-2.0
"""The seam behind which the part segmentation hides: a frame in, a label map out."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from jaxtyping import Float, UInt8
from numpy import ndarray

from kintrack.errors import SegmenterError
from kintrack.geometry import LABELS, PinholeCamera
from kintrack.sequence.frame import Frame

LEAST_SIDE = 16
"""A label map has at least so many rows and columns."""


class Region(NamedTuple):
    """Where a person is in an image."""

    center_px: tuple[float, float]
    """Middle of what may be seen of her (u, v) [px]."""
    depth_m: float
    """How far she is [m]."""


class Segmenter(Protocol):
    """Says of every pixel of a frame which part of the person it shows, if any."""

    @property
    def name(self) -> str:
        """What it is, for the result's summary."""
        ...

    def segment(self, frame: Frame, region: Region | None = None) -> UInt8[ndarray, "*guess r c"]:
        """Label map that covers the whole image, in any size with the image's aspect.

        Two of them, shape (2, R, C), also say what each label would be if it were not the first:
        the first again where that is beyond doubt. With a region, nobody will ask about people
        elsewhere.
        """
        ...


class Watched:
    """A segmenter that remembers the labels of the last frame."""

    def __init__(self, segmenter: Segmenter):
        """Watch a segmenter."""
        self._segmenter = segmenter
        self.last: UInt8[ndarray, "*guess r c"] | None = None

    @property
    def name(self) -> str:
        """What the segmenter is."""
        return self._segmenter.name

    def segment(self, frame: Frame, region: Region | None = None) -> UInt8[ndarray, "*guess r c"]:
        """What the segmenter says."""
        self.last = self._segmenter.segment(frame, region)
        return self.last


class Told:
    """A segmenter that says what another one was last heard to say."""

    def __init__(self, watched: Watched):
        """Listen to one."""
        self._watched = watched

    @property
    def name(self) -> str:
        """What the other one is."""
        return self._watched.name

    def segment(self, frame: Frame, region: Region | None = None) -> UInt8[ndarray, "*guess r c"]:
        """Its last labels, which must be the frame's."""
        assert self._watched.last is not None
        return self._watched.last


def region_of(points_camera: Float[ndarray, "n 3"], camera: PinholeCamera) -> Region | None:
    """Where somebody is whose joints are known.

    Args:
        points_camera: Joint centres [m], camera frame.
        camera: The camera.

    Returns:
        The region; None if not all of her is before the camera.
    """
    z = points_camera[:, 2]
    if not (z > 0).all():
        return None
    pixels = points_camera[:, :2] / z[:, None] * (camera.fx, camera.fy) + (camera.cx, camera.cy)
    inside = (pixels >= 0) & (pixels < (camera.width, camera.height))
    seen = inside.all(axis=1)
    if not seen.any():
        return None
    u, v = 0.5 * (pixels[seen].min(axis=0) + pixels[seen].max(axis=0))
    return Region((float(u), float(v)), float(np.median(z[seen])))


def checked_labels(
    segmenter: Segmenter, frame: Frame, region: Region | None = None
) -> UInt8[ndarray, "*guess r c"]:
    """What a segmenter says of a frame, once it is known to be a label map of it.

    Args:
        segmenter: Any segmenter.
        frame: A good frame.
        region: Where the person is; None if that is not known.

    Returns:
        Labels 0 to 6, shape (R, C) or (2, R, C), spread over the whole image.

    Raises:
        SegmenterError: if type, size or a value is wrong.
    """
    labels = segmenter.segment(frame, region)
    who = f"{type(segmenter).__name__} returned for frame {frame.index}"
    shaped = isinstance(labels, ndarray) and (labels.ndim == 2 or labels.shape[:-2] == (2,))
    if not shaped or labels.dtype != np.uint8:
        kind = (
            f"shape {labels.shape} in {labels.dtype}"
            if isinstance(labels, ndarray)
            else type(labels).__name__
        )
        raise SegmenterError(
            f"{who} {kind}: labels (rows, columns) or (2, rows, columns) in uint8 are needed"
        )
    (rows, columns), camera = labels.shape[-2:], frame.camera
    off = abs(rows * camera.width - columns * camera.height)
    if min(rows, columns) < LEAST_SIDE or off > max(camera.width, camera.height):
        raise SegmenterError(
            f"{who} {columns} x {rows} labels: they must cover the image of {camera.width} x "
            f"{camera.height} px with its aspect, and be at least {LEAST_SIDE} a side"
        )
    highest = int(labels.max())
    if highest >= len(LABELS):
        raise SegmenterError(f"{who} label {highest}: 0 to {len(LABELS) - 1} are known")
    return labels
