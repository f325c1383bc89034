# SPDX-License-Identifier: Apache-2.0
"""Terms of every kind around a pose, as a frame has them."""

import numpy as np

from kintrack.floor import Floor, soles_of
from kintrack.floor_config import ContactConfig
from kintrack.human import RESTING_DEG, posed, prior_sigma
from kintrack.objective_config import PriorConfig, SurfaceConfig
from kintrack.residuals.contact import Contact, contact_residual
from kintrack.residuals.joints import JointResidual
from kintrack.residuals.pose_prior import load_leg_prior
from kintrack.residuals.prior import diagonal_prior, gaussian_prior
from kintrack.residuals.surface import silhouette_residual, surface_residual
from kintrack.residuals.targets import TargetResidual
from kintrack.skin import skinned_vertices, vertex_normals


def surface(human, state, rng, pairs=400, noise_m=0.01):
    vertices = skinned_vertices(state, human.skin)
    vertex = rng.choice(len(vertices), pairs)
    points = vertices[vertex] + rng.normal(0, noise_m, (pairs, 3))
    normals = vertex_normals(vertices, human.skin.faces)
    return surface_residual(human.skin, vertex, points, vertices, normals, SurfaceConfig())


def silhouette(human, state, rng):
    vertices = skinned_vertices(state, human.skin)
    vertex = rng.choice(len(vertices), 60)
    points = vertices[vertex] + rng.normal(0, 0.1, (60, 3))
    return silhouette_residual(human.skin, vertex, points, vertices, SurfaceConfig())


def contact(human, state, rng):
    vertices, soles = skinned_vertices(state, human.skin), soles_of(human)
    up = np.array([0.05, -0.03, 1.0]) / np.linalg.norm([0.05, -0.03, 1.0])
    floor = Floor(up, float(vertices[soles[0, 0]] @ up))
    return contact_residual(
        human.skin, Contact(floor, soles, np.ones(2, dtype=bool)), vertices, ContactConfig()
    )


def leg_prior(human, state, rng):
    doubt = rng.uniform(1.0, 5.0, human.body.nv)
    return load_leg_prior(human.body, PriorConfig()).near(state.q, doubt)


def pose_prior(human, state, rng):
    return diagonal_prior(posed(human.body, RESTING_DEG), prior_sigma(human.body, PriorConfig()))


def motion_prior(human, state, rng):
    root = rng.normal(0, 0.1, (human.body.nv, human.body.nv))
    covariance = root @ root.T + 0.01 * np.eye(human.body.nv)
    predicted = human.body.integrate(state.q, rng.normal(0, 0.2, human.body.nv))
    return gaussian_prior(predicted, covariance)


def joints(human, state, rng):
    rows = np.array([0, 4, 8, 12])
    places = state.joint_positions_world[rows] + rng.normal(0, 0.1, (4, 3))
    return JointResidual(rows, places, 0.03)


def targets(human, state, rng):
    rows = np.array([3, 6, 11, 14])
    away = rng.normal(size=(4, 3))
    away *= np.array([0.05, 0.4, 0.3, 0.6])[:, None] / np.linalg.norm(away, axis=1, keepdims=True)
    return TargetResidual(rows, state.joint_positions_world[rows] + away, 0.1, 0.2)


SQUARES = (surface, silhouette, contact, leg_prior, pose_prior, motion_prior, joints)
"""Terms that the nonlinear programme takes as they are."""
TERMS = (*SQUARES, targets)
