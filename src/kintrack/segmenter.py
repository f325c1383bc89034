# SPDX-License-Identifier: Apache-2.0
"""The seam behind which the part segmentation hides: a frame in, a label map out."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from jaxtyping import UInt8
from numpy import ndarray

from kintrack.errors import SegmenterError
from kintrack.geometry import LABELS
from kintrack.sequence.frame import Frame

LEAST_SIDE = 16
"""A label map has at least so many rows and columns."""


class Segmenter(Protocol):
    """Says of every pixel of a frame which part of the person it shows, if any."""

    @property
    def name(self) -> str:
        """What it is, for the result's summary."""
        ...

    def segment(self, frame: Frame) -> UInt8[ndarray, "r c"]:
        """Label map that covers the whole image, in any size with the image's aspect."""
        ...


def checked_labels(segmenter: Segmenter, frame: Frame) -> UInt8[ndarray, "r c"]:
    """What a segmenter says of a frame, once it is known to be a label map of it.

    Args:
        segmenter: Any segmenter.
        frame: A good frame.

    Returns:
        Labels 0 to 6, shape (R, C), spread over the whole image.

    Raises:
        SegmenterError: if type, size or a value is wrong.
    """
    labels = segmenter.segment(frame)
    who = f"{type(segmenter).__name__} returned for frame {frame.index}"
    if not isinstance(labels, ndarray) or labels.ndim != 2 or labels.dtype != np.uint8:
        kind = (
            f"shape {labels.shape} in {labels.dtype}"
            if isinstance(labels, ndarray)
            else type(labels).__name__
        )
        raise SegmenterError(f"{who} {kind}: labels (rows, columns) in uint8 are needed")
    (rows, columns), camera = labels.shape, frame.camera
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
