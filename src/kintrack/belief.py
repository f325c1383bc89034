# SPDX-License-Identifier: Apache-2.0
"""Where the body is thought to be between frames, and how sure that is."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from kintrack.body import Body, BodyState, run_kinematics
from kintrack.config import TrackerConfig
from kintrack.human import motion_sigma
from kintrack.objective_config import MotionConfig
from kintrack.residuals.pose_prior import LegPrior
from kintrack.residuals.prior import TangentPrior, diagonal_prior, gaussian_prior

MOST_DOUBT = 10.0
"""Standard deviation of what a frame says nothing about [m, rad]; a matrix whose doubts span more
orders of magnitude cannot be inverted again."""


@dataclass(frozen=True)
class Belief:
    """A pose with its motion, covariance and history."""

    q: Float[ndarray, " nq"]
    """Configuration."""
    velocity: Float[ndarray, " nv"]
    """Tangent velocity [m/s, rad/s]."""
    covariance: Float[ndarray, "nv nv"]
    """Covariance in the tangent space at q."""
    timestamp_s: float
    """When [s]."""
    habit: Float[ndarray, " nv"]
    """Mean hinge angles of the last seconds [rad]; a hidden limb returns there."""
    hidden: Bool[ndarray, " nv"]
    """Hinges that were hidden."""
    misses: int = 0
    """Bad frames in a row."""

    def step_s(self, timestamp_s: float) -> float:
        """Time from here to a later frame, at least a millisecond [s]."""
        return max(timestamp_s - self.timestamp_s, 1e-3)


def covariance_of(H: Float[ndarray, "nv nv"]) -> Float[ndarray, "nv nv"]:
    """Covariance of a pose, from the matrix of its normal equations; H may be singular."""
    return np.linalg.inv(H + np.eye(len(H)) / MOST_DOUBT**2)


def first(
    q: Float[ndarray, " nq"],
    covariance: Float[ndarray, "nv nv"],
    timestamp_s: float,
    hidden: Bool[ndarray, " nv"] | None = None,
    habit: Float[ndarray, " nv"] | None = None,
) -> Belief:
    """A belief without history.

    Args:
        q: First pose.
        covariance: Its covariance.
        timestamp_s: When [s].
        hidden: Hinges that are hidden; none if None.
        habit: Angles to which hidden hinges return [rad]; those of the first pose if None.
    """
    nv = len(covariance)
    hidden = np.zeros(nv, dtype=bool) if hidden is None else hidden
    return Belief(
        q, np.zeros(nv), covariance, timestamp_s, angles(q) if habit is None else habit, hidden
    )


def guessed_habit(
    q: Float[ndarray, " nq"],
    resting: Float[ndarray, " nq"],
    hidden: Bool[ndarray, " nv"],
    legs: LegPrior,
) -> Float[ndarray, " nv"]:
    """What is taken for a habit at first: a first pose says nothing of a hidden arm, so it rests.

    Legs go with the body; those of the first pose are the best guess.

    Args:
        q: First pose.
        resting: Posture at rest.
        hidden: Hinges that are hidden in it.
        legs: Which hinges are legs'.

    Returns:
        Hinge angles [rad], 0 for the root.
    """
    guessed = hidden.copy()
    guessed[legs.hinges] = False
    return np.where(guessed, angles(resting), angles(q))


def predict(
    body: Body, belief: Belief, timestamp_s: float, motion: MotionConfig
) -> Float[ndarray, " nq"]:
    """Constant velocity within the limits; hidden hinges return to the posture held before."""
    dt = belief.step_s(timestamp_s)
    q = body.integrate(belief.q, belief.velocity * motion.damping * dt)
    hinges = belief.hidden[6:]
    back = -np.expm1(-dt / motion.hidden_s)
    q[7:][hinges] += back * (belief.habit[6:] - q[7:])[hinges]
    q[7:] = np.clip(q[7:], body.lower[6:], body.upper[6:])
    return q


def awaited_state(
    body: Body, belief: Belief | None, timestamp_s: float, motion: MotionConfig
) -> BodyState | None:
    """The body as it is predicted; None if nobody is tracked."""
    if belief is None:
        return None
    return run_kinematics(body, predict(body, belief, timestamp_s, motion))


def spread(
    body: Body,
    belief: Belief,
    hidden: Bool[ndarray, " nv"],
    timestamp_s: float,
    motion: MotionConfig,
    rest_sigma: Float[ndarray, " nv"],
) -> Float[ndarray, "nv nv"]:
    """How sure the prediction is: a hinge in view may go anywhere near, a hidden one strays.

    It drifts as a particle on a spring does (Uhlenbeck and Ornstein 1930): its variance goes to
    that of the pose prior with the time constant `hidden_s`. What the others do says nothing about
    it.

    Args:
        body: The body.
        belief: The last one.
        hidden: Hinges that are hidden now.
        timestamp_s: Now [s].
        motion: Speeds and times.
        rest_sigma: Standard deviation of every hinge about rest [rad].

    Returns:
        Covariance of the prediction, tangent space.
    """
    dt = belief.step_s(timestamp_s)
    added = motion_sigma(body, motion, dt) ** 2
    kept = np.exp(-2 * dt / motion.hidden_s)
    covariance = np.where(hidden[:, None] == hidden, belief.covariance, 0.0)
    covariance[np.ix_(hidden, hidden)] *= kept
    added[hidden] = (1 - kept) * rest_sigma[hidden] ** 2
    return covariance + np.diag(added)


def rest_priors(
    legs: LegPrior,
    resting: Float[ndarray, " nq"],
    sigma: Float[ndarray, " nv"],
    q: Float[ndarray, " nq"],
    unseen: Bool[ndarray, " nv"],
    hidden: Bool[ndarray, " nv"],
    frames: float,
    stance: Float[ndarray, " 3"] | None = None,
) -> list[TangentPrior]:
    """Towards rest, slowly what is not found; lost legs towards the postures that legs take.

    Legs carry the body and go with it: once a hinge of them is hidden, or not found where it is
    expected, the mixture holds both. A hidden arm may do anything: it is left to its habit.

    Args:
        legs: What postures legs take.
        resting: Posture at rest.
        sigma: Standard deviation of every hinge about it [rad].
        q: Where the body is expected.
        unseen: Hinges that were not found.
        hidden: Hinges that are hidden.
        frames: In so many frames a limb that is not found relaxes.
        stance: The pelvis' stance, see `residuals.pose_prior`; unknown if None.
    """
    slowly = np.where(unseen, np.sqrt(max(frames, 1.0)), 1.0)
    lost = hidden | unseen
    if not lost[legs.hinges].any():
        return [diagonal_prior(resting, np.where(hidden, np.inf, slowly * sigma))]
    free = hidden.copy()
    free[legs.hinges] = True
    held = diagonal_prior(resting, np.where(free, np.inf, slowly * sigma))
    return [legs.near(q, None, lost, stance), held]


def updated(
    body: Body,
    belief: Belief,
    q: Float[ndarray, " nq"],
    covariance: Float[ndarray, "nv nv"],
    unseen: Bool[ndarray, " nv"],
    hidden: Bool[ndarray, " nv"],
    timestamp_s: float,
    motion: MotionConfig,
) -> Belief:
    """The belief after a frame; hinges not seen slow down and teach nothing.

    Args:
        body: The body.
        belief: The last one.
        q: Pose found in the frame.
        covariance: Its covariance.
        unseen: Hinges that were not found.
        hidden: Hinges that were hidden.
        timestamp_s: When [s].
        motion: Speeds and times.
    """
    dt, lost = belief.step_s(timestamp_s), unseen | hidden
    velocity = body.difference(belief.q, q) / dt
    velocity[lost] = motion.damping * belief.velocity[lost]
    learnt = np.where(lost, 0.0, -np.expm1(-dt / motion.habit_s))
    habit = belief.habit + learnt * (angles(q) - belief.habit)
    return Belief(q, velocity, covariance, timestamp_s, habit, hidden)


def coasted(
    body: Body,
    belief: Belief,
    timestamp_s: float,
    motion: MotionConfig,
    rest_sigma: Float[ndarray, " nv"],
) -> Belief:
    """The belief after a frame that showed nothing of the person, see `spread`."""
    hidden = np.arange(body.nv) >= 6
    return replace(
        belief,
        q=predict(body, belief, timestamp_s, motion),
        velocity=motion.damping * belief.velocity,
        covariance=spread(body, belief, hidden, timestamp_s, motion, rest_sigma),
        timestamp_s=timestamp_s,
        hidden=hidden,
    )


def angles(q: Float[ndarray, " nq"]) -> Float[ndarray, " nv"]:
    """Hinge angles in the order of the tangent space, 0 for the root."""
    return np.concatenate([np.zeros(6), q[7:]])


def tracking_priors(
    awaited: BodyState,
    belief: Belief,
    legs: LegPrior,
    resting: Float[ndarray, " nq"],
    rest_sigma: Float[ndarray, " nv"],
    unseen: Bool[ndarray, " nv"],
    hidden: Bool[ndarray, " nv"],
    timestamp_s: float,
    config: TrackerConfig,
    stance: Float[ndarray, " 3"] | None = None,
) -> list[TangentPrior]:
    """What is known of a tracked body before its pixels are asked: its motion, and its posture.

    Args:
        awaited: The body as it is predicted.
        belief: The last one.
        legs: What postures legs take.
        resting: Resting pose.
        rest_sigma: Standard deviation of every hinge about it [rad].
        unseen: Hinges of which hardly any skin is found where it is expected.
        hidden: Hinges that are hidden.
        timestamp_s: Now [s].
        config: Motion and times.
        stance: The pelvis' stance where the body is expected; unknown if None.
    """
    surely = spread(awaited.body, belief, hidden, timestamp_s, config.motion, rest_sigma)
    frames = config.prior.unseen_s / belief.step_s(timestamp_s)
    return [
        gaussian_prior(awaited.q, surely),
        *rest_priors(legs, resting, rest_sigma, awaited.q, unseen, hidden, frames, stance),
    ]
