# SPDX-License-Identifier: Apache-2.0
"""Limbs behind something else: they follow the prediction and the posture held before."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool
from numpy import ndarray

from kintrack.alignment import View
from kintrack.association.hiding import hidden_vertices
from kintrack.association.observation import Observation
from kintrack.association.window import associate
from kintrack.config import OcclusionConfig
from kintrack.human import Human

UNSEEN_SHARE = 0.08
"""A hinge that moves skin of which less than this share is observed counts as not seen."""


def hidden_hinges(
    human: Human, expected: View, observation: Observation, config: OcclusionConfig
) -> Bool[ndarray, " nv"]:
    """Velocity components that move only skin of which the camera can say nothing.

    Args:
        human: Body and skin.
        expected: The skin where it is predicted.
        observation: What was observed.
        config: What counts as hidden.

    Returns:
        True per hidden hinge, shape (nv,); none in an image without labels.
    """
    body, owner = human.body, human.skin.links[:, 0]
    if observation.labels is None:
        return np.zeros(body.nv, dtype=bool)
    open_skin = expected.visible & ~hidden_vertices(
        observation,
        expected.vertices_camera,
        expected.visible,
        expected.labels,
        config.nearer_m,
    )
    n = len(body.link_names)
    open_moved = np.bincount(owner[open_skin], minlength=n) @ body.support
    moved = np.bincount(owner, minlength=n) @ body.support
    hinges = open_moved < config.open_share * moved
    hinges[:6] = False
    return hinges


def unseen_hinges(
    human: Human, expected: View, observation: Observation, near_m: float
) -> Bool[ndarray, " nv"]:
    """Velocity components of which hardly any skin that they move is observed where expected.

    Args:
        human: Body and skin.
        expected: The skin where it is predicted.
        observation: What was observed.
        near_m: Skin with a point this near is observed [m].
    """
    found = associate(
        observation,
        expected.vertices_camera,
        expected.visible,
        near_m,
        near_m,
        0,
        expected.labels,
    )
    body, owner = human.body, human.skin.links[:, 0]
    n = len(body.link_names)
    seen = np.bincount(owner[found.vertex], minlength=n) @ body.support
    moved = np.bincount(owner, minlength=n) @ body.support
    return seen < UNSEEN_SHARE * moved
