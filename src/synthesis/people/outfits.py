# SPDX-License-Identifier: Apache-2.0
"""What somebody wears: chosen piece by piece, or drawn by sex, age and chance."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from kintrack.errors import SceneError
from synthesis.mesh import Material
from synthesis.patterns import (
    CLOTH_COLORS,
    HAIR_COLORS,
    Pattern,
    Plain,
    Speckle,
    cloth_pattern,
    denim_pattern,
    hair_color,
    linear,
    skin_tone,
)
from synthesis.people.garments import Skirt, Top, Trousers
from synthesis.people.hair import Hair
from synthesis.people.hats import HATS
from synthesis.people.population import Facts
from synthesis.people.shoes import Shoe

DARK_CLOTH = 0.07
"""Share of cloth that is dark to the sensor's light as well."""
DRESSES, SKIRTS = 0.10, 0.12
"""Share of women in a dress, and of the others in a skirt."""
LONG_HEM = 0.25
"""Share of dresses and skirts that end below the knee."""
HAIR_INFRARED = (0.05, 0.40)
"""Reflectance of hair."""
GREY_FROM_YEARS = 45.0
"""Age from which hair turns grey [years]."""


@dataclass(frozen=True)
class Outfit:
    """What somebody wears; None is not worn."""

    top: Top | None = Top()
    """Shirt or dress."""
    bottom: Trousers | Skirt | None = Trousers()
    """Trousers or skirt."""
    jacket: Top | None = None
    """Over everything."""
    tucked: bool = False
    """True if the top goes into the bottom."""
    shoe: Shoe | None = Shoe()
    """On both feet; barefoot if None."""
    socks: bool = True
    """True with socks."""
    hair: Hair | None = Hair()
    """Bald if None."""
    beard_m: float = 0.0
    """Length of the beard [m], 0 = none."""
    hat: str = ""
    """One of `synthesis.people.hats.HATS`, or nothing."""
    tone: tuple[float, float, float] = (0.5, 0.3, 0.2)
    """Linear colour of the skin."""
    hair_color: tuple[float, float, float] = (0.03, 0.02, 0.015)
    """Linear colour of the hair."""
    materials: dict[str, Material] = field(default_factory=dict)
    """`top`, `bottom`, `jacket`, `shoe`, `socks`, `hair`, `hat`; grey if left out."""

    def __post_init__(self) -> None:
        if self.hat and self.hat not in HATS:
            raise SceneError(f"hat {self.hat!r}: {', '.join(HATS)} are allowed, or nothing")

    def material(self, name: str) -> Material:
        """What a piece is made of."""
        return self.materials.get(name, Material(Plain((0.3, 0.3, 0.3)), 0.6))


def draw_outfit(facts: Facts, rng: np.random.Generator) -> Outfit:
    """Something that a man or a woman might wear.

    Args:
        facts: Sex and age.
        rng: Draws everything.
    """
    woman = facts.sex == "woman"
    dress = woman and rng.random() < DRESSES
    top = _dress(rng) if dress else _top(rng, woman)
    skirt = woman and not dress and rng.random() < SKIRTS
    bottom = None if dress else _skirt(rng) if skirt else _trousers(rng)
    tucked = bool(not dress and top.collar not in ("hood",) and rng.random() < 0.35)
    jacket = _jacket(rng) if top.collar != "hood" and rng.random() < 0.30 else None
    boots = 0.3 if woman else 0.12
    shaft = float(rng.uniform(0.06, 0.25)) if rng.random() < boots else 0.0
    shoe = Shoe(shaft, *(float(rng.uniform(a, b)) for a, b in ((0.005, 0.009), (0.006, 0.014))))
    hat = str(rng.choice(["cap", "wool", "brim"])) if rng.random() < 0.16 else ""
    beard = 0.0 if woman or rng.random() > 0.35 else float(rng.choice([0.002, 0.006, 0.014, 0.03]))
    grey = facts.age_years > GREY_FROM_YEARS + rng.normal(8.0, 8.0)
    color = linear(HAIR_COLORS[-1 if rng.random() < 0.5 else -2]) if grey else hair_color(rng)
    return Outfit(
        top=top,
        bottom=bottom,
        jacket=jacket,
        tucked=tucked,
        shoe=shoe if rng.random() < 0.93 else None,
        socks=bool(rng.random() < 0.7),
        hair=_hair(rng, woman, facts.age_years),
        beard_m=beard,
        hat=hat,
        tone=skin_tone(rng),
        hair_color=color,
        materials=_materials(rng, isinstance(bottom, Trousers), color),
    )


def _top(rng: np.random.Generator, woman: bool) -> Top:
    """T-shirts, shirts, jumpers, hoodies."""
    kind = rng.choice(["t", "shirt", "jumper", "hood"], p=[0.42, 0.25, 0.18, 0.15])
    fit = rng.random()
    hem = float(rng.uniform(-0.10, 0.0))
    if kind == "t":
        sleeve = 0.0 if rng.random() < (0.25 if woman else 0.08) else float(rng.uniform(0.4, 0.8))
        wide = 0.008 + 0.03 * fit
        neckline = float(rng.uniform(0.65, 1.2 if woman else 0.8))
        return Top(sleeve, 0.005 + 0.015 * fit, wide, hem, 0.5 - 0.4 * fit, 0.0, neckline)
    if kind == "shirt":
        sleeve = float(rng.choice([0.7, 1.3, 1.9]))
        cuff = 0.7 if sleeve > 1.5 else 0.0
        room = (0.008 + 0.012 * fit, 0.012 + 0.02 * fit)
        return Top(sleeve, *room, hem, 0.35 - 0.25 * fit, 0.0, 0.9, "collar", 0.0, 0.010, cuff)
    collar = "hood" if kind == "hood" else str(rng.choice(["crew", "high"], p=[0.7, 0.3]))
    room = (0.012 + 0.018 * fit, 0.01 + 0.03 * fit)
    sleeve, cuff = float(rng.uniform(1.75, 1.95)), float(rng.choice([0.0, 0.9], p=[0.2, 0.8]))
    return Top(sleeve, *room, hem, 0.25 - 0.15 * fit, 0.0, 0.7, collar, 0.0, 0.013, cuff)


def _jacket(rng: np.random.Generator) -> Top:
    """Jackets and coats, open or closed."""
    opening = 0.0 if rng.random() < 0.35 else float(rng.uniform(0.02, 0.07))
    coat = rng.random() < 0.2
    hem = float(rng.uniform(-0.5, -0.3) if coat else rng.uniform(-0.18, -0.03))
    collar = str(rng.choice(["collar", "high", "hood", "crew"], p=[0.45, 0.2, 0.25, 0.1]))
    ease, wide = float(rng.uniform(0.010, 0.026)), float(rng.uniform(0.012, 0.035))
    fold = float(rng.uniform(0.008, 0.016))
    return Top(1.93, ease, wide, hem, float(rng.uniform(0.05, 0.2)), 0.08 if coat else 0.0, 0.8,
               collar, opening, fold, float(rng.choice([0.3, 0.9])))  # fmt: skip


def _dress(rng: np.random.Generator) -> Top:
    """Dresses."""
    sleeve = float(rng.choice([0.0, 0.5, 1.2, 1.85]))
    hem, flare = _hem_m(rng), float(rng.uniform(0.05, 0.20))
    neckline = float(rng.uniform(0.75, 1.2))
    return Top(sleeve, 0.007, float(rng.uniform(0.006, 0.03)), hem, 0.5, flare, neckline, "none")


def _hem_m(rng: np.random.Generator) -> float:
    """Where a dress or a skirt ends, relative to the hips [m]: mostly about the knee."""
    return float(rng.uniform(-0.80, -0.58) if rng.random() < LONG_HEM else rng.uniform(-0.55, -0.3))


def _skirt(rng: np.random.Generator) -> Skirt:
    """Skirts from above the knee to the ankle, narrow or wide."""
    flare = float(rng.choice([-0.02, 0.08, 0.18, 0.30]) + rng.uniform(-0.02, 0.03))
    fold = float(rng.uniform(0.004, 0.02))
    return Skirt(_hem_m(rng), float(rng.uniform(0.08, 0.16)), flare, fold)


def _trousers(rng: np.random.Generator) -> Trousers:
    """Tight, straight and wide trousers, and shorts."""
    kind = rng.choice(["tight", "straight", "wide", "shorts"], p=[0.27, 0.40, 0.15, 0.18])
    waist = float(rng.uniform(0.06, 0.13))
    if kind == "tight":
        return Trousers(float(rng.uniform(1.75, 1.95)), waist, 0.004, 0.045, 0.006)
    if kind == "shorts":
        radius = float(rng.uniform(0.075, 0.12))
        return Trousers(float(rng.uniform(0.55, 1.1)), waist, 0.008, radius, 0.009)
    radius = rng.uniform(0.105, 0.14) if kind == "wide" else rng.uniform(0.07, 0.098)
    ease = 0.012 if kind == "wide" else 0.007
    return Trousers(2.0, waist, ease, float(radius), float(rng.uniform(0.009, 0.015)))


def _hair(rng: np.random.Generator, woman: bool, age_years: float) -> Hair | None:
    """Hair styles by sex; older men lose theirs."""
    fit = rng.random()
    if woman:
        kind = rng.choice(["short", "bob", "long", "bun", "tail"], p=[0.12, 0.23, 0.35, 0.13, 0.17])
        if kind == "bob":
            return Hair(0.026, 0.026, float(rng.uniform(0.08, 0.17)), rough_m=0.005)
        if kind == "long":
            return Hair(0.024, 0.024, float(rng.uniform(0.22, 0.5)), rough_m=0.006)
        if kind in ("bun", "tail"):
            return Hair(0.012, 0.009, tied=str(kind), rough_m=0.003)
        return Hair(0.03 + 0.015 * fit, 0.014 + 0.01 * fit, rough_m=0.008)
    if rng.random() < 0.10 + 0.003 * max(age_years - 30.0, 0.0):
        return None
    receding = float(rng.uniform(0.3, 1.0)) if rng.random() < 0.008 * age_years - 0.1 else 0.0
    if rng.random() < 0.08:
        return Hair(0.02, 0.02, float(rng.uniform(0.1, 0.35)), "", receding)
    return Hair(0.005 + 0.04 * fit, 0.003 + 0.014 * fit**2, 0.0, "", receding, 0.001 + 0.009 * fit)


def _materials(
    rng: np.random.Generator, trousers: bool, hair: tuple[float, float, float]
) -> dict[str, Material]:
    """Stuff for every piece."""
    leather = Plain(linear(str(rng.choice(["17120f", "3b2416", "6b4426", "d8d6d2", "202225"]))))
    shoes: Pattern = leather if rng.random() < 0.6 else cloth_pattern(rng)
    bottom = denim_pattern(rng) if trousers and rng.random() < 0.45 else _calm(rng)
    r, g, b = hair
    strands = Speckle(hair, (1.7 * r, 1.7 * g, 1.7 * b), (0.003, 0.003, 0.03), 0.05, 0.3)
    return {
        "top": _cloth(rng, cloth_pattern(rng)),
        "bottom": _cloth(rng, bottom),
        "jacket": _cloth(rng, _calm(rng)),
        "hat": _cloth(rng, _calm(rng)),
        "socks": _cloth(rng, _calm(rng)),
        "shoe": Material(shoes, float(rng.uniform(0.04, 0.5)), 0.15),
        "hair": Material(strands, float(rng.uniform(*HAIR_INFRARED)), 0.2),
    }


def _cloth(rng: np.random.Generator, pattern: Pattern) -> Material:
    """Cloth is bright to infrared light whatever its dye, but for some dark ones."""
    dark = rng.random() < DARK_CLOTH
    return Material(pattern, float(rng.uniform(0.03, 0.15) if dark else rng.uniform(0.4, 0.9)))


def _calm(rng: np.random.Generator) -> Pattern:
    """Cloth of nearly one colour."""
    r, g, b = linear(CLOTH_COLORS[rng.integers(len(CLOTH_COLORS))])
    seed = int(rng.integers(1 << 30))
    return Speckle((r, g, b), (1.2 * r + 0.01, 1.2 * g + 0.01, 1.2 * b + 0.01), seed=seed)
