# SPDX-License-Identifier: Apache-2.0
"""A frame reduced to 192 x 159, 1.5 times the network's size, so that a crop stays sharp."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Float, UInt8
from numba import njit
from numpy import ndarray

from kintrack.errors import DatasetError
from kintrack.sequence.frame import Frame
from segmentation.labels import BACKGROUND, IGNORED, LABELS
from segmentation.preprocess import cell_bounds

WIDTH, HEIGHT = 192, 159
"""Largest picture [px]."""


class Picture(NamedTuple):
    """A small RGB-D picture with its labels."""

    depth_m: Float[ndarray, "h w"]
    """Depth along z [m], 0 = no reading."""
    color: UInt8[ndarray, "h w 3"] | None
    """R G B; None if there is none."""
    labels: UInt8[ndarray, "h w"]
    """Part labels; background where there is no reading."""
    focal_px: float
    """Focal length in its own pixels [px]."""


def reduced(
    depth_m: Float[ndarray, "h w"],
    color: UInt8[ndarray, "h w 3"] | None,
    labels: UInt8[ndarray, "h2 w2"],
    focal_px: float,
) -> Picture:
    """A frame at the size in which it is packed.

    Depth is a reading that was there, the lower median of a cell's, as in `preprocess.py`; labels
    are the most frequent of a cell's readings, of equals that of the reading taken, so that both
    show one surface. A frame smaller than a pack's pictures is kept as it is.

    Args:
        depth_m: Depth [m], finite, 0 = no reading, shape (h, w).
        color: R G B of the same size, or None.
        labels: 0 to 6 or `IGNORED`, in any size with that aspect.
        focal_px: Focal length [px].
    """
    height, width = depth_m.shape
    scale = min(WIDTH / width, HEIGHT / height, 1.0)
    columns, rows = max(1, round(width * scale)), max(1, round(height * scale))
    depth = np.zeros((rows, columns), dtype=np.float32)
    votes = np.full((rows, columns), BACKGROUND, dtype=np.uint8)
    _reduce(np.ascontiguousarray(depth_m, dtype=np.float32), labels, depth, votes)
    if color is not None:
        color = np.asarray(cv2.resize(color, (columns, rows), interpolation=cv2.INTER_AREA))
    return Picture(depth, color, votes, focal_px * columns / width)


def checked(frame: Frame, where: object) -> None:
    """Pass if depth and labels of a frame are what they must be.

    Raises:
        DatasetError: if depth is negative or not finite, or a label is unknown.
    """
    assert frame.depth_m is not None and frame.labels is not None
    wrong = ~(np.isfinite(frame.depth_m) & (frame.depth_m >= 0))
    if wrong.any():
        raise DatasetError(f"{where}, frame {frame.index}: depth = {frame.depth_m[wrong][0]} m; "
                           "finite values are needed, 0 for no reading")  # fmt: skip
    unknown = (frame.labels >= len(LABELS)) & (frame.labels != IGNORED)
    if unknown.any():
        raise DatasetError(f"{where}, frame {frame.index}: label {frame.labels[unknown][0]}; "
                           f"0 to {len(LABELS) - 1} are known")  # fmt: skip


@njit(cache=True, nogil=True)
def keep_sorted(depths, labels, count, depth, label):
    """Put a reading with its label among the first `count`, which ascend in depth."""
    k = count
    while k > 0 and depths[k - 1] > depth:
        depths[k], labels[k] = depths[k - 1], labels[k - 1]
        k -= 1
    depths[k], labels[k] = depth, label


@njit(cache=True, nogil=True)
def most_frequent(labels, count):
    """The most frequent of the first labels; of equals the middle one's, else the first's."""
    best, most = labels[0], 0
    for k in range(-1, count):
        label, votes = labels[(count - 1) // 2 if k < 0 else k], 0
        for m in range(count):
            votes += labels[m] == label
        if votes > most:
            best, most = label, votes
    return best


@njit(cache=True, nogil=True)
def _reduce(depth, labels, out, votes):
    height, width = depth.shape
    rows, columns = out.shape
    tall, wide = labels.shape
    most = (height // rows + 2) * (width // columns + 2)
    found, seen = np.empty(most, dtype=np.float32), np.empty(most, dtype=np.uint8)
    for i in range(rows):
        v0, v1 = cell_bounds(i, rows, height)
        for j in range(columns):
            u0, u1 = cell_bounds(j, columns, width)
            n = 0
            unread = np.uint8(BACKGROUND)
            for v in range(v0, v1):
                y = (2 * v + 1) * tall // (2 * height)
                for u in range(u0, u1):
                    label, d = labels[y, (2 * u + 1) * wide // (2 * width)], depth[v, u]
                    if d <= 0.0:
                        unread = label if label == IGNORED else unread
                        continue
                    keep_sorted(found, seen, n, d, label)
                    n += 1
            if n > 0 and 2 * n >= (v1 - v0) * (u1 - u0):
                out[i, j], votes[i, j] = found[(n - 1) // 2], most_frequent(seen, n)
            else:
                votes[i, j] = unread
