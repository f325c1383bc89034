# SPDX-License-Identifier: Apache-2.0
"""A start without labels: one roughly upright person, no clutter.

The nearest person-sized blob of the depth image is found, the body is put there in a few postures
and headings, each guess is fitted, and the one that explains the blob best is kept. Depth alone
barely tells a chest from a back, so of two equally good guesses the one facing the camera wins.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from kintrack.alignment import fit_pose, view_skin
from kintrack.association.observation import Observation
from kintrack.body import run_kinematics
from kintrack.components import components
from kintrack.config import StartConfig, TrackerConfig
from kintrack.errors import AssociationError
from kintrack.geometry import invert_rigid, transform_points
from kintrack.human import (
    ARMS_OUT_DEG,
    ARMS_UP_DEG,
    REACHING_DEG,
    RESTING_DEG,
    SITTING_DEG,
    Human,
    posed,
    prior_sigma,
)
from kintrack.judge import agreement
from kintrack.residuals.prior import diagonal_prior
from kintrack.skin import skinned_vertices
from kintrack.start.begun import Start

GUESSES = (
    (RESTING_DEG, 0.0),
    (RESTING_DEG, -50.0),
    (RESTING_DEG, 50.0),
    (SITTING_DEG, 0.0),
    (SITTING_DEG, -50.0),
    (SITTING_DEG, 50.0),
    (ARMS_OUT_DEG, 0.0),
    (ARMS_UP_DEG, 0.0),
    (REACHING_DEG, 0.0),
)
"""Posture and where the chest points, 0 = at the camera [deg]."""
EDGE_M = 0.12
"""Depth step between neighbouring cells that parts two things [m]."""


def find_person(
    observation: Observation, T_world_camera: Float[ndarray, "4 4"], config: StartConfig
) -> Bool[ndarray, "h w"] | None:
    """Mask of the nearest blob that has a person's height and width.

    Args:
        observation: All points.
        T_world_camera: Camera pose; heights are along the world's z.
        config: What counts as a person.

    Returns:
        Mask at working resolution, or None if there is no such blob.
    """
    cell = max(1, observation.camera.width // 160)
    points = observation.points_camera[::cell, ::cell]
    valid = observation.region[::cell, ::cell] & (points[..., 2] <= config.max_distance_m)
    blob = components(points[..., 2], valid, EDGE_M, 0.0)
    sizes = np.bincount(blob[valid], minlength=1)
    pieces = {i: points[blob == i] for i in np.flatnonzero(sizes >= LEAST_CELLS)}
    people = [i for i, p in pieces.items() if _person_sized(p, T_world_camera, config)]
    if not people:
        return None
    nearest = min(people, key=lambda i: float(np.median(pieces[i][:, 2])))
    taken, person = [nearest], pieces[nearest]
    for i in sorted(pieces, key=lambda i: -sizes[i]):
        joined = np.concatenate([person, pieces[i]])
        if i != nearest and _touch(person, pieces[i]):
            if _person_sized(joined, T_world_camera, config):
                taken, person = [*taken, i], joined
    whole = np.kron(np.where(np.isin(blob, taken), points[..., 2], np.nan), np.ones((cell, cell)))
    h, w = observation.region.shape
    rim = np.abs(observation.points_camera[..., 2] - whole[:h, :w]) <= EDGE_M
    return rim & observation.region


LEAST_CELLS = 20
"""Smaller pieces of the depth image are ignored."""
GAP_M = np.array([0.08, 0.08, 0.4])
"""Pieces this near in x, y and z may be one person, parted by an arm in front [m]."""


def _person_sized(
    points_camera: Float[ndarray, "n 3"], T_world_camera: Float[ndarray, "4 4"], config: StartConfig
) -> bool:
    """True if some points have a person's height and width."""
    world = transform_points(T_world_camera, points_camera)
    height = np.ptp(np.quantile(world[:, 2], [0.01, 0.99]))
    across = np.ptp(np.quantile(points_camera[:, 0], [0.02, 0.98]))
    return bool(config.min_height_m <= height <= config.max_height_m and 0.2 <= across <= 2.2)


def _touch(a: Float[ndarray, "n 3"], b: Float[ndarray, "m 3"]) -> bool:
    """True if the bounding boxes of two pieces are no further apart than `GAP_M`."""
    gap = np.maximum(a.min(axis=0) - b.max(axis=0), b.min(axis=0) - a.max(axis=0))
    return bool((gap <= GAP_M).all())


def start(
    human: Human,
    observation: Observation,
    T_world_camera: Float[ndarray, "4 4"],
    config: TrackerConfig,
) -> Start | None:
    """Find a person and fit the body from several guesses.

    Args:
        human: Body and skin.
        observation: All points.
        T_world_camera: Camera pose.
        config: All weights.

    Returns:
        The best start, or None if nobody is in view.
    """
    mask = find_person(observation, T_world_camera, config.start)
    if mask is None:
        return None
    seen = replace(observation, region=mask)
    T_camera_world = invert_rigid(T_world_camera)
    a = config.association
    gates = np.geomspace(a.start_gate_m, a.last_gate_m, config.start.rounds).tolist()
    best, best_score = None, -np.inf
    for posture, heading in GUESSES:
        q = _placed(human, seen, T_world_camera, posture, np.radians(heading))
        prior = diagonal_prior(q, prior_sigma(human.body, config.prior))
        try:
            fit = fit_pose(human, seen, q, [prior], T_world_camera, config, gates)
        except AssociationError:
            continue
        view = view_skin(human, fit.state, T_camera_world, seen, config)
        agreed = agreement(view, seen, config.judge.explained_m)
        score = agreed.explained + agreed.supported - fit.surface.rms_m / 0.03
        score -= 0.02 * abs(heading) / 50 + prior.cost(fit.state) / 500
        if score > best_score:
            best, best_score = Start(fit, agreed, seen), score
    return best


def _placed(human, seen: Observation, T_world_camera, posture, heading_rad) -> ndarray:
    """The posture standing where the blob is: top of the head at the top of the blob."""
    points = transform_points(T_world_camera, seen.points_camera[seen.region])
    q = posed(human.body, posture)
    vertices = skinned_vertices(run_kinematics(human.body, q), human.skin)
    viewpoint = T_world_camera[:3, 3]
    centre = np.median(points, axis=0)
    away = centre - viewpoint
    away[2] = 0
    away /= np.linalg.norm(away)
    yaw = np.arctan2(-away[1], -away[0]) + heading_rad
    q[:3] = centre + 0.1 * away
    q[2] = np.quantile(points[:, 2], 0.995) - vertices[:, 2].max()
    q[3:7] = [0, 0, np.sin(yaw / 2), np.cos(yaw / 2)]
    return q
