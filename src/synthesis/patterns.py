# SPDX-License-Identifier: Apache-2.0
"""Patterns drawn by chance: what clothes, skin, hair, walls, floors, wood and paint look like."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from synthesis.albedo import (
    Checks,
    Dots,
    Face,
    Image,
    Plain,
    Print,
    Rgb,
    Skin,
    Speckle,
    Stripes,
)
from synthesis.albedo_rooms import Marble, Planks, Tiles, Wood
from synthesis.mesh import Pattern

__all__ = [
    "Checks", "Dots", "Face", "Image", "Marble", "Pattern", "Plain", "Planks", "Print", "Rgb",
    "Skin", "Speckle", "Stripes", "Tiles", "Wood", "cloth_pattern", "denim_pattern",
    "floor_pattern", "hair_color", "linear", "paint_pattern", "skin_tone", "wall_pattern",
    "wood_pattern",
]  # fmt: skip

CLOTH_COLORS = (
    "101014 202328 3a3d42 6b6e73 a9abad e9e8e4 f5f5f3 16223f 1f3a6b 35629c 7ea6cf b9cfe4 0f3d3e "
    "1d5b3a 4d6b3c 7d8a5a b7c4a1 5a1420 8e1f26 c0392f d9694a e8b04a f0d98c 5b3a29 8a6a4a c3a57e "
    "e4d5bd 4b2a56 8d5a8f c99ac0 e3b7bf d45f86"
).split()
"""Dyes that clothes are drawn from (sRGB)."""
SKIN_COLORS = "f3d7c4 ebc5a9 deb08f cf9c76 b98560 a06d48 84563a 684029 4d2e1f 38221a".split()
"""Skin from light to dark (sRGB)."""
HAIR_COLORS = "0d0b0a 17110e 2b1d15 3d2818 5a3b22 7a5430 a67c45 c9a468 8a3f1e 7d7a76 c9c7c3".split()
WALL_COLORS = "f4f1ea e9e4d8 dcd6c8 cfd6d8 d9e2dc e8dccb c9b8a3 b5c0c9 f7f7f5 a9b39c d8c3bd".split()
PAINT_COLORS = (
    "f2f2f0 c9ccce 7d8185 33363a 16181b a8262c 1f4e8c 2d6e48 d9a62e c26a2a 5a3f7a".split()
)
WOOD_COLORS = (
    ("c79a63", "9a6a3a"),
    ("e0c79a", "c09c66"),
    ("7a4a2a", "4f2c18"),
    ("a8794c", "7c5230"),
    ("5a3f2d", "38261b"),
    ("d8c4a4", "b49a74"),
)
"""Light and dark rings of woods (sRGB)."""


def linear(srgb_hex: str) -> Rgb:
    """Linear red, green, blue of a colour given as six hexadecimal digits (IEC 61966-2-1)."""
    c = np.array([int(srgb_hex[n : n + 2], 16) for n in (0, 2, 4)]) / 255.0
    r, g, b = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
    return float(r), float(g), float(b)


def cloth_pattern(rng: np.random.Generator) -> Pattern:
    """Cloth as people wear it: mostly plain or heather, some stripes, checks, dots and prints."""
    color, other = _pick(rng, CLOTH_COLORS), _pick(rng, CLOTH_COLORS)
    kind, seed = rng.random(), int(rng.integers(1 << 30))
    if kind < 0.40:
        return Speckle(color, _scaled(color, 1.12), seed=seed, wear=0.3)
    if kind < 0.55:
        return Speckle(color, _scaled(color, 1.6), seed=seed)
    if kind < 0.68:
        across = (0.0, 0.0, 1.0) if rng.random() < 0.75 else (0.0, 1.0, 0.0)
        period, share = rng.uniform(0.012, 0.09), rng.uniform(0.15, 0.6)
        return Stripes(color, other, float(period), float(share), across)
    if kind < 0.80:
        return Checks(color, other, float(rng.uniform(0.015, 0.12)), float(rng.uniform(0.2, 0.5)))
    if kind < 0.86:
        return Dots(color, other, float(rng.uniform(0.02, 0.06)), float(rng.uniform(0.15, 0.35)))
    ground = Speckle(color, _scaled(color, 1.2), seed=seed)
    size = float(rng.uniform(0.03, 0.12))
    return Print(ground, other, size, float(rng.uniform(0.2, 0.5)), seed)


def denim_pattern(rng: np.random.Generator) -> Pattern:
    """Denim: threads along the leg, worn light in places."""
    dark, light = _pick(rng, ["16223f", "1f3157", "27456f", "15171c", "4a6c94"]), "6f93b8"
    wear = float(rng.uniform(0.1, 0.5))
    return Speckle(dark, linear(light), (0.002, 0.002, 0.02), 0.2, wear, int(rng.integers(1 << 30)))


def skin_tone(rng: np.random.Generator) -> Rgb:
    """A skin colour between two neighbours of `SKIN_COLORS`."""
    place = rng.uniform(0.0, len(SKIN_COLORS) - 1.0)
    a, b = (np.array(linear(SKIN_COLORS[int(place) + n])) for n in (0, 1))
    r, g, b = a + (place % 1.0) * (b - a)
    return float(r), float(g), float(b)


def hair_color(rng: np.random.Generator) -> Rgb:
    """A hair colour, dark ones more often."""
    share = np.linspace(2.0, 0.6, len(HAIR_COLORS))
    return linear(HAIR_COLORS[rng.choice(len(HAIR_COLORS), p=share / share.sum())])


def wall_pattern(rng: np.random.Generator) -> Pattern:
    """Plaster, wallpaper, brick-sized tiles or panelling."""
    color, kind = _pick(rng, WALL_COLORS), rng.random()
    seed = int(rng.integers(1 << 30))
    if kind < 0.65:
        return Marble(color, _scaled(color, 0.93), float(rng.uniform(0.3, 1.5)), 0.6, seed)
    if kind < 0.78:
        period = float(rng.uniform(0.08, 0.5))
        return Stripes(color, _scaled(color, 0.85), period, 0.5, (1.0, 1.0, 0.0))
    if kind < 0.90:
        return Tiles(color, _scaled(color, 0.7), float(rng.uniform(0.1, 0.3)), seed=seed)
    return wood_pattern(rng)


def floor_pattern(rng: np.random.Generator) -> Pattern:
    """Boards, tiles, carpet or stone."""
    kind, seed = rng.random(), int(rng.integers(1 << 30))
    if kind < 0.4:
        wood = _wood(rng, int(rng.integers(2)))
        return Planks(wood, float(rng.uniform(0.08, 0.2)), float(rng.uniform(0.9, 2.2)))
    if kind < 0.6:
        color = _pick(rng, WALL_COLORS + PAINT_COLORS[1:4])
        return Tiles(color, _scaled(color, 0.6), float(rng.uniform(0.2, 0.6)), seed=seed)
    if kind < 0.85:
        color = _pick(rng, CLOTH_COLORS)
        return Speckle(color, _scaled(color, 1.5), (0.006, 0.006, 0.006), 0.6, 0.25, seed)
    color = _pick(rng, WALL_COLORS)
    return Marble(color, _scaled(color, 0.5), float(rng.uniform(0.2, 0.8)), 0.6, seed)


def wood_pattern(rng: np.random.Generator) -> Pattern:
    """A piece of wood."""
    return _wood(rng, int(rng.integers(3)))


def paint_pattern(rng: np.random.Generator) -> Pattern:
    """Lacquer or plastic of one colour."""
    return Plain(_pick(rng, PAINT_COLORS))


def _wood(rng: np.random.Generator, axis: int) -> Wood:
    light, dark = WOOD_COLORS[rng.integers(len(WOOD_COLORS))]
    ring, seed = float(rng.uniform(0.008, 0.03)), int(rng.integers(1 << 30))
    return Wood(linear(light), linear(dark), ring, axis, seed)


def _pick(rng: np.random.Generator, colors: Sequence[str]) -> Rgb:
    return linear(colors[int(rng.integers(len(colors)))])


def _scaled(color: Rgb, factor: float) -> Rgb:
    r, g, b = np.clip(np.array(color) * factor + 0.01 * (factor > 1.0), 0.0, 1.0)
    return float(r), float(g), float(b)
