# SPDX-License-Identifier: Apache-2.0
"""From any camera's images to the network's picture of 128 x 106, and labels back.

The whole image is fitted in, aspect kept; bars fill the rest. The depth plane holds

    D = ln((d / f) / (d_0 / f_0)) / s,   f and f_0 in pixels of the network's picture,

the logarithm of the metres that one pixel spans. It says how large a person is in the picture
whatever the focal length, and moving a scene away, or another lens, only adds a constant: the
relief of a surface, which is a ratio of depths, stays, and is enlarged (`relief.py`). A hole is
`HOLE`, beyond every reading.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Float, UInt8
from numba import njit
from numpy import ndarray

from kintrack.geometry import LABELS
from kintrack.sequence.frame import Frame
from segmentation.errors import InputError
from segmentation.labels import IGNORED, INPUT_CHANNELS, INPUT_HEIGHT, INPUT_WIDTH
from segmentation.relief import add_relief

REFERENCE_DEPTH_M = 2.5
"""d_0: a person a Kinect v2 sees from head to foot stands about here; D is 0 [m]."""
REFERENCE_FOCAL_PX = 91.25
"""f_0: a Kinect v2 (365 px at a width of 512) at the network's size [px]."""
DEPTH_SCALE = 0.4
"""s: spread of ln d over a room, so that D has a variance of about 1."""
NEAREST, FARTHEST = -4.0, 3.5
"""Readings are clipped to this D: 0.5 to 10.1 m for a Kinect v2."""
HOLE = 4.0
"""D where there is no reading, and in the bars."""
COLOR_MIDDLE, COLOR_SCALE = 127.5, 64.0
"""A colour plane is (value - middle) / scale; all 0 means that there is no colour."""

SPECIFICATION = "RGBD 128x106, metres per pixel, relief, version 2"
"""Names all of the above; goes into weights files, since weights fit only one of them."""

MIN_SIDE_PX = 16
"""A depth image has at least so many rows and columns [px]."""
SAMPLES = 3
"""A cell is judged by at most so many rows and columns of its pixels."""


class Letterbox(NamedTuple):
    """Where the image lies in the network's picture; a row or column of cells outside is bar."""

    width: int
    """Image width [px]."""
    height: int
    """Image height [px]."""
    columns: int
    """Cells across the image."""
    rows: int
    """Cells down the image."""
    left: int
    """Column of the image's first cell."""
    top: int
    """Row of the image's first cell."""

    @property
    def scale(self) -> float:
        """Cells per pixel."""
        return self.columns / self.width


def letterbox(width: int, height: int) -> Letterbox:
    """Fit an image of this size into the network's picture.

    Raises:
        InputError: if a side is below `MIN_SIDE_PX`.
    """
    if min(width, height) < MIN_SIDE_PX:
        raise InputError(f"an image of {width} x {height} px: at least {MIN_SIDE_PX} x "
                         f"{MIN_SIDE_PX} are needed")  # fmt: skip
    scale = min(INPUT_WIDTH / width, INPUT_HEIGHT / height)
    columns, rows = max(1, round(width * scale)), max(1, round(height * scale))
    left, top = (INPUT_WIDTH - columns) // 2, (INPUT_HEIGHT - rows) // 2
    return Letterbox(width, height, columns, rows, left, top)


def frame_input(frame: Frame) -> Float[ndarray, "4 106 128"]:
    """The network's input for a frame of a recording.

    Raises:
        InputError: if the frame has no depth, or see `network_input`.
    """
    if frame.depth_m is None:
        raise InputError(f"frame {frame.index} has no depth: {frame.problem}")
    try:
        return network_input(frame.depth_m, frame.camera.fx, frame.color)
    except InputError as error:
        raise InputError(f"frame {frame.index}: {error}") from None


def network_input(
    depth_m: Float[ndarray, "h w"],
    focal_px: float,
    color: UInt8[ndarray, "h w 3"] | None = None,
    fit: Letterbox | None = None,
) -> Float[ndarray, "4 106 128"]:
    """The network's input for one depth image, with or without colour.

    A cell takes the lower median of its readings: a reading that was there, so that two surfaces
    are never averaged into one between them. It is a hole where more than half of them are.

    Args:
        depth_m: Depth along z [m], 0 = no reading, shape (H, W).
        focal_px: Focal length along u in pixels of that image [px].
        color: R G B registered to depth, shape (H, W, 3).
        fit: Where the image lies in the picture; None fills as much of it as the image can.

    Returns:
        Planes R, G, B, D as float32, shape (4, 106, 128).

    Raises:
        InputError: if a size, a type or a value is not as above.
    """
    depth = _checked_depth(depth_m)
    if not (math.isfinite(focal_px) and focal_px > 0):
        raise InputError(f"focal length = {focal_px!r} px: above 0 is needed")
    fit = letterbox(depth.shape[1], depth.shape[0]) if fit is None else fit
    if (fit.height, fit.width) != depth.shape:
        raise InputError(f"depth of shape {depth.shape} for a letterbox of {fit.width} x "
                         f"{fit.height} px: they must be the same size")  # fmt: skip
    out = np.zeros((len(INPUT_CHANNELS), INPUT_HEIGHT, INPUT_WIDTH), dtype=np.float32)
    unit = REFERENCE_DEPTH_M * focal_px * fit.scale / REFERENCE_FOCAL_PX
    plane = np.full((INPUT_HEIGHT, INPUT_WIDTH), HOLE, dtype=np.float32)
    _fill_depth(depth, fit, unit, plane)
    add_relief(plane, FARTHEST, out[3])
    if color is not None:
        if color.shape != (*depth.shape, 3) or color.dtype != np.uint8:
            raise InputError(
                f"colour of shape {color.shape} and type {color.dtype} with depth of shape "
                f"{depth.shape}: (height, width, 3) of the same size in uint8 is needed"
            )
        small = cv2.resize(color, (fit.columns, fit.rows), interpolation=cv2.INTER_AREA)
        inside = out[:3, fit.top : fit.top + fit.rows, fit.left : fit.left + fit.columns]
        np.multiply(small.transpose(2, 0, 1), 1.0 / COLOR_SCALE, out=inside, dtype=np.float32)
        inside -= COLOR_MIDDLE / COLOR_SCALE
    return out


def labels_to_image(
    labels: UInt8[ndarray, "106 128"], width: int, height: int
) -> UInt8[ndarray, "h w"]:
    """Labels of every pixel of the image from those of the network's picture."""
    if labels.shape != (INPUT_HEIGHT, INPUT_WIDTH):
        raise InputError(f"labels of shape {labels.shape}: ({INPUT_HEIGHT}, {INPUT_WIDTH}) needed")
    fit = letterbox(width, height)
    rows = (2 * np.arange(height) + 1) * fit.rows // (2 * height) + fit.top
    columns = (2 * np.arange(width) + 1) * fit.columns // (2 * width) + fit.left
    return labels[rows].take(columns, axis=1)


def labels_to_network(labels: UInt8[ndarray, "h w"]) -> UInt8[ndarray, "106 128"]:
    """The most frequent label of every cell, the lowest of equals; `IGNORED` in the bars.

    Args:
        labels: True labels 0 to 6, or `IGNORED`, in any size, shape (H, W).

    Raises:
        InputError: if there is another value, or the shape or type is wrong.
    """
    if labels.ndim != 2 or labels.dtype != np.uint8:
        raise InputError(f"labels of shape {labels.shape} and type {labels.dtype}: (height, width) "
                         "in uint8 is needed")  # fmt: skip
    wrong = (labels >= len(LABELS)) & (labels != IGNORED)
    if wrong.any():
        raise InputError(f"label {labels[wrong][0]}: 0 to {len(LABELS) - 1} are known, "
                         f"{IGNORED} is for pixels to ignore")  # fmt: skip
    out = np.full((INPUT_HEIGHT, INPUT_WIDTH), IGNORED, dtype=np.uint8)
    _fill_labels(labels, letterbox(labels.shape[1], labels.shape[0]), out)
    return out


def _checked_depth(depth_m: ndarray) -> Float[ndarray, "h w"]:
    """The same image as contiguous float32, once it is known to be depth."""
    if depth_m.ndim != 2 or not np.issubdtype(depth_m.dtype, np.floating):
        raise InputError(f"depth of shape {depth_m.shape} and type {depth_m.dtype}: (height, "
                         "width) in metres as floats is needed")  # fmt: skip
    depth = np.ascontiguousarray(depth_m, dtype=np.float32)
    if _count_suspect(depth.reshape(-1).view(np.int32)):
        wrong = depth[~((depth >= 0) & (depth < np.inf))]
        if len(wrong):
            raise InputError(f"depth = {wrong[0]} m, one of {len(wrong)} such pixels: 0 marks a "
                             "hole, all else must be finite and positive")  # fmt: skip
    return depth


@njit(cache=True)
def _count_suspect(bits):
    """How many float32 are negative, infinite or NaN, by their bits: several a cycle."""
    count = 0
    for i in range(bits.size):
        count += bits[i] < 0 or bits[i] >= 0x7F800000
    return count


@njit(cache=True, nogil=True)
def cell_bounds(i, cells, pixels):
    """The range of pixels whose centre lies in cell i, or of the one in which its centre lies."""
    if pixels < cells:
        first = (2 * i + 1) * pixels // (2 * cells)
        return first, first + 1
    double = 2 * cells
    first, last = 2 * i * pixels + cells - 1, 2 * (i + 1) * pixels + cells - 1
    return first // double, last // double


@njit(cache=True)
def cell_samples(cells, pixels):
    """Evenly spread pixels of every cell along one axis, and how many there are of them."""
    at = np.zeros((cells, SAMPLES), dtype=np.int64)
    count = np.empty(cells, dtype=np.int64)
    for i in range(cells):
        first, last = cell_bounds(i, cells, pixels)
        count[i] = min(SAMPLES, last - first)
        for k in range(count[i]):
            at[i, k] = first + (2 * k + 1) * (last - first) // (2 * count[i])
    return at, count


@njit(cache=True)
def _fill_depth(depth, fit, unit, out):
    rows, down = cell_samples(fit.rows, fit.height)
    columns, across = cell_samples(fit.columns, fit.width)
    found = np.empty(SAMPLES * SAMPLES, dtype=np.float32)
    for i in range(fit.rows):
        for j in range(fit.columns):
            found[:] = np.inf
            n = 0
            for a in range(down[i]):
                for b in range(across[j]):
                    d = depth[rows[i, a], columns[j, b]]
                    n += d > 0.0
                    x = d if d > 0.0 else np.float32(np.inf)
                    for k in range(found.size):
                        low = min(found[k], x)
                        x = max(found[k], x)
                        found[k] = low
            if n > 0 and 2 * n >= down[i] * across[j]:
                D = math.log(found[(n - 1) // 2] / unit) / DEPTH_SCALE
                out[fit.top + i, fit.left + j] = min(max(D, NEAREST), FARTHEST)


@njit(cache=True)
def _fill_labels(labels, fit, out):
    for i in range(fit.rows):
        v0, v1 = cell_bounds(i, fit.rows, fit.height)
        for j in range(fit.columns):
            u0, u1 = cell_bounds(j, fit.columns, fit.width)
            votes = np.zeros(256, dtype=np.int64)
            best = labels[v0, u0]
            for v in range(v0, v1):
                for u in range(u0, u1):
                    votes[labels[v, u]] += 1
            for label in range(256):
                if votes[label] > votes[best] or (votes[label] == votes[best] and label < best):
                    best = np.uint8(label)
            out[fit.top + i, fit.left + j] = best
