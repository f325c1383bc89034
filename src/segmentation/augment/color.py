# SPDX-License-Identifier: Apache-2.0
"""Another light, another lens, another colour camera."""

from __future__ import annotations

import math

import cv2
import numpy as np
from jaxtyping import UInt8
from numpy import ndarray

GREY = np.array([0.299, 0.587, 0.114])
"""Luma of R G B (ITU-R BT.601)."""


def recolored(color: UInt8[ndarray, "h w 3"], rng: np.random.Generator) -> UInt8[ndarray, "h w 3"]:
    """The image under changes that are drawn: tone, tint, saturation, blur and noise.

    Args:
        color: R G B.
        rng: Draws.
    """
    gamma = math.exp(rng.normal(0.0, 0.25))
    gains = np.exp(rng.normal(0.0, 0.2) + rng.normal(0.0, 0.1, 3))
    lift = rng.normal(0.0, 12.0)
    tone = 255.0 * np.linspace(0.0, 1.0, 256) ** gamma
    table = np.clip(np.outer(tone, gains) + lift, 0.0, 255.0).astype(np.uint8)
    out = cv2.LUT(color, np.ascontiguousarray(table[:, None, :]))
    saturation = 0.0 if rng.random() < 0.06 else math.exp(rng.normal(0.0, 0.3))
    mix = saturation * np.eye(3) + (1.0 - saturation) * np.tile(GREY, (3, 1))
    mix = mix @ _turned(rng.normal(0.0, 0.15))
    out = cv2.transform(out, mix)
    if rng.random() < 0.25:
        out = cv2.GaussianBlur(out, (0, 0), rng.uniform(0.4, 1.5))
    if rng.random() < 0.4:
        grain = rng.standard_normal(out.shape, dtype=np.float32)
        out = np.clip(out + np.float32(rng.uniform(1.0, 12.0)) * grain, 0.0, 255.0).astype(np.uint8)
    return np.asarray(out)


def _turned(angle_rad: float) -> ndarray:
    """Turns hues about the grey axis (Rodrigues)."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    a, b = (1.0 - c) / 3.0, s / math.sqrt(3.0)
    return np.array([[c + a, a - b, a + b], [a + b, c + a, a - b], [a - b, a + b, c + a]])
