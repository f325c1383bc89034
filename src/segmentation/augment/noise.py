# SPDX-License-Identifier: Apache-2.0
"""What else a depth sensor does wrong: noise, steps, lost edges, specks, patches.

Sizes span what is published of Kinect v1 (sigma 1.4 mm and steps 2.8 mm at 1 m, both growing with
the square of the depth: Khoshelham & Elberink 2012) and of time of flight (Fankhauser et al. 2015).
Recordings bring noise of their own, so most samples get little.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Float
from numba import njit
from numpy import ndarray


class SensorFaults(NamedTuple):
    """How a depth image is spoilt."""

    noise: float
    """Standard deviation over depth squared [1/m]."""
    step: float
    """Quantisation of the inverse depth, which is step over depth squared [1/m]; 0 for none."""
    edge: float
    """Chance that a pixel at a jump of depth is lost."""
    flying: float
    """Chance that it lies between both surfaces instead."""
    specks: float
    """Chance that any pixel is lost."""
    patches: float
    """Share of the image that is lost in patches."""
    farthest_m: float
    """Readings end here [m]."""
    border: tuple[int, int]
    """Columns without reading at the left and at the right."""


def draw_faults(rng: np.random.Generator) -> SensorFaults:
    """Draw how a depth image is spoilt."""
    chance = rng.random(7)
    size = rng.random(7)
    border = rng.integers(1, 9, 2)
    return SensorFaults(
        noise=0.0025 * size[0] ** 2 if chance[0] < 0.6 else 0.0,
        step=0.001 + 0.004 * size[1] if chance[1] < 0.2 else 0.0,
        edge=size[2] if chance[2] < 0.4 else 0.0,
        flying=0.3 * size[3] if chance[3] < 0.2 else 0.0,
        specks=0.15 * size[4] ** 3 if chance[4] < 0.4 else 0.0,
        patches=0.15 * size[5] ** 2 if chance[5] < 0.2 else 0.0,
        farthest_m=3.5 + 5.0 * size[6] if chance[6] < 0.2 else np.inf,
        border=(int(border[0]) * (rng.random() < 0.1), int(border[1]) * (rng.random() < 0.1)),
    )


def spoilt(
    depth_m: Float[ndarray, "h w"], faults: SensorFaults, rng: np.random.Generator
) -> Float[ndarray, "h w"]:
    """The depth image with faults; a hole stays one.

    Args:
        depth_m: Depth [m], float32, 0 = no reading.
        faults: How it is spoilt.
        rng: Draws where.
    """
    height, width = depth_m.shape
    normal = rng.standard_normal((height, width), dtype=np.float32)
    uniform = rng.random((3, height, width), dtype=np.float32)
    lost = np.zeros((height, width), dtype=np.bool_)
    if faults.patches > 0:
        coarse = rng.random((height // 8 + 2, width // 8 + 2), dtype=np.float32)
        field = np.asarray(cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC))
        lost = field < np.quantile(field, faults.patches)
    lost[:, : faults.border[0]] = True
    lost[:, width - faults.border[1] :] = True
    out = np.zeros_like(depth_m)
    _spoil(depth_m, normal, uniform, lost, faults.noise, faults.step, faults.edge, faults.flying,
           faults.specks, faults.farthest_m, out)  # fmt: skip
    return out


@njit(cache=True)
def _spoil(depth, normal, uniform, lost, noise, step, edge, flying, specks, farthest, out):
    height, width = depth.shape
    for i in range(height):
        for j in range(width):
            d = depth[i, j]
            if d <= 0.0 or lost[i, j] or uniform[0, i, j] < specks:
                continue
            jump = other = np.float32(0.0)
            for k in range(4):
                y, x = i + (k == 0) - (k == 1), j + (k == 2) - (k == 3)
                if 0 <= y < height and 0 <= x < width and depth[y, x] > 0.0:
                    if abs(depth[y, x] - d) > jump:
                        jump, other = abs(depth[y, x] - d), depth[y, x]
            if jump > 0.05 + 0.03 * d:
                if uniform[1, i, j] < edge:
                    continue
                if uniform[1, i, j] > 1.0 - flying:
                    d += uniform[2, i, j] * (other - d)
            d += normal[i, j] * noise * d * d
            if step > 0.0:
                d = 1.0 / (max(1.0, np.round(1.0 / (d * step))) * step)
            if 0.0 < d < farthest:
                out[i, j] = d
