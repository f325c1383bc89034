# SPDX-License-Identifier: Apache-2.0
"""A colour camera: from radiance to the eight bits of an image.

Lens and registration first (displacement, blur, vignetting), then exposure and white balance, then
the noise of photons and of reading out (a Poisson variable of mean n electrons is about normal with
variance n), then the smear of demosaicing, a shoulder for highlights, and sRGB (IEC 61966-2-1).
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, UInt8
from numba import njit
from numpy import ndarray

SHOULDER = 0.75
"""Linear value above which highlights are compressed."""
LEVELS = 1 << 14
"""Steps of the tone curve."""
BRIGHTEST = 4.0
"""Linear value at which the tone curve ends."""
WORKING_MEAN = (1e-6, 1e6)
"""Mean radiance that the automatic exposure can handle."""


@dataclass(frozen=True)
class ColorCamera:
    """One camera with its habits; it has no memory."""

    target: float = 0.2
    """Mean luminance that the automatic exposure aims at, linear, 0..1."""
    exposure_error: float = 1.0
    """Factor by which it misses."""
    balance: float = 0.8
    """How far the automatic white balance makes the mean grey: 0 not at all, 1 altogether."""
    balance_error: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Factors of red, green and blue by which it misses."""
    blur_px: float = 0.8
    """Standard deviation of the lens's blur [px]."""
    shift_px: tuple[float, float] = (0.0, 0.0)
    """By how much the colours lie right of and below the depth [px]."""
    vignetting: float = 0.1
    """Share of the light that the corners lose."""
    electrons: float = 4000.0
    """Electrons that make white."""
    read_noise: float = 0.004
    """Standard deviation of reading out, linear."""
    smear_px: float = 0.5
    """Standard deviation of demosaicing's blur, which neighbouring pixels' noise shares [px]."""

    def develop(
        self, radiance: Float[ndarray, "h w 3"], rng: np.random.Generator
    ) -> UInt8[ndarray, "h w 3"]:
        """Take a picture.

        Args:
            radiance: Linear red, green, blue of every pixel.
            rng: Draws the noise.

        Returns:
            R G B, shape (h, w, 3).
        """
        image = _float(radiance)
        if any(self.shift_px):
            shift = np.array([[1.0, 0.0, self.shift_px[0]], [0.0, 1.0, self.shift_px[1]]])
            size = (image.shape[1], image.shape[0])
            image = _float(cv2.warpAffine(image, shift, size, borderMode=cv2.BORDER_REPLICATE))
        if self.blur_px > 0.0:
            image = _float(cv2.GaussianBlur(image, (0, 0), self.blur_px))
        seed = rng.integers(2**64, dtype=np.uint64)
        image = _expose(
            image, self._gains(image), self.vignetting, self.electrons, self.read_noise, seed
        )
        if self.smear_px > 0.0:
            image = cv2.GaussianBlur(image, (0, 0), self.smear_px)
        return np.asarray(_quantise(image, _TONES))

    def _gains(self, image: Float[ndarray, "h w 3"]) -> Float[ndarray, " 3"]:
        """Factors of red, green and blue: exposure and white balance."""
        mean = np.clip(cv2.mean(image)[:3], *WORKING_MEAN)
        grey = (mean.mean() / mean) ** self.balance * np.array(self.balance_error)
        luminance = np.array([0.2126, 0.7152, 0.0722]) @ (grey * mean)
        return np.asarray(grey * self.target * self.exposure_error / luminance)


def draw_color_camera(rng: np.random.Generator) -> ColorCamera:
    """A camera with its own exposure, colours, sharpness and noise."""
    return ColorCamera(
        target=float(rng.uniform(0.14, 0.26)),
        exposure_error=float(np.exp(rng.normal(0.0, 0.15))),
        balance=float(rng.uniform(0.7, 0.95)),
        balance_error=(
            float(np.exp(rng.normal(0.0, 0.05))),
            1.0,
            float(np.exp(rng.normal(0, 0.06))),
        ),
        blur_px=float(rng.uniform(0.5, 1.0)),
        shift_px=(float(rng.normal(0.0, 0.7)), float(rng.normal(0.0, 0.5))),
        vignetting=float(rng.uniform(0.03, 0.2)),
        electrons=float(np.exp(rng.uniform(np.log(800.0), np.log(8000.0)))),
        read_noise=float(rng.uniform(0.002, 0.008)),
        smear_px=float(rng.uniform(0.4, 0.6)),
    )


def _float(image: ndarray) -> Float[ndarray, "h w 3"]:
    return np.ascontiguousarray(image, dtype=np.float32)


def _tone_curve() -> UInt8[ndarray, " n"]:
    """Eight-bit sRGB of linear values 0..BRIGHTEST, highlights rolled off to 1."""
    x = np.linspace(0.0, BRIGHTEST, LEVELS)
    room = 1.0 - SHOULDER
    x = np.where(x < SHOULDER, x, 1.0 - room * np.exp(-(x - SHOULDER) / room))
    y = np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-9) ** (1 / 2.4) - 0.055)
    return np.rint(255.0 * y).astype(np.uint8)


_TONES = _tone_curve()


@njit(cache=True)
def _expose(image, gains, vignetting, electrons, read_noise, seed):
    """Electrons as a share of those that make white, with noise.

    The noise is the sum of four uniform numbers, normal but for tails beyond 3.4 standard
    deviations, from one 64-bit number of SplitMix64 (Steele, Lea & Flood 2014) each.
    """
    h, w, _ = image.shape
    out = np.empty_like(image)
    corner = 0.25 * (h * h + w * w)
    state = np.uint64(seed)
    scale, middle = np.sqrt(3.0) / 65536.0, 131070.0
    for i in range(h):
        for j in range(w):
            square = ((i + 0.5 - 0.5 * h) ** 2 + (j + 0.5 - 0.5 * w) ** 2) / corner
            light = 1.0 - vignetting * square
            for c in range(3):
                state += np.uint64(0x9E3779B97F4A7C15)
                x = state
                x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
                x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
                x = x ^ (x >> np.uint64(31))
                total = np.uint64(0)
                for _ in range(4):
                    total += x & np.uint64(0xFFFF)
                    x >>= np.uint64(16)
                value = image[i, j, c] * gains[c] * light
                variance = max(value, 0.0) / electrons + read_noise * read_noise
                out[i, j, c] = value + np.sqrt(variance) * scale * (float(total) - middle)
    return out


@njit(cache=True)
def _quantise(image, tones):
    out = np.empty(image.shape, dtype=np.uint8)
    last = tones.shape[0] - 1
    scale = last / BRIGHTEST
    for i in range(image.shape[0]):
        for j in range(image.shape[1]):
            for c in range(3):
                out[i, j, c] = tones[int(min(max(scale * image[i, j, c] + 0.5, 0.0), last))]
    return out
