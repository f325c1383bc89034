# SPDX-License-Identifier: Apache-2.0
"""Damped Gauss-Newton on the tree's tangent space, with hinge limits that hold.

Each step solves (H + lambda diag H) dv = -g with H = sum J^T W J, g = sum J^T W r over all terms
(Levenberg 1944, Marquardt 1963). Hinges that the step would push over a limit are put on it, and
the rest is solved again (active set), so limits are met exactly. A step that does not lower the
cost is rejected and the damping raised.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.linalg import cho_factor, cho_solve

from kintrack.body import Body, BodyState, run_kinematics
from kintrack.residuals.linearization import Residual


@dataclass(frozen=True)
class Solution:
    """Where a solve ended."""

    state: BodyState
    """Body at the solution, kinematics run."""
    cost: float
    """Cost there."""
    steps: int
    """Accepted steps."""
    damping: float
    """Levenberg damping to go on with."""


def normal_equations(
    state: BodyState, residuals: Sequence[Residual]
) -> tuple[Float[ndarray, "nv nv"], Float[ndarray, " nv"], float]:
    """H, g and cost summed over all terms at a state."""
    nv = state.body.nv
    H, g, cost = np.zeros((nv, nv)), np.zeros(nv), 0.0
    for residual in residuals:
        term = residual.quadratic(state)
        H += term.H
        g += term.g
        cost += term.cost
    return H, g, cost


def bounded_step(
    H: Float[ndarray, "nv nv"],
    g: Float[ndarray, " nv"],
    lower: Float[ndarray, " nv"],
    upper: Float[ndarray, " nv"],
) -> Float[ndarray, " nv"]:
    """Minimise 0.5 dv^T H dv + g^T dv within lower <= dv <= upper, by an active set.

    Args:
        H: Positive definite matrix.
        g: Gradient.
        lower: Bounds of the step, at most 0.
        upper: Bounds of the step, at least 0.

    Returns:
        The step; a component on its bound stays there only while its multiplier agrees.
    """
    n = len(g)
    dv = np.zeros(n)
    fixed = np.zeros(n, dtype=bool)
    for _ in range(12):
        free = ~fixed
        rhs = -(g[free] + H[np.ix_(free, fixed)] @ dv[fixed])
        dv[free] = cho_solve(cho_factor(H[np.ix_(free, free)]), rhs)
        below, above = dv < lower, dv > upper
        dv = np.clip(dv, lower, upper)
        gradient = H @ dv + g
        release = fixed & (((dv == lower) & (gradient < 0)) | ((dv == upper) & (gradient > 0)))
        hit = free & (below | above)
        if not hit.any() and not release.any():
            break
        fixed = (fixed & ~release) | hit
    return dv


def solve(
    body: Body,
    state: BodyState,
    residuals: Sequence[Residual],
    steps: int,
    damping: float,
) -> Solution:
    """Minimise the summed cost of the terms from a state.

    Args:
        body: The body with its limits.
        state: Start, kinematics run, within limits.
        residuals: Terms with everything but the pose fixed.
        steps: Accepted steps at most.
        damping: Levenberg damping, relative to the diagonal.

    Returns:
        The best state found, with the damping to continue with.
    """
    accepted = 0
    cost = np.inf
    while accepted < steps:
        H, g, cost = normal_equations(state, residuals)
        low, high = step_bounds(body, state.q)
        moved = False
        for _ in range(5):
            damped = H + np.diag(damping * np.diag(H) + 1e-9)
            trial = run_kinematics(
                body, body.integrate(state.q, bounded_step(damped, g, low, high))
            )
            trial_cost = sum(residual.cost(trial) for residual in residuals)
            if trial_cost < cost:
                state, moved = trial, True
                damping = max(damping / 3, 1e-6)
                break
            damping = max(damping, 1e-6) * 10
        if not moved:
            break
        accepted += 1
        small = cost - trial_cost < 1e-4 * cost
        cost = trial_cost
        if small:
            break
    return Solution(state, cost, accepted, damping)


def step_bounds(body: Body, q: Float[ndarray, " nq"]) -> tuple[ndarray, ndarray]:
    """How far each velocity component may move before its hinge limit; unbounded root."""
    low, high = np.full(body.nv, -np.inf), np.full(body.nv, np.inf)
    low[6:], high[6:] = body.lower[6:] - q[7:], body.upper[6:] - q[7:]
    return np.minimum(low, 0.0), np.maximum(high, 0.0)
