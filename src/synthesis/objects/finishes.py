# SPDX-License-Identifier: Apache-2.0
"""What things are made of: colour, near-infrared reflectance and gloss, drawn at random.

Reflectance near 850 nm: wood, paper and most dyed cloth stay bright whatever their colour; carbon
black in plastics and leather keeps them dark; glass and polished metal send the light elsewhere.
The ranges are choices guided by the ASTER spectral library (Baldridge et al. 2009).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from numpy.random import Generator

from synthesis.mesh import Material, Pattern
from synthesis.patterns import (
    Dots,
    Image,
    Plain,
    Print,
    Wood,
    cloth_pattern,
    paint_pattern,
    wood_pattern,
)


@dataclass(frozen=True)
class Laid:
    """Cloth made to hang, laid flat: its second and third axes become the first two."""

    cloth: Pattern
    """The cloth."""

    def __call__(self, coords: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
        """Colours at the coordinates."""
        return self.cloth(coords[:, [2, 0, 1]])


def wood(rng: Generator) -> Material:
    """Timber or veneer, oiled or lacquered."""
    grain = wood_pattern(rng)
    if isinstance(grain, Wood):
        grain = replace(grain, axis=0)
    return Material(grain, rng.uniform(0.45, 0.75), rng.choice([0.0, 0.03, 0.08]))


def cloth(rng: Generator) -> Material:
    """Woven cover."""
    return Material(Laid(cloth_pattern(rng)), rng.uniform(0.3, 0.75))


def fabric(rng: Generator) -> Material:
    """Cloth of furniture and luggage, without dots or prints."""
    pattern = cloth_pattern(rng)
    if isinstance(pattern, Print):
        pattern = pattern.ground
    elif isinstance(pattern, Dots):
        pattern = Plain(pattern.color)
    return Material(Laid(pattern), rng.uniform(0.3, 0.75))


def leather(rng: Generator) -> Material:
    """Leather or imitation; black in half of the draws."""
    if rng.random() < 0.5:
        return black_leather(rng)
    tone = np.array([0.35, 0.2, 0.11]) * rng.uniform(0.3, 1.8)
    return Material(Plain(_rgb(tone)), rng.uniform(0.2, 0.6), 0.1)


def black_leather(rng: Generator) -> Material:
    """Leather that swallows near-infrared light, too."""
    return Material(grey(rng, 0.01, 0.04), rng.uniform(0.03, 0.12), 0.12)


def upholstery(rng: Generator) -> Material:
    """Cloth or leather."""
    return fabric(rng) if rng.random() < 0.65 else leather(rng)


def paint(rng: Generator) -> Material:
    """Painted board or metal."""
    if rng.random() < 0.5:
        return Material(grey(rng, 0.55, 0.85), rng.uniform(0.5, 0.8), rng.uniform(0.0, 0.1))
    return Material(paint_pattern(rng), rng.uniform(0.25, 0.7), rng.uniform(0.0, 0.1))


def board(rng: Generator) -> Material:
    """What cupboards are made of: wood or painted board."""
    return wood(rng) if rng.random() < 0.6 else paint(rng)


def dark_plastic(rng: Generator) -> Material:
    """Plastic coloured with carbon black."""
    return Material(grey(rng, 0.012, 0.06), rng.uniform(0.03, 0.12), rng.uniform(0.02, 0.12))


def plastic(rng: Generator) -> Material:
    """Plastic of any colour."""
    if rng.random() < 0.3:
        return dark_plastic(rng)
    return Material(paint_pattern(rng), rng.uniform(0.3, 0.7), rng.uniform(0.03, 0.12))


def metal(rng: Generator) -> Material:
    """Bare, chromed or black metal."""
    if rng.random() < 0.4:
        return Material(grey(rng, 0.015, 0.05), rng.uniform(0.04, 0.12), 0.1)
    return Material(grey(rng, 0.3, 0.6), rng.uniform(0.06, 0.2), rng.uniform(0.3, 0.6))


def glass(rng: Generator) -> Material:
    """A pane or a dark screen."""
    return Material(grey(rng, 0.01, 0.05), rng.uniform(0.02, 0.05), 0.7)


def ceramic(rng: Generator) -> Material:
    """Glazed cups and pots."""
    if rng.random() < 0.4:
        return Material(grey(rng, 0.6, 0.85), rng.uniform(0.5, 0.75), 0.15)
    return Material(paint_pattern(rng), rng.uniform(0.35, 0.7), 0.12)


def cardboard(rng: Generator) -> Material:
    """Brown or white packing board."""
    tone = np.array([0.42, 0.29, 0.17]) if rng.random() < 0.8 else np.array([0.75, 0.73, 0.7])
    return Material(Plain(_rgb(tone * rng.uniform(0.75, 1.2))), rng.uniform(0.55, 0.75))


def leaves(rng: Generator) -> Material:
    """Green leaves, which near-infrared light finds bright."""
    tone = np.array([0.08, 0.2, 0.05]) * rng.uniform(0.5, 1.8) * rng.uniform(0.8, 1.2, 3)
    return Material(Plain(_rgb(tone)), rng.uniform(0.45, 0.6), 0.04)


def paper(rng: Generator) -> Material:
    """Paper and pale card of any tint."""
    tone = rng.uniform(0.5, 0.9) * rng.uniform(0.8, 1.0, 3)
    return Material(Plain(_rgb(tone)), rng.uniform(0.6, 0.8))


def cover(rng: Generator) -> Material:
    """A printed plain colour: book spines, labels."""
    return Material(paint_pattern(rng), rng.uniform(0.3, 0.75), 0.03)


def printed(rng: Generator) -> Material:
    """A picture, whose coords are (u, v) from 0 to 1: a random poster or photograph."""
    return Material(Image(_picture(rng)), rng.uniform(0.4, 0.7), rng.choice([0.0, 0.2]))


def grey(rng: Generator, low: float, high: float) -> Plain:
    """A grey of linear reflectance between two values, with a slight tint."""
    return Plain(_rgb(rng.uniform(low, high) * rng.uniform(0.94, 1.0, 3)))


def _rgb(tone: np.ndarray) -> tuple[float, float, float]:
    r, g, b = np.clip(tone, 0.0, 0.95).tolist()
    return r, g, b


def _picture(rng: Generator) -> np.ndarray:
    """A ground that fades from one colour to another, under a few discs, bars and hills."""
    size = 96
    y, x = np.mgrid[0:size, 0:size] / size
    top, bottom = rng.uniform(30, 250, (2, 3))
    image = top * (1 - y[..., None]) + bottom * y[..., None]
    for _ in range(rng.integers(2, 8)):
        kind, color = rng.integers(3), rng.uniform(10, 250, 3)
        a, b, c, d = rng.uniform(0, 1, 4)
        if kind == 0:
            inside = (x - a) ** 2 + (y - b) ** 2 < (0.05 + 0.25 * c) ** 2
        elif kind == 1:
            inside = (np.abs(x - a) < 0.02 + 0.2 * c) & (np.abs(y - b) < 0.02 + 0.3 * d)
        else:
            inside = y > 0.5 + 0.4 * a + 0.1 * np.sin(2 * np.pi * (b + x * (1 + 3 * c)))
        image[inside] = color
    return np.clip(image, 0, 255).astype(np.uint8)
