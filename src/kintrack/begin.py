# SPDX-License-Identifier: Apache-2.0
"""A start from joints that somebody else has found roughly."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.alignment import fit_pose, view_skin
from kintrack.association.observation import Observation, box_around, within
from kintrack.body import run_kinematics
from kintrack.config import TrackerConfig
from kintrack.errors import ConfigError
from kintrack.geometry import invert_rigid, transform_points
from kintrack.human import RESTING_DEG, Human, posed, prior_sigma
from kintrack.joints import JOINT_NAMES
from kintrack.judge import agreement
from kintrack.residuals.joints import JointResidual
from kintrack.residuals.prior import diagonal_prior
from kintrack.solver.gauss_newton import solve
from kintrack.start import Start

SIGMA_M = 0.03
"""How well the joints are taken to be known [m]."""
STEPS = 60
"""Solver steps from standing to the joints."""
NEEDED = ("l_hip", "r_hip", "l_shoulder", "r_shoulder")
"""Joints that tell place and heading."""


def begin(
    human: Human,
    observation: Observation,
    joints_camera: Float[ndarray, "j 3"],
    T_world_camera: Float[ndarray, "4 4"],
    config: TrackerConfig,
) -> Start:
    """Pose the body by rough joints, then fit it to the surface.

    Args:
        human: Body and skin.
        observation: All points.
        joints_camera: Joint centres [m], order of `JOINT_NAMES`; NaN for unknown ones.
        T_world_camera: Camera pose.
        config: All weights.

    Returns:
        The start.

    Raises:
        ConfigError: if a hip or a shoulder is not known.
        AssociationError: if nothing observed lies near the body.
    """
    index = {name: j for j, name in enumerate(JOINT_NAMES)}
    known = np.isfinite(joints_camera).all(axis=1)
    missing = [name for name in NEEDED if not known[index[name]]]
    if missing:
        raise ConfigError(f"joints {', '.join(missing)} are not finite; they are needed to begin")
    joints = transform_points(T_world_camera, joints_camera)
    l_hip, r_hip, l_shoulder, r_shoulder = (joints[index[name]] for name in NEEDED)
    left = l_hip - r_hip + l_shoulder - r_shoulder
    yaw = np.arctan2(-left[0], left[1])
    body = human.body
    resting = posed(body, RESTING_DEG)
    resting[:3] = 0.5 * (l_hip + r_hip)
    resting[3:7] = [0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2)]
    prior = diagonal_prior(resting, prior_sigma(body, config.prior))
    pull = JointResidual(np.flatnonzero(known), joints[known], SIGMA_M)
    state = run_kinematics(body, resting)
    q = solve(body, state, [pull, prior], STEPS, config.solver.damping).state.q
    T_camera_world = invert_rigid(T_world_camera)
    view = view_skin(human, run_kinematics(body, q), T_camera_world, observation, config)
    box = box_around(view.vertices_camera, config.association.region_margin_m)
    seen = within(observation, box)
    prior = diagonal_prior(q, prior_sigma(body, config.prior))
    gates = [config.association.last_gate_m] * config.solver.rounds
    fit = fit_pose(human, seen, q, [prior], T_world_camera, config, gates)
    view = view_skin(human, fit.state, T_camera_world, seen, config)
    return Start(fit, agreement(view, seen, config.judge.explained_m), seen)
