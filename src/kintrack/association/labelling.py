# SPDX-License-Identifier: Apache-2.0
"""A coarse label map brought to the pixels of a depth image."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, UInt8
from numpy import ndarray


def labels_of_pixels(
    labels: UInt8[ndarray, "r c"], depth_m: Float[ndarray, "h w"]
) -> UInt8[ndarray, "h w"]:
    """The label of the cell in which each pixel lies.

    Args:
        labels: Label map that covers the whole image, shape (R, C).
        depth_m: Depth of every pixel [m], 0 = no reading, shape (H, W).

    Returns:
        Labels, shape (H, W); 0 where there is no reading.
    """
    h, w = depth_m.shape
    rows = (2 * np.arange(h) + 1) * labels.shape[0] // (2 * h)
    columns = (2 * np.arange(w) + 1) * labels.shape[1] // (2 * w)
    return np.where(depth_m > 0, labels[rows].take(columns, axis=1), np.uint8(0))
