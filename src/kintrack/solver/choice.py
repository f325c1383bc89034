# SPDX-License-Identifier: Apache-2.0
"""Solvers by name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from kintrack.body import Body, BodyState
from kintrack.residuals.linearization import Residual
from kintrack.solver import gauss_newton, ipopt
from kintrack.solver.gauss_newton import Solution


class Solve(Protocol):
    """Minimises the summed cost of the terms from a state."""

    def __call__(
        self,
        body: Body,
        state: BodyState,
        residuals: Sequence[Residual],
        steps: int,
        damping: float,
    ) -> Solution:
        """As `gauss_newton.solve`."""
        ...


SOLVERS: dict[str, Solve] = {"gauss-newton": gauss_newton.solve, "ipopt": ipopt.solve}
"""Name -> solver."""
