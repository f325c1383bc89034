# SPDX-License-Identifier: Apache-2.0
"""Where somebody looks: neck and head turned towards a place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from synthesis.motions.curves import smooth
from synthesis.motions.holding import frame_path
from synthesis.motions.motion import RATE_HZ, Motion
from synthesis.people.person import Person

NECK_SHARE = 0.4
"""Share of the turn that the neck makes."""
MOST_DEG = {"rotation": 62.0, "down": 42.0, "up": 35.0}
"""How far neck and head turn together; the eyes do the rest [deg]."""
LAG_S = 0.10
"""Standard deviation of the Gaussian that rounds the gaze [s]."""


def look_at(
    person: Person,
    motion: Motion,
    places_world: Float[ndarray, "n 3"],
    share: Float[ndarray, " n"],
) -> Motion:
    """Turn neck and head so that the face points at a place.

    Args:
        person: Who.
        motion: The motion.
        places_world: What to look at in every frame [m], shape (N, 3).
        share: 0 = the head as it is, 1 = turned to the place, shape (N,).

    Returns:
        The motion with another head.
    """
    chest = frame_path(person, motion, "chest")
    head = frame_path(person, motion, "head_center")[:, :3, 3]
    way = np.einsum("nji,nj->ni", chest[:, :3, :3], places_world - head)
    yaw = np.arctan2(way[:, 1], np.maximum(way[:, 0], 0.05))
    down = -np.arctan2(way[:, 2], np.maximum(np.hypot(way[:, 0], way[:, 1]), 0.05))
    most, lowest, highest = np.radians([MOST_DEG["rotation"], MOST_DEG["down"], MOST_DEG["up"]])
    goals = {
        "rotation": smooth(np.clip(yaw, -most, most), RATE_HZ, LAG_S),
        "flexion": smooth(np.clip(down, -highest, lowest), RATE_HZ, LAG_S),
    }
    q = motion.q.copy()
    for hinge, goal in goals.items():
        for joint, part in (("neck", NECK_SHARE), ("head", 1.0 - NECK_SHARE)):
            k = person.body.dof(f"{joint}_{hinge}")
            angle = (1.0 - share) * q[:, k + 1] + share * part * goal
            q[:, k + 1] = np.clip(angle, person.body.lower[k] + 0.002, person.body.upper[k] - 0.002)
    return replace(motion, q=q)
