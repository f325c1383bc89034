# SPDX-License-Identifier: Apache-2.0
"""The label set and the size of the network's picture; both are written into every weights file."""

import numpy as np
from jaxtyping import Bool, UInt8
from numpy import ndarray

from kintrack.geometry import LABELS

BACKGROUND = 0
"""Label of whatever is not the person, pixels without a reading included."""
IGNORED = 255
"""Target value of a pixel that no loss or score may count."""
MIRRORED = np.array([0, 1, 2, 4, 3, 6, 5], dtype=np.uint8)
"""`MIRRORED[label]` is the label after left and right have been swapped."""

INPUT_WIDTH = 128
"""Columns of the network's picture [px]."""
INPUT_HEIGHT = 106
"""Rows of the network's picture [px]."""
INPUT_CHANNELS = ("R", "G", "B", "D")
"""What the input's planes hold, in order."""

__all__ = [
    "BACKGROUND",
    "IGNORED",
    "INPUT_CHANNELS",
    "INPUT_HEIGHT",
    "INPUT_WIDTH",
    "LABELS",
    "MIRRORED",
    "person_of",
]


def person_of(labels: UInt8[ndarray, "*n"]) -> Bool[ndarray, "*n"]:
    """True where a pixel is the person's."""
    return np.asarray((labels != BACKGROUND) & (labels != IGNORED))
