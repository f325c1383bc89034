# SPDX-License-Identifier: Apache-2.0
"""The people that can be filmed: 500 adults, drawn once (`synthesis.people.build`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from kintrack.errors import SceneError
from kintrack.rig import read_arrays

FILE = Path(__file__).with_name("population.npz")
"""The population that ships."""
PEOPLE = 500
"""How many people the file holds."""
TRAINING_PEOPLE = 400
"""The first of them may be trained on; nothing may be trained on the others."""
SIDES = ("l", "r")
HAND_SHAPES = ("open", "relaxed", "closed")
"""What a hand can be: flat as in the source, hanging, or around a handle."""
Hands = str | Mapping[str, str]
"""A shape for both hands, or one per side: `{"l": ..., "r": ...}`."""


@dataclass(frozen=True)
class Facts:
    """Who a person is."""

    sex: str
    """`woman` or `man`."""
    age_years: float
    """Age [years]."""
    height_m: float
    """Sole to crown of the bare body [m]."""
    mass_kg: float
    """Mass [kg], from the body's volume."""
    phenotype: dict[str, float]
    """What the source was given, by its own names, 0..1."""


@dataclass(frozen=True)
class Population:
    """A bank of bodies: vertices of the display skin and joint points, linear in coefficients."""

    mean_m: Float[ndarray, "m 3"]
    """Mean of V vertices, then P points; bind pose, root frame [m]."""
    basis: Float[ndarray, "k m 3"]
    """Components; the largest entry of each is 1 (half precision)."""
    coefficients_m: Float[ndarray, "n k"]
    """What each person takes of each component [m]."""
    point_names: tuple[str, ...]
    """Names of the P points: the model's links and its other fixed frames."""
    woman: Bool[ndarray, " n"]
    """Sex."""
    ages_years: Float[ndarray, " n"]
    """Age [years]."""
    heights_m: Float[ndarray, " n"]
    """Sole to crown [m]."""
    masses_kg: Float[ndarray, " n"]
    """Mass [kg]."""
    phenotype_names: tuple[str, ...]
    """Names of the source's parameters."""
    phenotypes: Float[ndarray, "n a"]
    """Values of the source's parameters, 0..1."""
    hand_vertices: dict[str, Int[ndarray, " h"]]
    """Per side, the vertices that a hand's shape moves."""
    hand_bases: dict[tuple[str, str], Float[ndarray, "1+j h 3"]]
    """Per side and shape: displacement [m], then its growth with the first j coefficients."""

    def __len__(self) -> int:
        """How many people there are."""
        return len(self.coefficients_m)

    def facts(self, index: int) -> Facts:
        """Who a person is.

        Raises:
            SceneError: if there is no such person.
        """
        self.check(index)
        values = (float(value) for value in self.phenotypes[index])
        return Facts(
            "woman" if self.woman[index] else "man",
            float(self.ages_years[index]),
            float(self.heights_m[index]),
            float(self.masses_kg[index]),
            dict(zip(self.phenotype_names, values, strict=True)),
        )

    def body(
        self, index: int, hands: Hands = "open"
    ) -> tuple[Float[ndarray, "v 3"], dict[str, Float[ndarray, " 3"]]]:
        """A person's bind pose.

        Args:
            index: Who.
            hands: Shape of the hands.

        Returns:
            Vertices of the display skin and the points by name, root frame [m].

        Raises:
            SceneError: if there is no such person or no such shape of a hand.
        """
        self.check(index)
        c = self.coefficients_m[index].astype(float)
        both = self.mean_m + np.einsum("k,kmd->md", c, self.basis, dtype=float)
        count = len(both) - len(self.point_names)
        vertices = both[:count]
        for side, shape in hand_shapes(hands).items():
            if shape != "open":
                basis = self.hand_bases[side, shape].astype(float)
                grown = basis[0] + np.einsum("k,kmd->md", c[: len(basis) - 1], basis[1:])
                vertices[self.hand_vertices[side]] += grown
        return vertices, dict(zip(self.point_names, both[count:], strict=True))

    def check(self, index: int) -> None:
        """Raise SceneError if there is no person of this number."""
        if not 0 <= index < len(self):
            raise SceneError(f"person {index}: 0 to {len(self) - 1} exist")


def training_people() -> range:
    """People that may be trained on."""
    return range(TRAINING_PEOPLE)


def held_out_people() -> range:
    """People that nothing is ever trained on."""
    return range(TRAINING_PEOPLE, PEOPLE)


def hand_shapes(hands: Hands) -> dict[str, str]:
    """The shape of each hand, by side.

    Args:
        hands: A shape for both, or one per side; a side that is not named is relaxed.

    Raises:
        SceneError: if a side or a shape does not exist.
    """
    shapes = dict.fromkeys(SIDES, hands) if isinstance(hands, str) else dict(hands)
    for side, shape in shapes.items():
        if side not in SIDES or shape not in HAND_SHAPES:
            raise SceneError(
                f"hand {side!r}: {shape!r}; sides {', '.join(SIDES)} and "
                f"shapes {', '.join(HAND_SHAPES)} exist"
            )
    return {side: shapes.get(side, "relaxed") for side in SIDES}


@cache
def load_population(path: Path = FILE) -> Population:
    """Read a population; the same file is read once.

    Args:
        path: File written by `synthesis.people.build`.

    Raises:
        ModelError: if the file is missing or broken.
    """
    pairs = [(side, shape) for side in SIDES for shape in HAND_SHAPES if shape != "open"]
    arrays = read_arrays(
        path,
        *("mean_m", "basis", "coefficients_m", "point_names"),
        *("woman", "ages_years", "heights_m", "masses_kg", "phenotype_names", "phenotypes"),
        *(f"hand_{side}_vertices" for side in SIDES),
        *(f"hand_{side}_{shape}_basis" for side, shape in pairs),
    )
    return Population(
        mean_m=arrays["mean_m"],
        basis=arrays["basis"],
        coefficients_m=arrays["coefficients_m"],
        point_names=tuple(str(name) for name in arrays["point_names"]),
        woman=arrays["woman"],
        ages_years=arrays["ages_years"],
        heights_m=arrays["heights_m"],
        masses_kg=arrays["masses_kg"],
        phenotype_names=tuple(str(name) for name in arrays["phenotype_names"]),
        phenotypes=arrays["phenotypes"],
        hand_vertices={side: arrays[f"hand_{side}_vertices"] for side in SIDES},
        hand_bases={(side, shape): arrays[f"hand_{side}_{shape}_basis"] for side, shape in pairs},
    )
