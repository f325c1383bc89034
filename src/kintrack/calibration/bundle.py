# SPDX-License-Identifier: Apache-2.0
"""One shape for several frames, jointly with the pose in each.

With d_i = s_i(q_f, b) - p_i for the pairs of frame f, the cost is the surface term of
`kintrack.residuals.surface` over all frames, its scale the folds' (`kintrack.clothing`), plus
pose priors, plus the floor under the lower foot (`kintrack.residuals.contact`), plus
0.5 |(b - mean) / sigma|^2 over shape and clothes. Its Gauss-Newton matrix is an arrow: one block
per pose, bordered by the shape. The poses are eliminated (Schur complement), the shape is solved
within its bounds, and each pose follows within its hinge limits [Triggs et al., Bundle adjustment,
1999, section 6.1].

The pairs say less than their number suggests, by a factor c = inflation (rms / usual_rms)^4: with
H_seen the matrix of all frames, poses eliminated, and H_known that of prior and measurements, the
covariance is (H_seen / c + H_known)^-1. In the fit a measurement weighs c-fold against the pairs
for the same reason, and the prior sqrt(c)-fold: where little is seen the estimate stays near what
most people are. With 1 it strays, with c it holds unusual people back (`docs/shape.md`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.linalg import cho_factor, cho_solve

from kintrack.calibration.blocks import Blocks, Snapshot, blocks_of
from kintrack.calibration.config import BundleConfig
from kintrack.config import TrackerConfig
from kintrack.human import RESTING_DEG, Human, posed, prior_sigma
from kintrack.residuals.prior import diagonal_prior
from kintrack.shape import ShapeSpace
from kintrack.solver.gauss_newton import bounded_step, step_bounds


@dataclass(frozen=True)
class Gaussian:
    """What is known of the coefficients: independent, within bounds."""

    mean: Float[ndarray, " p"]
    """Most likely values."""
    sigma: Float[ndarray, " p"]
    """Standard deviations."""
    lower: Float[ndarray, " p"]
    """Least values."""
    upper: Float[ndarray, " p"]
    """Largest values."""


@dataclass(frozen=True)
class Measurement:
    """A linear function of the coefficients that somebody has measured: a . b = value."""

    gradient: Float[ndarray, " p"]
    """a."""
    value: float
    """What was measured."""
    sigma: float
    """Its standard deviation."""


@dataclass(frozen=True)
class Bundle:
    """The solution."""

    b: Float[ndarray, " p"]
    """Coefficients."""
    covariance: Float[ndarray, "p p"]
    """Their covariance, the poses' doubt included."""
    qs: Float[ndarray, "f nq"]
    """Pose in every frame."""
    rms_m: Float[ndarray, " f"]
    """Root mean square of the inliers' point-to-plane residuals per frame [m]."""
    inliers: int
    """Pairs with a robust weight above one half, all frames."""


def solve_bundle(
    space: ShapeSpace,
    snapshots: Sequence[Snapshot],
    start: Float[ndarray, " p"],
    prior: Gaussian,
    fold_m: Callable[[Float[ndarray, " p"]], Float[ndarray, " v"]],
    tracker: TrackerConfig,
    config: BundleConfig,
    measurements: Sequence[Measurement] = (),
) -> Bundle:
    """Fit shape and poses.

    Args:
        space: Bodies, clothes included.
        snapshots: Frames, each with a pose.
        start: First guess of the P coefficients.
        prior: What is known of them.
        fold_m: Spread of the seen surface about each vertex, given the coefficients [m].
        tracker: Association and pose priors.
        config: Everything else.
        measurements: What else is known.

    Returns:
        The solution.

    Raises:
        AssociationError: if in some frame nothing observed lies near the skin.
    """
    b, qs = np.array(start, dtype=float), [snapshot.q.copy() for snapshot in snapshots]
    falling = np.geomspace(config.first_gate_m, config.last_gate_m, config.rounds // 2)
    gates = [*falling[:-1], *[config.last_gate_m] * (config.rounds - len(falling) + 1)]
    frames: list[Blocks] = []
    for gate_m in gates:
        body = space.body(b)
        folds = fold_m(b)
        person = Human(body, space.bound(b), b)
        rest = diagonal_prior(posed(body, RESTING_DEG), prior_sigma(body, tracker.prior))
        frames = [
            blocks_of(space, person, q, snapshot, rest, folds, float(gate_m), tracker, config)
            for q, snapshot in zip(qs, snapshots, strict=True)
        ]
        H, g = _known(b, prior, measurements, _doubt(frames, config))
        H, g = _without_poses(H, g, frames)
        step = bounded_step(H, g, prior.lower - b, prior.upper - b)
        b = b + step
        for i, frame in enumerate(frames):
            low, high = step_bounds(body, qs[i])
            dv = bounded_step(frame.H_pose, frame.g_pose + frame.H_cross @ step, low, high)
            qs[i] = body.integrate(qs[i], dv)
        small = (np.abs(step) < config.tolerance * prior.sigma).all()
        if small and gate_m == config.last_gate_m:
            break
    none = np.zeros_like(b)
    seen, _ = _without_poses(np.diag(none), none, frames)
    known, _ = _known(b, prior, measurements)
    return Bundle(
        b,
        np.linalg.inv(seen / _doubt(frames, config) + known),
        np.array(qs),
        np.array([frame.rms_m for frame in frames]),
        sum(frame.inliers for frame in frames),
    )


def _known(
    b: ndarray, prior: Gaussian, measurements: Sequence[Measurement], doubt: float = 1.0
) -> tuple[ndarray, ndarray]:
    """Matrix and gradient of prior and measurements, heavier the more the pairs are doubted."""
    H = np.diag(np.sqrt(doubt) * prior.sigma**-2.0)
    g = np.sqrt(doubt) * (b - prior.mean) / prior.sigma**2
    for m in measurements:
        weight = doubt / m.sigma**2
        H = H + weight * np.outer(m.gradient, m.gradient)
        g = g + weight * m.gradient * (m.gradient @ b - m.value)
    return H, g


def _doubt(frames: Sequence[Blocks], config: BundleConfig) -> float:
    """By how much the pairs say less than their number suggests: c of the module's docstring."""
    squares = [frame.rms_m**2 for frame in frames if np.isfinite(frame.rms_m)]
    ratio = np.mean(squares) / config.usual_rms_m**2 if squares else np.inf
    return config.inflation * float(np.clip(ratio, 1e-3, 1e3)) ** 2


def _without_poses(H: ndarray, g: ndarray, frames: Sequence[Blocks]) -> tuple[ndarray, ndarray]:
    """Matrix and gradient of the shape alone, poses eliminated."""
    for frame in frames:
        factor = cho_factor(frame.H_pose)
        H = H + frame.H_shape - frame.H_cross.T @ cho_solve(factor, frame.H_cross)
        g = g + frame.g_shape - frame.H_cross.T @ cho_solve(factor, frame.g_pose)
    return 0.5 * (H + H.T), g
