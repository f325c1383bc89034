# SPDX-License-Identifier: Apache-2.0
"""A strip of labelled frames: kept ones above, dropped ones with their reasons below."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, UInt8
from numpy import ndarray

from kintrack.errors import ResultError
from kintrack.export import PART_COLORS, contact_sheet, depth_range
from kintrack.export.overlay import depth_picture

TILE_PX = (300, 240)
"""Height and width of a frame's picture."""
OPACITY = 0.7
"""How much of the label's colour hides the depth."""

_BAR_PX = 40
_KEPT, _DROPPED = (0, 158, 115), (213, 94, 0)


class LabelStrip:
    """Collects evenly spread frames while a recording passes by."""

    def __init__(self, kept: int = 8, dropped: int = 4):
        """Hold at most so many frames of each kind."""
        self._tiles = {True: _Spread(kept), False: _Spread(dropped)}

    def add(
        self,
        depth_m: Float[ndarray, "h w"],
        labels: UInt8[ndarray, "h w"] | None,
        index: int,
        reasons: Sequence[str],
    ) -> None:
        """Take a frame; it is drawn only if it is one of those to show."""
        self._tiles[not reasons].offer(lambda: tile(depth_m, labels, index, reasons))

    def write(self, path: Path) -> None:
        """Write the picture (png).

        Raises:
            ResultError: if there is no frame or the file cannot be written.
        """
        tiles = [*self._tiles[True].items, *self._tiles[False].items]
        if not tiles:
            raise ResultError(f"no frame to draw into {path}")
        sheet = contact_sheet(tiles, 4)
        if not cv2.imwrite(str(path), cv2.cvtColor(sheet, cv2.COLOR_RGB2BGR)):
            raise ResultError(f"cannot write {path}")


class _Spread:
    """Evenly spread items of a stream of unknown length: when full, every second one goes."""

    def __init__(self, most: int):
        self.most, self._stride, self._seen = most, 1, 0
        self._held: list[ndarray] = []

    @property
    def items(self) -> list:
        """At most `most` of them, evenly spread."""
        if len(self._held) <= self.most:
            return self._held
        chosen = np.linspace(0, len(self._held) - 1, self.most).round().astype(int)
        return [self._held[i] for i in chosen]

    def offer(self, make) -> None:
        """Take the next item, or pass over it without making it."""
        if self._seen % self._stride == 0:
            self._held.append(make())
            if len(self._held) > 2 * self.most:
                self._held, self._stride = self._held[::2], 2 * self._stride
        self._seen += 1


def tile(
    depth_m: Float[ndarray, "h w"],
    labels: UInt8[ndarray, "h w"] | None,
    index: int,
    reasons: Sequence[str],
) -> UInt8[ndarray, "h2 w2 3"]:
    """One frame around the person, labels over depth, with a line about the verdict.

    Args:
        depth_m: The whole depth image [m].
        labels: Labels of every pixel; None shows the depth alone.
        index: Number of the frame.
        reasons: Why it is dropped; empty if it is kept.

    Returns:
        R G B of `TILE_PX` and the bar above.
    """
    picture = depth_picture(np.asarray(depth_m, dtype=float), depth_range(depth_m)).astype(float)
    height, width = TILE_PX
    box = (0, 0, *depth_m.shape)
    if labels is not None and labels.any():
        on = labels > 0
        picture[on] += OPACITY * (PART_COLORS[labels[on]] - picture[on])
        box = _around(on, height / width)
    top, left, bottom, right = box
    cut = picture[top:bottom, left:right].astype(np.uint8)
    scale = min(height / cut.shape[0], width / cut.shape[1])
    size = (max(1, int(cut.shape[1] * scale)), max(1, int(cut.shape[0] * scale)))
    cut = np.asarray(cv2.resize(cut, size, interpolation=cv2.INTER_NEAREST), dtype=np.uint8)
    out = np.full((height + _BAR_PX, width, 3), 24, dtype=np.uint8)
    y, x = _BAR_PX + (height - cut.shape[0]) // 2, (width - cut.shape[1]) // 2
    out[y : y + cut.shape[0], x : x + cut.shape[1]] = cut
    cv2.rectangle(out, (0, 0), (6, _BAR_PX), _DROPPED if reasons else _KEPT, -1)
    lines = (f"frame {index}: {'dropped' if reasons else 'kept'}", "; ".join(reasons))
    for line, text in enumerate(lines):
        cv2.putText(out, text[:46], (12, 15 + 17 * line), cv2.FONT_HERSHEY_SIMPLEX, 0.36,
                    (235, 235, 235), 1, cv2.LINE_AA)  # fmt: skip
    return out


def _around(mask: ndarray, aspect: float) -> tuple[int, int, int, int]:
    """Rows and columns around a mask with some margin: top, left, bottom, right."""
    row, column = np.nonzero(mask)
    h, w = mask.shape
    tall = max(np.ptp(row) * 1.25, np.ptp(column) * 1.25 * aspect, 24)
    middle = (int(row.min()) + int(row.max())) // 2, (int(column.min()) + int(column.max())) // 2
    half = int(tall / 2), int(tall / aspect / 2)
    top, left = max(0, middle[0] - half[0]), max(0, middle[1] - half[1])
    return top, left, min(h, middle[0] + half[0] + 1), min(w, middle[1] + half[1] + 1)
