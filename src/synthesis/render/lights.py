# SPDX-License-Identifier: Apache-2.0
"""Lamps of a room, drawn by chance.

Irradiance is counted so that 1 makes white paper as bright as 1 in a linear image.

[KMHL02] Kang, Moon, Hong, Lee, Cho, Kim, Design of Advanced Color Temperature Control System for
    HDTV Applications, Journal of the Korean Physical Society 41(6), 2002.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray

WARM_K, COOL_K = 2700.0, 6500.0
"""Colour temperature of the warmest lamp and of daylight [K]."""
CEILING_M = (2.2, 2.45)
"""Heights of lamps below a ceiling [m]; rooms are higher."""
SIDE_M = (1.2, 2.1)
"""Heights of windows and standing lamps [m]."""

_RGB_XYZ = np.array(
    [
        [3.2404542, -1.5371385, -0.4985314],
        [-0.9692660, 1.8760108, 0.0415560],
        [0.0556434, -0.2040259, 1.0572252],
    ]
)
"""Linear sRGB from XYZ (IEC 61966-2-1)."""


@dataclass(frozen=True)
class Lamp:
    """A lamp of some size that shines in all directions."""

    position: Float[ndarray, " 3"]
    """Middle, world frame [m]; for the sun, a point far away."""
    color: Float[ndarray, " 3"]
    """Irradiance, red green blue, of a surface that faces it `at_m` away."""
    at_m: float = 1.0
    """Distance at which `color` holds [m]; it falls with the square."""
    radius_m: float = 0.0
    """Half its width, which softens its shadows [m]."""


@dataclass(frozen=True)
class Lights:
    """All the light of a scene."""

    sky: Float[ndarray, " 3"]
    """Irradiance of a surface that faces up, from everywhere but the lamps."""
    ground: Float[ndarray, " 3"]
    """The same of one that faces down."""
    key: Lamp | None = None
    """The lamp that casts shadows; None for diffuse light alone."""
    fill: tuple[Lamp, ...] = ()
    """Lamps that cast none."""


def draw_lights(rng: np.random.Generator) -> Lights:
    """Light for a room about the origin: one to three lamps and what its walls send back.

    Args:
        rng: Draws number, places, strengths and colour temperatures.

    Returns:
        Lights that make white paper at breast height about 1 bright.
    """
    mood = rng.uniform(WARM_K, COOL_K)
    diffuse = rng.uniform(0.25, 0.55)
    fills = int(rng.integers(0, 3))
    shares = rng.dirichlet([6.0] + [2.0] * fills) * (1.0 - diffuse)
    lamps = []
    for n, share in enumerate(shares):
        above = rng.random() < (0.7 if n == 0 else 0.4)
        azimuth, away = rng.uniform(-np.pi, np.pi), rng.uniform(0.3, 1.4 if above else 2.2)
        height = rng.uniform(*(CEILING_M if above else SIDE_M))
        position = np.array([away * np.cos(azimuth), away * np.sin(azimuth), height])
        color = color_of_temperature(float(np.clip(mood + rng.normal(0.0, 500.0), 2200.0, 8000.0)))
        at_m = float(np.linalg.norm(position - [0.0, 0.0, 1.0]))
        lamps.append(Lamp(position, 1.6 * share * color, at_m, rng.uniform(0.08, 0.35)))
    around = color_of_temperature(float(np.clip(mood + rng.normal(0.0, 700.0), 2200.0, 8000.0)))
    floor = np.array([1.0, rng.uniform(0.88, 1.0), rng.uniform(0.72, 0.98)])
    bounce = rng.uniform(0.35, 0.7)
    return Lights(diffuse * around, bounce * diffuse * around * floor, lamps[0], tuple(lamps[1:]))


def color_of_temperature(kelvin: float) -> Float[ndarray, " 3"]:
    """Linear red, green, blue of a black body, luminance 1 [KMHL02].

    Args:
        kelvin: Temperature, 1667 to 25000 K.
    """
    t = 1e3 / kelvin
    if kelvin < 4000.0:
        x = -0.2661239 * t**3 - 0.2343589 * t**2 + 0.8776956 * t + 0.179910
    else:
        x = -3.0258469 * t**3 + 2.1070379 * t**2 + 0.2226347 * t + 0.240390
    if kelvin < 2222.0:
        y = -1.1063814 * x**3 - 1.34811020 * x**2 + 2.18555832 * x - 0.20219683
    elif kelvin < 4000.0:
        y = -0.9549476 * x**3 - 1.37418593 * x**2 + 2.09137015 * x - 0.16748867
    else:
        y = 3.0817580 * x**3 - 5.87338670 * x**2 + 3.75112997 * x - 0.37001483
    rgb = _RGB_XYZ @ np.array([x / y, 1.0, (1.0 - x - y) / y])
    return np.asarray(np.maximum(rgb, 0.0))
