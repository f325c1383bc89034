# SPDX-License-Identifier: Apache-2.0
"""A start from part labels: any place, any heading, any posture, and not all of the person.

Every heading and several trunks are put onto the labelled points with the limbs that suit them best
(`placing`). The best are fitted like any frame, only from further away, and the one whose skin
and labels agree best with what is seen is kept.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.alignment import Fit, View, fit_pose, view_skin
from kintrack.association.observation import Observation
from kintrack.body import run_kinematics
from kintrack.config import TrackerConfig
from kintrack.errors import AssociationError
from kintrack.geometry import invert_rigid
from kintrack.human import Human, prior_sigma
from kintrack.judge import agreement
from kintrack.labelled_config import LabelledStartConfig
from kintrack.people import HEAD, TORSO, choose, find_people, only
from kintrack.residuals.prior import diagonal_prior
from kintrack.settling import settle
from kintrack.start.begun import Start
from kintrack.start.evidence import evidence_of
from kintrack.start.placing import guesses, view_mismatch
from kintrack.start.postures import postures_of

LEAST_TRUNK_M2 = 0.01
"""A start needs so much of head and trunk, across the line of sight: limbs alone are no body."""


def start_from_labels(
    human: Human,
    observation: Observation,
    T_world_camera: Float[ndarray, "4 4"],
    config: TrackerConfig,
    start: LabelledStartConfig | None = None,
    near_world: Float[ndarray, " 3"] | None = None,
) -> Start | None:
    """Find a labelled person and fit the body, whatever the pose.

    Args:
        human: Body and skin.
        observation: Labelled points; may show several people.
        T_world_camera: Camera pose.
        config: All weights.
        start: How many headings and fits.
        near_world: Where the person was last [m]; None for whoever is nearest.

    Returns:
        The best start with the observation of that person alone; None if nobody is in view or
        nothing can be fitted.
    """
    start = LabelledStartConfig() if start is None else start
    body = choose(find_people(observation, T_world_camera, start.people), near_world)
    if body is None:
        return None
    return start_at(human, only(observation, body), T_world_camera, config, start)


def start_at(
    human: Human,
    seen: Observation,
    T_world_camera: Float[ndarray, "4 4"],
    config: TrackerConfig,
    start: LabelledStartConfig,
) -> Start | None:
    """Fit the body to one person's labelled points, see `start_from_labels`."""
    if _trunk_m2(seen) < LEAST_TRUNK_M2:
        return None
    evidence = evidence_of(seen, T_world_camera)
    vertices = len(human.skin.labels)
    tries = guesses(
        postures_of(human), evidence, start.headings, start.side_m, vertices, start.fitted
    )
    T_camera_world = invert_rigid(T_world_camera)
    last = config.association.last_gate_m
    gates = np.geomspace(start.gate_m, last, start.rounds).tolist()

    def settled(view: View) -> Observation:
        return settle(seen, view, config.association.doubt_m, start.side_m)

    def fitted(q: ndarray, gates: list[float], likely_q: ndarray) -> tuple[float, Fit, View] | None:
        sigma = prior_sigma(human.body, config.prior)
        sigma[3:5] = start.roll_rad, start.pitch_rad
        prior = diagonal_prior(likely_q, sigma)
        view = view_skin(human, run_kinematics(human.body, q), T_camera_world, seen, config)
        try:
            fit = fit_pose(human, settled(view), q, [prior], T_world_camera, config, gates)
        except AssociationError:
            return None
        view = view_skin(human, fit.state, T_camera_world, seen, config)
        part_m = config.association.part_m
        return view_mismatch(view, evidence, start.side_m, part_m), fit, view

    best, least = None, np.inf
    for guess in tries:
        found = fitted(guess.q, gates, guess.q)
        if found is not None and found[0] + guess.unrest_m2 < least:
            best, likely_q, least = found, guess.q, found[0] + guess.unrest_m2
    if best is None:
        return None
    closer = fitted(best[1].state.q, [last] * start.last_rounds, likely_q)
    if closer is not None and closer[0] < best[0]:
        best = closer
    cost, fit, view = best
    own = settled(view)
    return Start(fit, agreement(view, own, config.judge.explained_m), own, cost)


def _trunk_m2(seen: Observation) -> float:
    """How much is seen of head and trunk [m^2]."""
    assert seen.labels is not None
    z = seen.points_camera[..., 2][(seen.labels == HEAD) | (seen.labels == TORSO)]
    return float((z**2).sum() / (seen.camera.fx * seen.camera.fy))
