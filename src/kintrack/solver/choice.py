# SPDX-License-Identifier: Apache-2.0
"""Solvers by name."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from typing import Protocol

from kintrack.body import Body, BodyState
from kintrack.errors import ConfigError
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


def check_installed(method: str) -> None:
    """Pass if a solver can run here.

    Raises:
        ConfigError: if IPOPT is wanted and CasADi, which brings it, is not installed.
    """
    if method == "ipopt" and find_spec("casadi") is None:
        raise ConfigError(
            "solver 'ipopt' needs CasADi, which is not installed; pip install 'kintrack[ipopt]', "
            "or take 'gauss-newton'"
        )
