# SPDX-License-Identifier: Apache-2.0
"""Lengths of a person that postures depend on, read from skeleton and skin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.body import leg_length, run_kinematics
from kintrack.joints import JOINT_NAMES
from kintrack.skin import skinned_vertices
from synthesis.people.person import Person

TRUNK_LINKS = ("pelvis", "abdomen", "chest")
WIDTH_QUANTILE = 0.95
"""Share of the trunk's skin that its half width encloses."""
BAND_M = 0.05
"""Height of the bands in which the front of the trunk is measured [m]."""


@dataclass(frozen=True)
class Measures:
    """A person in zero pose; heights and depths count from the chest link's origin."""

    leg_m: float
    """Hip to ankle of the straight leg [m]."""
    arm_m: float
    """Shoulder to wrist of the straight arm [m]."""
    shoulder: Float[ndarray, " 3"]
    """Left shoulder's centre, chest frame [m]."""
    eyes: Float[ndarray, " 3"]
    """Middle of the head, chest frame [m]."""
    pelvis_chest: Float[ndarray, " 3"]
    """Origin of the chest in the pelvis' frame [m]."""
    half_width_m: float
    """Half the width of the waist [m]."""
    middle_x_m: float
    """Middle of the waist's depth, chest frame [m]."""
    half_depth_m: float
    """Half the depth of the waist [m]."""
    front_heights_m: Float[ndarray, " k"]
    """Heights at which the front is known, increasing [m]."""
    front_m: Float[ndarray, " k"]
    """How far forward the trunk reaches there [m]."""

    def front(self, height_m: float) -> float:
        """How far forward the trunk reaches at a height above the chest's origin [m]."""
        return float(np.interp(height_m, self.front_heights_m, self.front_m))


def measure(person: Person) -> Measures:
    """Measure a person.

    Args:
        person: Who.

    Returns:
        The lengths.
    """
    state = run_kinematics(person.body, person.body.neutral())
    names = person.skin.link_names
    chest = state.Ts_world_link[names.index("chest")][:3, 3]
    joint = dict(zip(JOINT_NAMES, state.joint_positions_world, strict=True))
    links = [names.index(name) for name in TRUNK_LINKS]
    weights = (person.skin.weights * np.isin(person.skin.links, links)).sum(axis=1)
    trunk = skinned_vertices(state, person.skin)[weights > 0.6] - chest
    hips_z = joint["l_hip"][2] - chest[2]
    waist = trunk[(trunk[:, 2] > hips_z + 0.06) & (trunk[:, 2] < 0.08)]
    half_width = float(np.quantile(np.abs(waist[:, 1]), WIDTH_QUANTILE))
    back, front = np.quantile(waist[:, 0], [1.0 - WIDTH_QUANTILE, WIDTH_QUANTILE])
    heights = np.arange(hips_z, joint["l_shoulder"][2] - chest[2], BAND_M)
    middle = np.abs(trunk[:, 1]) < 0.8 * half_width
    fronts = [
        trunk[middle & (np.abs(trunk[:, 2] - z) < BAND_M), 0].max(initial=front) for z in heights
    ]
    bones = ("l_shoulder", "l_elbow", "l_wrist")
    return Measures(
        leg_m=leg_length(person.body),
        arm_m=float(sum(np.linalg.norm(np.diff([joint[b] for b in bones], axis=0), axis=1))),
        shoulder=joint["l_shoulder"] - chest,
        eyes=joint["head"] - chest,
        pelvis_chest=chest - state.Ts_world_link[0][:3, 3],
        half_width_m=half_width,
        middle_x_m=float(0.5 * (back + front)),
        half_depth_m=float(0.5 * (front - back)),
        front_heights_m=heights,
        front_m=np.array(fronts),
    )
