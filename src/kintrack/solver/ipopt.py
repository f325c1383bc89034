# SPDX-License-Identifier: Apache-2.0
"""IPOPT on the same objective as Gauss-Newton, with hard joint limits.

An interior-point method (Waechter and Biegler 2006) keeps every hinge inside its limits on the way
and ends at a local minimum of the round's objective, whose associations, normals and robust
weights are frozen; `gauss_newton.solve` takes a few steps towards it. A solve starts from the pose
it is given and remembers nothing of the one before, so that a recording repeats bit for bit.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from threading import Lock
from typing import Literal, NamedTuple

import numpy as np
from numpy import ndarray

from kintrack.body import Body, BodyState, run_kinematics
from kintrack.residuals.linearization import Residual
from kintrack.solver.gauss_newton import Solution
from kintrack.solver.interrupts import signals_put_off
from kintrack.solver.nlp import programme
from kintrack.solver.nlp_terms import Parameters, bonds, parameters
from kintrack.solver.symbolic_body import tree_of

LEAST_ITERATIONS = 60
"""Iterations that are always allowed: an interior point stopped early is far from the limits that
it would end at. A frame's solve takes 3 to 8."""
Status = Literal["converged", "iteration limit", "infeasible", "not finite", "failed"]
"""How a solve ended; `failed` is everything else that IPOPT can say, see `Outcome.detail`."""
STATUS: dict[str, Status] = {
    "Solve_Succeeded": "converged",
    "Solved_To_Acceptable_Level": "converged",
    "Search_Direction_Becomes_Too_Small": "converged",
    "Maximum_Iterations_Exceeded": "iteration limit",
    "Infeasible_Problem_Detected": "infeasible",
    "Invalid_Number_Detected": "not finite",
}
"""IPOPT's words -> ours."""
log = logging.getLogger(__name__)
_alone = Lock()
"""IPOPT's linear solver is not made for several threads at once."""


@dataclass(frozen=True)
class Outcome:
    """A solution and how IPOPT came by it."""

    solution: Solution
    """The better of start and last iterate, within the limits; `steps` are iterations."""
    status: Status
    """How the solve ended."""
    detail: str
    """The same in IPOPT's words, or what was wrong with the problem."""


def solve(
    body: Body,
    state: BodyState,
    residuals: Sequence[Residual],
    steps: int,
    damping: float,
) -> Solution:
    """Minimise the summed cost of the terms from a state; a failure is logged, not raised.

    Args:
        body: The body with its limits.
        state: Start, kinematics run; hinges outside their limits are put on them.
        residuals: Terms with everything but the pose fixed.
        steps: Iterations at most, where more than `LEAST_ITERATIONS`.
        damping: Gauss-Newton's; handed on.

    Returns:
        The best state found.

    Raises:
        ConfigError: if a term is of a kind that is not known.
    """
    outcome = minimise(body, state, residuals, steps, damping)
    if outcome.status != "converged":
        log.warning("IPOPT: %s (%s); the best pose is kept", outcome.status, outcome.detail)
    return outcome.solution


def minimise(
    body: Body,
    state: BodyState,
    residuals: Sequence[Residual],
    steps: int = LEAST_ITERATIONS,
    damping: float = 0.0,
) -> Outcome:
    """As `solve`, with the status.

    Args:
        body: As in `solve`.
        state: As in `solve`.
        residuals: As in `solve`.
        steps: As in `solve`.
        damping: As in `solve`.

    Returns:
        Solution and status.

    Raises:
        ConfigError: as `solve`.
    """
    crossed = np.flatnonzero(body.lower > body.upper)
    if len(crossed):
        hinge = body.model.names[int(crossed[0]) - 4]
        solution = Solution(state, _cost(state, residuals), 0, damping)
        return Outcome(solution, "infeasible", f"the limits of {hinge} allow no angle")
    start = _within(body, state)
    begun = Solution(start, _cost(start, residuals), 0, damping)
    together = bonds(residuals, len(body.link_names))
    given = parameters(start, residuals, together)
    if not np.isfinite(given.packed()).all():
        return Outcome(begun, "not finite", "a term or the start holds NaN or infinity")
    with _alone, signals_put_off():
        ran = _run(body, start, given, together, max(steps, LEAST_ITERATIONS))
    end = begun
    if np.isfinite(ran.q).all():
        reached = run_kinematics(body, ran.q)
        cost = _cost(reached, residuals)
        if cost <= begun.cost:
            end = Solution(reached, cost, ran.iterations, damping)
    return Outcome(end, STATUS.get(ran.words, "failed"), ran.words)


class _Run(NamedTuple):
    """What IPOPT hands back."""

    q: ndarray
    """Configuration of its last iterate, within the limits."""
    words: str
    """Its return status."""
    iterations: int
    """Iterations that it took."""


def _run(
    body: Body, start: BodyState, given: Parameters, together: ndarray, iterations: int
) -> _Run:
    """Build the programme at its first use, and solve it."""
    rows = tuple(tuple(row) for row in together.tolist())
    made = programme(tree_of(body), rows, given.places.shape[1], iterations)
    angles = np.concatenate([np.zeros(6), start.q[7:]])
    bounds = {"lbx": body.lower - angles, "ubx": body.upper - angles}
    x = made.solver(x0=0.0, p=given.packed().tolist(), **bounds)["x"]
    q = made.kinematics(x, given.q, given.origins_m)[0].full().ravel()
    q[:3] += start.q[:3]
    q[7:] = np.clip(q[7:], body.lower[6:], body.upper[6:])
    stats = made.solver.stats()
    return _Run(q, stats["return_status"], int(stats["iter_count"]))


def _within(body: Body, state: BodyState) -> BodyState:
    """The state with every hinge inside its limits; itself where nothing is outside."""
    hinges = np.clip(state.q[7:], body.lower[6:], body.upper[6:])
    if np.array_equal(hinges, state.q[7:]):
        return state
    return run_kinematics(body, np.concatenate([state.q[:7], hinges]))


def _cost(state: BodyState, residuals: Sequence[Residual]) -> float:
    """Cost summed over all terms."""
    return float(sum(residual.cost(state) for residual in residuals))
