# SPDX-License-Identifier: Apache-2.0
"""Whether somebody has taken the background out of a depth image already."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

MOST_READINGS = 0.5
"""A person alone fills less than this share of the image."""
RIM_PX = 3
"""Width of the image's rim [px]."""
MOST_RIM_READINGS = 0.15
"""A person whom the image cuts off fills less than this share of the rim; a floor fills more, even
where everything else is too far away to be read."""


def background_removed(depth_m: Float[ndarray, "h w"]) -> bool:
    """True if a depth image shows a person and hardly anything else.

    Args:
        depth_m: Depth [m], 0 = no reading.
    """
    read = depth_m > 0
    if read.mean() >= MOST_READINGS:
        return False
    inner = np.zeros(read.shape, dtype=bool)
    inner[RIM_PX:-RIM_PX, RIM_PX:-RIM_PX] = True
    return bool(read[~inner].mean() <= MOST_RIM_READINGS)
