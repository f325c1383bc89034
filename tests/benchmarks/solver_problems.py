# SPDX-License-Identifier: Apache-2.0
"""The problems that a tracked recording poses, solved by both solvers and without limits."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from solver_figure import LimitTrace

from kintrack.body import Body, BodyState
from kintrack.human import load_human
from kintrack.residuals.linearization import Residual
from kintrack.residuals.surface import SurfaceResidual
from kintrack.solver import gauss_newton
from kintrack.solver.choice import SOLVERS
from kintrack.solver.ipopt import minimise

STEPS = (1, 2, 3, 5, 10, 20, 40)
"""Steps after which Gauss-Newton is looked at; the last counts as its end."""
AT_LIMIT_RAD = 1e-3
"""A hinge this near its limit is on it [rad]."""


@dataclass(frozen=True)
class Problem:
    """One call of a solver."""

    body: Body
    """The body with its limits."""
    state: BodyState
    """Where it started."""
    residuals: Sequence[Residual]
    """Frozen terms."""


@dataclass(frozen=True)
class Agreement:
    """Both solvers at the end of one problem."""

    recording: str
    """Where the problem comes from."""
    angles_rad: dict[str, Float[ndarray, " h"]]
    """How it was solved -> hinge angles at the end [rad]."""
    active: int
    """Hinges on a limit at IPOPT's end."""
    excess: Float[ndarray, " s"]
    """Cost of Gauss-Newton after each of `STEPS` over IPOPT's, less 1."""
    joints_mm: float
    """Largest distance between a joint of both at the end [mm]."""
    iterations: int
    """IPOPT's iterations."""
    pairs: int
    """Vertex-point pairs."""
    inside_rad: float
    """How far inside its limit IPOPT leaves a hinge that Gauss-Newton put on it, at most [rad]."""
    beyond_deg: float
    """How far beyond its limit a hinge goes if there are no limits, at most [deg]."""
    freed_mm: float
    """How far a joint moves if there are no limits, at most [mm]."""


def without_limits(body: Body) -> Body:
    """The same body with hinges that turn freely."""
    wide = np.full(body.nv, np.inf)
    return replace(body, lower=-wide, upper=wide)


@contextmanager
def recorded() -> Iterator[list[Problem]]:
    """The problems that the tracker hands to Gauss-Newton, but those of a start."""
    honest, problems = SOLVERS["gauss-newton"], []

    def spy(body, state, residuals, steps, damping):
        if len(residuals) > 2:
            problems.append(Problem(body, state, residuals))
        return honest(body, state, residuals, steps, damping)

    SOLVERS["gauss-newton"] = spy
    try:
        yield problems
    finally:
        SOLVERS["gauss-newton"] = honest


def first_and_last(problems: Sequence[Problem]) -> list[Problem]:
    """Of every frame, the first and the last round; a frame's rounds share their priors."""
    at = [
        i for i in range(len(problems)) if not i or _prior(problems[i]) != _prior(problems[i - 1])
    ]
    ends = [*at[1:], len(problems)]
    return [problems[k] for pair in zip(at, ends, strict=True) for k in (pair[0], pair[1] - 1)]


def _prior(problem: Problem) -> int:
    return id(problem.residuals[-1])


def compare(recording: str, problem: Problem) -> Agreement:
    """Solve a problem to the end with both solvers, and without limits."""
    body, state, terms = problem.body, problem.state, problem.residuals
    end = minimise(body, state, terms).solution
    solutions = [gauss_newton.solve(body, state, terms, steps, 1e-3) for steps in STEPS]
    other = solutions[-1].state
    free = gauss_newton.solve(without_limits(body), state, terms, STEPS[-1], 1e-3).state
    lower, upper = body.lower[6:], body.upper[6:]
    room = np.minimum(end.state.q[7:] - lower, upper - end.state.q[7:])
    theirs = np.minimum(other.q[7:] - lower, upper - other.q[7:])
    beyond = np.maximum(lower - free.q[7:], free.q[7:] - upper)
    return Agreement(
        recording=recording,
        angles_rad={
            "no limits": free.q[7:],
            "gauss-newton": other.q[7:],
            "ipopt": end.state.q[7:],
        },
        active=int((room < AT_LIMIT_RAD).sum()),
        excess=np.array([s.cost for s in solutions]) / end.cost - 1.0,
        joints_mm=_apart_mm(end.state, other),
        iterations=end.steps,
        pairs=sum(len(t.vertex) for t in terms if isinstance(t, SurfaceResidual)),
        inside_rad=float(room[theirs == 0.0].max(initial=0.0)),
        beyond_deg=float(np.degrees(max(beyond.max(), 0.0))),
        freed_mm=_apart_mm(end.state, free),
    )


def _apart_mm(a: BodyState, b: BodyState) -> float:
    apart = np.linalg.norm(a.joint_positions_world - b.joint_positions_world, axis=1)
    return float(1e3 * apart.max())


def limit_trace(agreements: Sequence[Agreement]) -> LimitTrace:
    """The hinge that would pass its limit furthest on average, in its recording's last rounds."""
    body = load_human().body
    lower, upper = body.lower[6:], body.upper[6:]
    best, found = -1.0, None
    for name in dict.fromkeys(a.recording for a in agreements):
        members = [a for a in agreements if a.recording == name][1::2]
        free = np.array([a.angles_rad["no limits"] for a in members])
        beyond = np.maximum(np.maximum(lower - free, free - upper), 0.0).mean(axis=0)
        if beyond.max() > best:
            best, found = beyond.max(), (name, int(beyond.argmax()), members)
    assert found is not None
    name, hinge, members = found
    return LimitTrace(
        hinge=f"{body.model.names[hinge + 2].replace('_', ' ')}, {name}",
        lower_deg=float(np.degrees(lower[hinge])),
        upper_deg=float(np.degrees(upper[hinge])),
        angles_deg={
            says: np.degrees([a.angles_rad[says][hinge] for a in members])
            for says in members[0].angles_rad
        },
    )


def shown(agreement: Agreement) -> dict[str, Any]:
    """An agreement for JSON."""
    angles = {says: rad.tolist() for says, rad in agreement.angles_rad.items()}
    return asdict(agreement) | {"excess": agreement.excess.tolist(), "angles_rad": angles}
