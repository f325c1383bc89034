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


class Quadratic(NamedTuple):
    """A term's second-order model: cost + g^T dv + 0.5 dv^T H dv."""

    H: Float[ndarray, "nv nv"]
    """Gauss-Newton matrix J^T W J."""
    g: Float[ndarray, " nv"]
    """Gradient J^T W r."""
    cost: float
    """0.5 sum_i w_i r_i^2."""


def quadratic_of(linearization: Linearization) -> Quadratic:
    """J^T W J, J^T W r and the cost of explicit rows."""
    r, J, w = linearization
    WJ = w[:, None] * J
    return Quadratic(J.T @ WJ, r @ WJ, 0.5 * float(r @ (w * r)))


class Residual(Protocol):
    """One term of the objective, with everything but the pose fixed."""

    def linearize(self, state: BodyState) -> Linearization:
        """Residuals, Jacobian and weights at a state."""
        ...

    def quadratic(self, state: BodyState) -> Quadratic:
        """The same term summed up; a term that has a shorter way to it takes that."""
        return quadratic_of(self.linearize(state))

    def cost(self, state: BodyState) -> float:
        """0.5 sum_i w_i r_i^2 at a state."""
        ...
