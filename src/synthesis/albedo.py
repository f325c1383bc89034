# SPDX-License-Identifier: Apache-2.0
"""Kinds of albedo pattern: cloth, skin and pictures as functions of place.

A pattern has no state, so the same place always has the same colour. Colours are linear red, green,
blue. `synthesis.patterns` draws patterns by chance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8
from numpy import ndarray

from synthesis.mesh import Pattern
from synthesis.noise import noise, rough

Triple = tuple[float, float, float]
Rgb = Triple


@dataclass(frozen=True)
class Plain:
    """One colour."""

    color: Rgb
    """Linear colour."""

    def __call__(self, coords: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
        """Colours at the coordinates."""
        return np.tile(np.array(self.color), (len(coords), 1))


@dataclass(frozen=True)
class Stripes:
    """Stripes of two colours across an axis."""

    color: Rgb
    """Ground."""
    stripe: Rgb
    """Stripe."""
    period_m: float = 0.04
    """Distance between stripes [m]."""
    share: float = 0.5
    """Width of a stripe as a share of the period."""
    across: Triple = (0.0, 0.0, 1.0)
    """Direction across which they run."""

    def __call__(self, coords: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
        """Colours at the coordinates."""
        on = coords @ np.array(self.across) / self.period_m % 1.0 < self.share
        return np.where(on[:, None], self.stripe, self.color)


@dataclass(frozen=True)
class Checks:
    """Plaid: stripes across two axes that mix where they cross."""

    color: Rgb
    """Ground."""
    stripe: Rgb
    """Stripe."""
    period_m: float = 0.06
    """Distance between stripes [m]."""
    share: float = 0.4
    """Width of a stripe as a share of the period."""
    axes: tuple[int, int] = (1, 2)
    """Coordinates across which they run."""

    def __call__(self, coords: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
        """Colours at the coordinates."""
        on = coords[:, list(self.axes)] / self.period_m % 1.0 < self.share
        return mixed(self.color, self.stripe, 0.5 * on.sum(axis=1))


@dataclass(frozen=True)
class Dots:
    """Round dots in rows across the second and third axis, every other row shifted."""

    color: Rgb
    """Ground."""
    dot: Rgb
    """Dots."""
    period_m: float = 0.05
    """Lattice spacing [m]."""
    radius: float = 0.28
    """Radius as a share of the period."""

    def __call__(self, coords: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
        """Colours at the coordinates."""
        uv = coords[:, 1:] / self.period_m
        uv = uv + 0.5 * (np.floor(uv[:, ::-1]) % 2.0) * np.array([1.0, 0.0])
        on = np.linalg.norm(uv % 1.0 - 0.5, axis=1) < self.radius
        return np.where(on[:, None], self.dot, self.color)


@dataclass(frozen=True)
class Speckle:
    """Noise between two colours: heather, tweed, knitwear; stretched it is denim or carpet."""

    color: Rgb
    """One colour."""
    other: Rgb
    """The other."""
    grain_m: Triple = (0.004, 0.004, 0.004)
    """Size of a grain along each axis [m]."""
    wear_m: float = 0.25
    """Size of the large faded areas [m]."""
    wear: float = 0.15
    """Strength of the large areas, 0..1."""
    seed: int = 0
    """Of the noise."""

    def __call__(self, coords: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
        """Colours at the coordinates."""
        fine = 0.5 + 0.5 * noise(coords / np.array(self.grain_m), self.seed)
        return mixed(
            self.color, self.other, fine + self.wear * rough(coords / self.wear_m, self.seed + 1)
        )


@dataclass(frozen=True)
class Print:
    """Cloth with blobs, or with one logo on the front."""

    ground: Pattern
    """Cloth."""
    ink: Rgb
    """Colour of the print."""
    size_m: float = 0.07
    """Size of the blobs [m]."""
    cover: float = 0.3
    """Share that is printed, roughly."""
    seed: int = 0
    """Of the blobs."""
    box_m: tuple[Triple, Triple] | None = None
    """Corners of the region that carries the print [m]; everywhere if None."""

    def __call__(self, coords: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
        """Colours at the coordinates."""
        on = rough(coords / self.size_m, self.seed, 2) > 0.45 - 0.9 * self.cover
        if self.box_m is not None:
            low, high = np.array(self.box_m)
            on &= ((coords > low) & (coords < high)).all(axis=1)
        return np.where(on[:, None], self.ink, self.ground(coords))


@dataclass(frozen=True)
class Skin:
    """Human skin: blotches of tone, and places that are redder."""

    tone: Rgb
    """Mean colour."""
    redness: float = 0.12
    """How much blood shows, 0..1."""
    seed: int = 0
    """Of the blotches."""

    def __call__(self, coords: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
        """Colours at the coordinates."""
        light = 1.0 + 0.07 * rough(coords / 0.05, self.seed)
        red = self.redness * np.clip(rough(coords / 0.04, self.seed + 3, 2) + 0.2, 0.0, 1.0)
        shift = 1.0 + red[:, None] * np.array([0.15, -0.55, -0.45])
        return np.clip(np.array(self.tone) * light[:, None] * shift, 0.0, 1.0)


@dataclass(frozen=True)
class Face:
    """Skin with eyebrows and lips where a head has them."""

    skin: Skin
    """Everywhere else."""
    brow: Rgb
    """Eyebrows."""
    centre_m: Triple
    """Middle of the head at the height of the eyes, face towards x [m]."""
    scale: float = 1.0
    """Size of the head; 1 is the average adult."""

    def __call__(self, coords: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
        """Colours at the coordinates."""
        out = self.skin(coords)
        x, y, z = ((coords - np.array(self.centre_m)) / self.scale).T
        arch = 0.021 - 6.0 * (np.abs(y) - 0.032) ** 2
        brow = (np.abs(z - arch) < 0.0035) & (np.abs(np.abs(y) - 0.034) < 0.018) & (x > 0.05)
        lips = np.hypot(y / 0.025, (z + 0.064) / 0.009) < 1.0
        lips &= x > 0.06
        out[lips] *= np.array([0.85, 0.52, 0.55])
        out[brow] = 0.35 * out[brow] + 0.65 * np.array(self.brow)
        return out


@dataclass(frozen=True, eq=False)
class Image:
    """A picture that repeats; u to the right, v upwards, one picture a unit."""

    pixels: UInt8[ndarray, "h w 3"]
    """sRGB values."""

    def __call__(self, coords: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
        """Colours of the nearest pixels."""
        h, w = self.pixels.shape[:2]
        column = np.minimum((coords[:, 0] % 1.0 * w).astype(int), w - 1)
        row = np.minimum(((1.0 - coords[:, 1] % 1.0) * h).astype(int), h - 1)
        c = self.pixels[row, column] / 255.0
        return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def mixed(a: Rgb, b: Rgb, share: Float[ndarray, " n"]) -> Float[ndarray, "n 3"]:
    """Colours between a (share 0) and b (share 1), shape (N, 3)."""
    t = np.clip(share, 0.0, 1.0)[:, None]
    return np.array(a) * (1.0 - t) + np.array(b) * t
