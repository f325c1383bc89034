# SPDX-License-Identifier: Apache-2.0
"""Zoom, shift, roll and mirroring of a picture, sampled at the network's size.

Magnifying a picture is using a longer lens: depths stay, the focal length grows with the zoom, and
the network's depth plane, metres per pixel, follows from both.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, Int, UInt8
from numba import njit
from numpy import ndarray

from segmentation.labels import BACKGROUND, IGNORED, INPUT_HEIGHT, INPUT_WIDTH, MIRRORED
from segmentation.picture import Picture, keep_sorted, most_frequent
from segmentation.preprocess import REFERENCE_DEPTH_M, letterbox
from segmentation.region import cells_per_pixel

WINDOWS = ((512, 424), (640, 480), (640, 576), (1280, 720))
"""Images of usual cameras; all but the first leave bars in the network's picture."""


@dataclass(frozen=True)
class Warp:
    """A similarity from the network's picture into a picture."""

    zoom: float
    """Network pixels per picture pixel."""
    center: tuple[float, float]
    """Picture point (u, v) that lands in the middle [px]."""
    roll_rad: float = 0.0
    """Turn of the camera about its axis."""
    mirrored: bool = False
    """Whether left and right are swapped."""
    window: tuple[int, int] = (INPUT_WIDTH, INPUT_HEIGHT)
    """Columns and rows in the middle that are not bar."""

    @property
    def matrix(self) -> Float[ndarray, "2 3"]:
        """Maps network pixels (u, v, 1) to picture pixels."""
        c, s = math.cos(self.roll_rad) / self.zoom, math.sin(self.roll_rad) / self.zoom
        flip = -1.0 if self.mirrored else 1.0
        A = np.array([[flip * c, -s], [flip * s, c]])
        middle = 0.5 * np.array([INPUT_WIDTH - 1, INPUT_HEIGHT - 1])
        return np.hstack([A, (np.array(self.center) - A @ middle)[:, None]])


def whole(picture: Picture) -> Warp:
    """The warp that shows a picture as `network_input` would."""
    rows, columns = picture.depth_m.shape
    zoom = min(INPUT_WIDTH / columns, INPUT_HEIGHT / rows)
    window = max(1, round(columns * zoom)), max(1, round(rows * zoom))
    return Warp(zoom, (0.5 * (columns - 1), 0.5 * (rows - 1)), window=window)


def draw_warp(
    picture: Picture,
    rng: np.random.Generator,
    zooms: tuple[float, float],
    roll_deg: float,
    at: tuple[float, float] | None = None,
) -> Warp:
    """Draw a view of a picture that stays inside of it as far as it can.

    Args:
        picture: The picture.
        rng: Draws.
        zooms: Least and greatest magnification.
        roll_deg: Standard deviation of the roll [deg]; half of the views have none.
        at: Point (u, v) that is looked at; any if None.
    """
    rows, columns = picture.depth_m.shape
    zoom = math.exp(rng.uniform(math.log(zooms[0]), math.log(zooms[1])))
    zoom *= min(INPUT_WIDTH / columns, INPUT_HEIGHT / rows)
    shape = WINDOWS[rng.choice(len(WINDOWS), p=(0.5, 0.3, 0.1, 0.1))]
    fit = letterbox(*shape)
    aim = at or (rng.uniform(0, columns), rng.uniform(0, rows))
    center = tuple(
        float(np.clip(a, 0.5 * w, max(0.5 * w, n - 0.5 * w)) if w < n else 0.5 * n) - 0.5
        for a, w, n in zip(aim, (fit.columns / zoom, fit.rows / zoom), (columns, rows), strict=True)
    )
    roll = math.radians(rng.normal(0.0, roll_deg)) if rng.random() < 0.5 else 0.0
    return Warp(zoom, (center[0], center[1]), roll, bool(rng.random() < 0.5),
                (fit.columns, fit.rows))  # fmt: skip


def around(picture: Picture, person: Int[ndarray, " n"]) -> Warp:
    """The window of a closer look at a person (`region.py`); the picture if that is no closer.

    Args:
        picture: The picture.
        person: Indices of the person's pixels in the flat picture, at least one.
    """
    v, u = np.divmod(person, picture.labels.shape[1])
    depths = picture.depth_m.ravel()[person]
    depth = float(np.median(depths[depths > 0])) if (depths > 0).any() else REFERENCE_DEPTH_M
    zoom, all_of_it = cells_per_pixel(depth, picture.focal_px), whole(picture)
    if zoom <= all_of_it.zoom:
        return all_of_it
    return Warp(zoom, (0.5 * float(u.min() + u.max()), 0.5 * float(v.min() + v.max())))


def draw_around(
    picture: Picture, person: Int[ndarray, " n"], rng: np.random.Generator, roll_deg: float
) -> Warp:
    """Draw a window that is off by as much as that of a person who is hidden in part may be.

    Whoever is so near that no window is closer than the picture is seen in the picture as it is.

    Args:
        picture: The picture.
        person: Indices of the person's pixels in the flat picture, at least one.
        rng: Draws.
        roll_deg: Standard deviation of the roll [deg]; half of the windows have none.
    """
    best = around(picture, person)
    if best == whole(picture):
        return best
    zoom = best.zoom * math.exp(rng.normal(0.0, 0.15))
    spot = divmod(int(person[rng.integers(len(person))]), picture.labels.shape[1])[::-1]
    share = rng.uniform(0.0, 0.8) if rng.random() < 0.5 else 0.0
    off = rng.normal(0.0, 5.0, 2) / zoom
    u, v = (
        (1.0 - share) * c + share * x + d for c, x, d in zip(best.center, spot, off, strict=True)
    )
    roll = math.radians(rng.normal(0.0, roll_deg)) if rng.random() < 0.5 else 0.0
    return Warp(zoom, (float(u), float(v)), roll, bool(rng.random() < 0.5))


def cut(view: Picture, rng: np.random.Generator) -> Picture:
    """The view with an edge of the image through it: what lies beyond is bar."""
    depth, labels = view.depth_m.copy(), view.labels.copy()
    color = None if view.color is None else view.color.copy()
    sides = rng.permutation(4)[: 1 + int(rng.integers(0, 3) == 0)]
    for side in sides:
        count = int(rng.uniform(0.1, 0.55) * (INPUT_HEIGHT, INPUT_WIDTH)[side % 2])
        part = slice(0, count) if side < 2 else slice(-count, None)
        where = (part, slice(None)) if side % 2 == 0 else (slice(None), part)
        depth[where], labels[where] = 0.0, IGNORED
        if color is not None:
            color[where] = 0
    return Picture(depth, color, labels, view.focal_px)


def warped(
    picture: Picture, warp: Warp, color_shift_px: tuple[float, float] = (0.0, 0.0)
) -> Picture:
    """The view as a picture of the network's size.

    Four points a cell are looked up; a cell takes the lower median of their readings and the most
    frequent label of them, of equals that of the reading taken: where a person's outline halves a
    cell, depth and label are hers. What lies outside is a hole to be ignored.

    Args:
        picture: What is looked at.
        warp: From where.
        color_shift_px: By how much colour lies off depth [px].

    Returns:
        The view, shape (106, 128); `IGNORED` labels mark what has no content.
    """
    shape = (INPUT_HEIGHT, INPUT_WIDTH)
    depth, labels = np.zeros(shape, np.float32), np.full(shape, IGNORED, np.uint8)
    matrix = warp.matrix
    swap = MIRRORED if warp.mirrored else np.arange(len(MIRRORED), dtype=np.uint8)
    _warp(picture.depth_m, picture.labels, matrix, swap, *warp.window, depth, labels)
    color: UInt8[ndarray, "106 128 3"] | None = None
    if picture.color is not None:
        matrix[:, 2] += color_shift_px
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        size = (INPUT_WIDTH, INPUT_HEIGHT)
        color = np.asarray(
            cv2.warpAffine(
                picture.color, matrix, size, flags=flags, borderMode=cv2.BORDER_REPLICATE
            )
        )
    return Picture(depth, color, labels, picture.focal_px * warp.zoom)


@njit(cache=True)
def _warp(depth, labels, M, swap, window_columns, window_rows, out, out_labels):
    height, width = depth.shape
    rows, columns = out.shape
    left, top = (columns - window_columns) // 2, (rows - window_rows) // 2
    readings = np.empty(4, dtype=np.float32)
    seen = np.empty(4, dtype=np.uint8)
    for i in range(top, top + window_rows):
        for j in range(left, left + window_columns):
            inside = n = 0
            unread = np.uint8(BACKGROUND)
            for k in range(4):
                u, v = j - 0.25 + 0.5 * (k % 2), i - 0.25 + 0.5 * (k // 2)
                x = int(np.floor(M[0, 0] * u + M[0, 1] * v + M[0, 2] + 0.5))
                y = int(np.floor(M[1, 0] * u + M[1, 1] * v + M[1, 2] + 0.5))
                if not (0 <= x < width and 0 <= y < height):
                    continue
                inside += 1
                label = labels[y, x]
                if depth[y, x] <= 0.0:
                    unread = label if label == IGNORED else unread
                    continue
                side = swap[label] if label < swap.size else label
                keep_sorted(readings, seen, n, depth[y, x], side)
                n += 1
            if 2 * inside < 4:
                continue
            if n == 0 or 2 * n < inside:
                out_labels[i, j] = unread
                continue
            out[i, j] = readings[(n - 1) // 2]
            out_labels[i, j] = most_frequent(seen, n)
