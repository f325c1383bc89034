# SPDX-License-Identifier: Apache-2.0
"""An object with the places where a person takes hold of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from jaxtyping import Float
from numpy import ndarray

from synthesis.mesh import Mesh


@dataclass(frozen=True)
class Thing:
    """An object that stands on z = 0; its front looks along x, its origin is below its middle."""

    name: str
    """What it is."""
    mesh: Mesh
    """Its surface, own frame [m]."""
    places: Mapping[str, Float[ndarray, "4 4"]] = field(default_factory=dict)
    """T_thing_place by name.

    `seat`: middle of the upper surface, x forward, z up. `handle`: middle of the bar that a hand
    closes around, y along the bar, z away from the object. `neck`, `strings` (guitar): where the
    fretting and the plucking hand lie, x out of the guitar's face.
    """
