# SPDX-License-Identifier: Apache-2.0
"""What a tailor would measure, with the standard deviation that the coefficients leave it."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.shape import load_shape_space

LIMBS = {
    "upper_arm": ("upper_arm", "forearm"),
    "forearm": ("forearm", "hand"),
    "thigh": ("thigh", "shank"),
    "shank": ("shank", "foot"),
}
"""Limb -> links at whose origins it begins and ends, without side: joint centre to joint centre."""

BEYOND_SHAPE = 0.025
"""Standard deviation of a limb about what coefficients and a clothed surface say of it, as a share
of its length; measured on training people."""


class Length(NamedTuple):
    """A length and how sure it is."""

    value_m: float
    """Length [m]."""
    sigma_m: float
    """Standard deviation [m]."""


def height(
    b: Float[ndarray, " k"], folder: Path | None = None
) -> tuple[float, Float[ndarray, " k"]]:
    """Sole to crown of the bare body, standing, and its derivative.

    Args:
        b: Shape coefficients.
        folder: Model folder; the one that ships if None.

    Returns:
        Height [m] and its gradient [m per coefficient].
    """
    space = load_shape_space(folder, "display")
    z = space.vertices_m[:, 2] + np.tensordot(b, space.vertices_basis_m[: len(b), :, 2], 1)
    top, sole = int(z.argmax()), int(z.argmin())
    basis = space.vertices_basis_m[: len(b), :, 2]
    return float(z[top] - z[sole]), basis[:, top] - basis[:, sole]


def limbs(
    b: Float[ndarray, " k"], folder: Path | None = None
) -> dict[str, tuple[float, Float[ndarray, " k"]]]:
    """Length of every limb, mean of both sides, and its derivative.

    Args:
        b: Shape coefficients.
        folder: Model folder; the one that ships if None.

    Returns:
        Limb -> length [m] and gradient [m per coefficient].
    """
    space = load_shape_space(folder)
    names, origins = list(space.rig.link_names), space.origins(b)
    out = {}
    for limb, ends in LIMBS.items():
        value, gradient = 0.0, np.zeros(len(b))
        for side in "lr":
            i, j = (names.index(f"{side}_{end}") for end in ends)
            along = origins[j] - origins[i]
            length = float(np.linalg.norm(along))
            change = space.origins_basis_m[: len(b), j] - space.origins_basis_m[: len(b), i]
            value += 0.5 * length
            gradient += 0.5 * change @ (along / length)
        out[limb] = (value, gradient)
    return out


def measured(
    b: Float[ndarray, " k"], covariance: Float[ndarray, "k k"], folder: Path | None = None
) -> tuple[Length, dict[str, Length]]:
    """Height and limbs with their standard deviations.

    Args:
        b: Shape coefficients.
        covariance: Their covariance.
        folder: Model folder; the one that ships if None.
    """

    def length(value: float, gradient: ndarray, beyond: float = 0.0) -> Length:
        variance = float(gradient @ covariance @ gradient)
        return Length(value, float(np.hypot(np.sqrt(variance), beyond * value)))

    tall = length(*height(b, folder))
    parts = limbs(b, folder).items()
    return tall, {limb: length(*found, BEYOND_SHAPE) for limb, found in parts}
