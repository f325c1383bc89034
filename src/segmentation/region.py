# SPDX-License-Identifier: Apache-2.0
"""The part of an image around a person, at one size for all people: where a closer look is taken.

A person 4 m away covers a tenth of the network's picture, one at 0.8 m more than all of it. The
window is as high as a standing person needs wherever she is, so that a network sees everybody at
nearly one scale. It may reach beyond the image; what lies outside is bar.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8
from numpy import ndarray

from kintrack.people import CUT_SHARE, cut_by_side
from kintrack.segmenter import Region
from segmentation.labels import INPUT_HEIGHT, INPUT_WIDTH
from segmentation.preprocess import MIN_SIDE_PX, Letterbox

WINDOW_M = 2.2
"""Height of the window at the person [m]: a tall person and some room."""
FINEST = 1.5
"""Network cells per pixel, at most."""
LEAST_AREA_M2 = 0.02
"""A smaller patch is nobody: half a face [m^2]."""
REACH_M, BEHIND_M = 1.3, 0.7
"""What lies so far beside, and so far before or behind, the largest patch is hers too [m]."""


class Window(NamedTuple):
    """The piece of an image that a region's window shows, and where it lies in the picture."""

    rows: slice
    """Rows of the image."""
    columns: slice
    """Columns of the image."""
    fit: Letterbox
    """Where that piece lies in the network's picture."""


def cells_per_pixel(depth_m: float, focal_px: float) -> float:
    """Scale of the window for a person at this distance."""
    return min(INPUT_HEIGHT * depth_m / (WINDOW_M * focal_px), FINEST)


def window(region: Region, width: int, height: int, focal_px: float) -> Window | None:
    """The window of a region in an image of this size; None if hardly any of it is in the image.

    Args:
        region: Where the person is.
        width: Image width [px].
        height: Image height [px].
        focal_px: Focal length [px].
    """
    scale = cells_per_pixel(region.depth_m, focal_px)
    spans = []
    for middle, cells, size in zip(
        region.center_px, (INPUT_WIDTH, INPUT_HEIGHT), (width, height), strict=True
    ):
        begin = middle + 0.5 - 0.5 * cells / scale
        first = max(0, math.ceil(begin))
        last = min(size, math.floor(begin + cells / scale))
        if last - first < MIN_SIDE_PX:
            return None
        count = min(cells, max(1, round((last - first) * scale)))
        place = min(cells - count, max(0, round((first - begin) * scale)))
        spans.append((first, last, count, place))
    (u0, u1, columns, left), (v0, v1, rows, top) = spans
    fit = Letterbox(u1 - u0, v1 - v0, columns, rows, left, top)
    return Window(slice(v0, v1), slice(u0, u1), fit)


def region_of_person(
    labels: UInt8[ndarray, "r c"], depth_m: Float[ndarray, "h w"], focal_px: float
) -> Region | None:
    """Where the person is whom labels show most of, preferably one whom no side of the image cuts.

    Objects in front cut people in pieces: what is labelled near the largest patch counts as hers.

    Args:
        labels: Label map that covers the whole image.
        depth_m: Depth [m], 0 = no reading.
        focal_px: Focal length [px].

    Returns:
        The region; None if no patch is larger than `LEAST_AREA_M2`, or the largest has nothing near
        its own middle and depth: a ring around somebody else.
    """
    (h, w), (r, c) = depth_m.shape, labels.shape
    rows, columns = (2 * np.arange(r) + 1) * h // (2 * r), (2 * np.arange(c) + 1) * w // (2 * c)
    depth = depth_m[rows].take(columns, axis=1)
    person = (labels > 0) & (depth > 0)
    patch = _largest(person, depth * (w / c) / focal_px)
    if patch is None:
        return None
    own = float(np.median(depth[patch]))
    cell_m = own * (w / c) / focal_px
    v, u = np.nonzero(person & (np.abs(depth - own) < BEHIND_M))
    middle_v, middle_u = (np.median(x) for x in np.nonzero(patch))
    near = np.hypot(v - middle_v, u - middle_u) * cell_m < REACH_M
    if not near.any():
        return None
    low, high = np.percentile(np.stack([u, v])[:, near], (2, 98), axis=1)
    center = 0.5 * (low + high)
    return Region(
        ((center[0] + 0.5) * w / c - 0.5, (center[1] + 0.5) * h / r - 0.5),
        float(np.median(depth[v[near], u[near]])),
    )


def _largest(
    person: Bool[ndarray, "r c"], cell_m: Float[ndarray, "r c"]
) -> Bool[ndarray, "r c"] | None:
    """The connected patch that covers most square metres, those at the sides counting less."""
    count, patches = cv2.connectedComponents(person.astype(np.uint8))
    areas = np.bincount(patches.ravel(), (cell_m.ravel().astype(float)) ** 2, count)
    areas[0] = 0.0
    areas[areas < LEAST_AREA_M2] = 0.0
    for number in np.flatnonzero(areas):
        if cut_by_side(patches == number):
            areas[number] *= CUT_SHARE
    best = int(areas.argmax())
    return np.asarray(patches == best) if areas[best] > 0 else None
