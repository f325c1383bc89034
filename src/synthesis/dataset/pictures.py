# SPDX-License-Identifier: Apache-2.0
"""A sheet of random frames of a dataset: colour, depth and labels."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from jaxtyping import UInt8
from numpy import ndarray

from kintrack.errors import DatasetError
from kintrack.export.overlay import PART_COLORS
from kintrack.files import make_result_folder
from kintrack.sequence import open_sequence
from kintrack.sequence.frame import Frame
from synthesis.dataset.build import sequences

TILE_PX = (212, 256)
"""Height and width of one image [px]."""
COLUMNS = 2
"""Frames side by side."""
NEAR_M, FAR_M = 0.5, 6.0
"""Depths at the ends of the colour scale [m]."""
GAP_PX = 4


def write_sheet(root: Path, path: Path, count: int = 20, seed: int = 0) -> None:
    """Draw random frames of a dataset.

    Args:
        root: Folder of the dataset.
        path: PNG to write.
        count: How many frames.
        seed: Draws them.

    Raises:
        DatasetError: if the dataset has no whole recording, or the file cannot be written.
    """
    folders = sequences(root)
    if not folders:
        raise DatasetError(f"{root}: no whole recording yet")
    rng = np.random.default_rng(seed)
    chosen = rng.choice(len(folders), count, replace=count > len(folders))
    rows = []
    for index in np.sort(chosen):
        recording = open_sequence(folders[index])
        rows.append(_tile(recording.frame(int(rng.integers(len(recording))))))
    while len(rows) % COLUMNS:
        rows.append(np.full_like(rows[0], 255))
    lines = [np.hstack(rows[n : n + COLUMNS]) for n in range(0, len(rows), COLUMNS)]
    make_result_folder(path.parent)
    try:
        path.write_bytes(cv2.imencode(".png", np.vstack(lines)[..., ::-1])[1].tobytes())
    except OSError as error:
        raise DatasetError(f"{path}: cannot be written ({error.strerror})") from error


def _tile(frame: Frame) -> UInt8[ndarray, "h w 3"]:
    """Colour, depth and labels of a frame next to each other."""
    height, width = TILE_PX
    assert frame.depth_m is not None
    color = np.zeros((*frame.depth_m.shape, 3), np.uint8) if frame.color is None else frame.color
    images = [_fit(image) for image in (color, colored_depth(frame.depth_m))]
    if frame.labels is not None:
        images.append(_fit(PART_COLORS[frame.labels], cv2.INTER_NEAREST))
    return np.pad(
        np.hstack(images), ((0, GAP_PX), (0, 2 * GAP_PX), (0, 0)), constant_values=255
    ).astype(np.uint8)


def _fit(image: ndarray, how: int = cv2.INTER_AREA) -> UInt8[ndarray, "h w 3"]:
    """The image inside a tile, its aspect kept, on black."""
    height, width = TILE_PX
    scale = min(height / image.shape[0], width / image.shape[1])
    size = (round(image.shape[1] * scale), round(image.shape[0] * scale))
    small = cv2.resize(image, size, interpolation=how)
    out = np.zeros((height, width, 3), np.uint8)
    top, left = (height - size[1]) // 2, (width - size[0]) // 2
    out[top : top + size[1], left : left + size[0]] = small
    return out


def colored_depth(depth_m: ndarray) -> UInt8[ndarray, "h w 3"]:
    """Depth as colours from near to far, black where there is no reading."""
    share = np.clip((depth_m - NEAR_M) / (FAR_M - NEAR_M), 0.0, 1.0)
    colored = cv2.applyColorMap((255 * (1.0 - share)).astype(np.uint8), cv2.COLORMAP_TURBO)
    return np.where((depth_m > 0)[..., None], colored[..., ::-1], 0).astype(np.uint8)
