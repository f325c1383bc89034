# SPDX-License-Identifier: Apache-2.0
"""What a residual term hands to a solver."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from jaxtyping import Float
from numpy import ndarray

from kintrack.body import BodyState


class Linearization(NamedTuple):
    """Residuals and their derivative; the term's cost is 0.5 sum_i w_i r_i^2."""

    r: Float[ndarray, " n"]
    """Residuals, unit of the term."""
    J: Float[ndarray, "n nv"]
    """dr/dv through `pin.integrate` [unit of r per m or rad]."""
    w: Float[ndarray, " n"]
    """Weights [1 / unit of r squared]."""


class Residual(Protocol):
    """One term of the objective, with everything but the pose fixed."""

    def linearize(self, state: BodyState) -> Linearization:
        """Residuals, Jacobian and weights at a state."""
        ...

    def cost(self, state: BodyState) -> float:
        """0.5 sum_i w_i r_i^2 at a state."""
        ...
