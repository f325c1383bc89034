# SPDX-License-Identifier: Apache-2.0
"""Pictures, videos and web pages of a track."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import UInt8
from numpy import ndarray

from kintrack.export.html import HtmlRecorder
from kintrack.export.overlay import BONES, PART_COLORS, STATUS_COLORS, depth_range, draw_overlay
from kintrack.export.video import VideoWriter

__all__ = [
    "BONES",
    "PART_COLORS",
    "STATUS_COLORS",
    "HtmlRecorder",
    "VideoWriter",
    "contact_sheet",
    "depth_range",
    "draw_overlay",
]


def contact_sheet(
    images: Sequence[UInt8[ndarray, "h w 3"]], columns: int
) -> UInt8[ndarray, "h2 w2 3"]:
    """Pictures side by side, row after row, 4 px apart on white; small ones sit top left.

    Args:
        images: R G B pictures, at least one.
        columns: Pictures in a row, at least 1.

    Returns:
        R G B; as large as the largest picture times columns and rows.
    """
    gap_px = 4
    height = max(image.shape[0] for image in images)
    width = max(image.shape[1] for image in images)
    columns = min(columns, len(images))
    rows = -(-len(images) // columns)
    shape = (rows * (height + gap_px) - gap_px, columns * (width + gap_px) - gap_px, 3)
    sheet = np.full(shape, 255, dtype=np.uint8)
    for i, image in enumerate(images):
        top, left = (i // columns) * (height + gap_px), (i % columns) * (width + gap_px)
        sheet[top : top + image.shape[0], left : left + image.shape[1]] = image
    return sheet
