# SPDX-License-Identifier: Apache-2.0
"""A coarse label map brought to the pixels of a depth image."""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import Float, Int, UInt8
from numpy import ndarray

from kintrack.components import components

EDGE_M = 0.06
"""Depth step between neighbouring pixels that parts two pieces [m]."""
LEAST_LABELLED = 0.7
"""A piece of which labels call at least this share a person is nothing else."""


def labels_of_pixels(
    labels: UInt8[ndarray, "r c"], depth_m: Float[ndarray, "h w"]
) -> UInt8[ndarray, "h w"]:
    """The label of the cell in which each pixel lies.

    Args:
        labels: Label map that covers the whole image, shape (R, C).
        depth_m: Depth of every pixel, or of every n-th of the map's [m], 0 = no reading, shape
            (H, W).

    Returns:
        Labels, shape (H, W); 0 where there is no reading.
    """
    rows, columns = (_cells(n, cells) for n, cells in zip(depth_m.shape, labels.shape, strict=True))
    return np.where(depth_m > 0, labels[rows].take(columns, axis=1), np.uint8(0))


def _cells(n: int, cells: int) -> Int[ndarray, " n"]:
    """The cell of each pixel along one axis; of every k-th pixel of the map if it is finer."""
    step = round(cells / n)
    if step > 1 and -(-cells // step) == n:
        return step * np.arange(n)
    return (2 * np.arange(n) + 1) * cells // (2 * n)


def spread_labels(
    part: UInt8[ndarray, "h w"], depth_m: Float[ndarray, "h w"]
) -> UInt8[ndarray, "h w"]:
    """Pieces of which most is labelled, labelled throughout, as the nearest labelled pixel is.

    For images in which there is nothing behind a person, so that what a network overlooks of her is
    not taken for background. A thing before her and a floor at her feet are pieces of which little
    is labelled, and stay as they are.

    Args:
        part: Label of every pixel, shape (H, W), 0 = none.
        depth_m: Depth of every pixel [m], 0 = no reading, shape (H, W).

    Returns:
        Labels, shape (H, W); 0 where there is no reading.
    """
    if not part.any():
        return part
    piece = components(depth_m, depth_m > 0, EDGE_M, 0.0)
    read = piece >= 0
    size = np.bincount(piece[read])
    labelled = np.bincount(piece[read & (part > 0)], minlength=len(size))
    whole = np.append(labelled >= LEAST_LABELLED * size, False)
    _, nearest = cv2.distanceTransformWithLabels(
        (part == 0).astype(np.uint8), cv2.DIST_L2, 3, labelType=cv2.DIST_LABEL_PIXEL
    )
    of_index = np.zeros(int(nearest.max()) + 1, dtype=np.uint8)
    of_index[nearest[part > 0]] = part[part > 0]
    return np.where(whole[piece], of_index[nearest], part)
