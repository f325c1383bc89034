# SPDX-License-Identifier: Apache-2.0
"""Stature and build of a person from the frame of the start."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.alignment import Fit, fit_pose, view_skin
from kintrack.clothing import dressed_human
from kintrack.config import TrackerConfig
from kintrack.errors import AssociationError
from kintrack.geometry import invert_rigid
from kintrack.human import Human, prior_sigma
from kintrack.judge import agreement, distance_between
from kintrack.residuals.prior import diagonal_prior
from kintrack.start.begun import Start


def sized(
    human: Human,
    begun: Start,
    T_world_camera: Float[ndarray, "4 4"],
    config: TrackerConfig,
) -> tuple[Human, Start]:
    """Stature and build of the person, from the frame of the start alone.

    One coefficient after the other is stepped over its range, the pose refitted for each value,
    and the value with the least capped skin-to-point distance kept, refined by a parabola.

    Args:
        human: Body of the start.
        begun: The start.
        T_world_camera: Camera pose.
        config: All weights.

    Returns:
        The sized human and the start refitted with it.

    Raises:
        AssociationError: if no observed point lies near the skin of some size.
    """
    T_camera_world = invert_rigid(T_world_camera)
    gates = [config.association.last_gate_m] * 4
    seen = begun.observation

    def refit(shape: ndarray) -> tuple[float, Human, Fit]:
        person = dressed_human(shape, human.clothing_m, human.folder)
        prior = diagonal_prior(begun.fit.state.q, prior_sigma(person.body, config.prior))
        fit = fit_pose(person, seen, begun.fit.state.q, [prior], T_world_camera, config, gates)
        view = view_skin(person, fit.state, T_camera_world, seen, config)
        spread = 1e-4 * float(shape @ shape)
        return distance_between(view, seen, config.judge.explained_m) + spread, person, fit

    shape = np.zeros(config.start.shape_coefficients)
    limit = config.start.shape_limit
    for k in range(len(shape)):
        values = np.linspace(-limit, limit, 7)
        errors = []
        for value in values:
            shape[k] = value
            errors.append(refit(shape)[0])
        i = int(np.argmin(errors))
        shape[k] = values[i]
        if 0 < i < len(values) - 1:
            a, b, c = errors[i - 1 : i + 2]
            bend = a - 2 * b + c
            shape[k] += 0.5 * (a - c) / bend * (values[1] - values[0]) if bend > 0 else 0.0
    _, person, fit = refit(shape)
    view = view_skin(person, fit.state, T_camera_world, seen, config)
    return person, Start(fit, agreement(view, seen, config.judge.explained_m), seen)


def in_own_size(
    human: Human,
    found: Start | None,
    T_world_camera: Float[ndarray, "4 4"],
    config: TrackerConfig,
) -> tuple[Human, Start | None]:
    """The person of a start in her own size, unless it is known already; None if it does not fit.

    Args:
        human: Body of the start.
        found: The start, if there is one.
        T_world_camera: Camera pose.
        config: All weights.
    """
    if found is None or len(human.shape) or not config.start.shape_coefficients:
        return human, found
    try:
        return sized(human, found, T_world_camera, config)
    except AssociationError:
        return human, None
