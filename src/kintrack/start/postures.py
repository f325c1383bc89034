# SPDX-License-Identifier: Apache-2.0
"""Postures that a start tries: trunks, arms and legs, each on its own, as skin of the root frame.

The four limbs hang on the trunk without touching each other, so that twenty arms and fifteen legs
make all their combinations at the price of forty limbs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from jaxtyping import Float, Int
from numpy import ndarray

from kintrack.body import BodyState, run_kinematics
from kintrack.geometry import LABELS, invert_rigid
from kintrack.human import Human, posed
from kintrack.skin import skinned_vertices, vertex_normals

TRUNKS_DEG = (
    (0.0, 0.0),
    (18.0, 8.0),
    (40.0, 20.0),
    (55.0, 50.0),
    (85.0, 25.0),
    (-12.0, 0.0),
)
"""Pitch of the pelvis forward, flexion of spine and of chest [deg]."""
ARM_HINGES = ("shoulder_elevation", "shoulder_plane", "shoulder_rotation", "elbow_flexion")
ARMS_DEG = (
    (10.0, 0.0, 0.0, 15.0),
    (10.0, -30.0, 0.0, 15.0),
    (20.0, 25.0, 0.0, 30.0),
    (15.0, 10.0, 0.0, 90.0),
    (15.0, 15.0, 45.0, 95.0),
    (15.0, 0.0, -45.0, 90.0),
    (30.0, 30.0, 20.0, 135.0),
    (80.0, 45.0, 0.0, 10.0),
    (45.0, 30.0, 0.0, 15.0),
    (45.0, 30.0, 0.0, 70.0),
    (40.0, -20.0, 0.0, 15.0),
    (85.0, -15.0, 0.0, 10.0),
    (130.0, 20.0, 0.0, 15.0),
    (160.0, 0.0, 0.0, 15.0),
    (85.0, -10.0, -45.0, 90.0),
    (60.0, 40.0, 0.0, 95.0),
    (35.0, -30.0, 45.0, 85.0),
    (40.0, 60.0, 45.0, 100.0),
    (15.0, -50.0, 40.0, 60.0),
    (15.0, 40.0, 30.0, 30.0),
    (85.0, 70.0, 0.0, 30.0),
)
"""Arms as values of `ARM_HINGES` [deg]; the first is at rest."""
LEG_HINGES = ("hip_flexion", "hip_abduction", "hip_rotation", "knee_flexion")
LEGS_DEG = (
    (3.0, 3.0, 0.0, 5.0),
    (25.0, 3.0, 0.0, 10.0),
    (-12.0, 3.0, 0.0, 25.0),
    (5.0, 3.0, 0.0, 60.0),
    (3.0, 22.0, 0.0, 5.0),
    (25.0, 5.0, 0.0, 45.0),
    (55.0, 5.0, 0.0, 8.0),
    (55.0, 5.0, 0.0, 65.0),
    (85.0, 5.0, 0.0, 85.0),
    (85.0, 25.0, 0.0, 90.0),
    (80.0, 5.0, 0.0, 40.0),
    (80.0, 5.0, 0.0, 115.0),
    (85.0, 5.0, 25.0, 85.0),
    (105.0, 12.0, 0.0, 125.0),
    (95.0, 0.0, -10.0, 60.0),
)
"""Legs as values of `LEG_HINGES` [deg]; the first stands."""
STRIDE, TORSO_STRIDE = 7, 14
"""Every how many vertices of the tracking skin one is looked at, and of its torso."""


@dataclass(frozen=True)
class Part:
    """Thinned skin of one body part in each of its postures, root frame."""

    vertices: Float[ndarray, "p v 3"]
    """Vertices [m]."""
    normals: Float[ndarray, "p v 3"]
    """Outward unit normals."""


@dataclass(frozen=True)
class Postures:
    """All that a start can put together."""

    pitches_rad: Float[ndarray, " t"]
    """Forward pitch of the root for each trunk [rad]."""
    parts: tuple[tuple[Part, ...], ...]
    """Head, torso, right arm, left arm, right leg, left leg for each trunk."""
    qs: Float[ndarray, "t p nq"]
    """Configurations with trunk t, arms p and legs p; the root at the origin."""
    arms: Int[ndarray, " a"]
    """Hinge values in q of the arms, right then left."""
    legs: Int[ndarray, " a"]
    """The same of the legs."""

    def configuration(self, trunk: int, choice: Int[ndarray, " 4"]) -> ndarray:
        """Q of a trunk with right arm, left arm, right leg and left leg as chosen."""
        q = self.qs[trunk, 0].copy()
        half = len(self.arms) // 2, len(self.legs) // 2
        for hinges, chosen in (
            (self.arms[: half[0]], choice[0]),
            (self.arms[half[0] :], choice[1]),
            (self.legs[: half[1]], choice[2]),
            (self.legs[half[1] :], choice[3]),
        ):
            q[hinges] = self.qs[trunk, chosen, hinges]
        return q


def postures_of(human: Human) -> Postures:
    """Skin of one person in every posture.

    Args:
        human: Body and tracking skin.

    Returns:
        The postures.
    """
    body, skin = human.body, human.skin
    count = max(len(ARMS_DEG), len(LEGS_DEG))
    chest = skin.link_names.index("chest")
    thin = [
        np.flatnonzero(skin.labels == label)[:: STRIDE if label != 2 else TORSO_STRIDE]
        for label in range(1, len(LABELS))
    ]
    limbs = []
    for k in range(count):
        arm, leg = ARMS_DEG[min(k, len(ARMS_DEG) - 1)], LEGS_DEG[min(k, len(LEGS_DEG) - 1)]
        degrees = dict(zip(ARM_HINGES, arm, strict=True))
        limbs.append(_posed(human, degrees | dict(zip(LEG_HINGES, leg, strict=True))))
    arms, legs = limbs[: len(ARMS_DEG)], limbs[: len(LEGS_DEG)]
    parts, qs = [], []
    for _, flexion in TRUNKS_DEG:
        bent = {"spine_flexion": 0.6 * flexion, "chest_flexion": 0.4 * flexion}
        trunk = _posed(human, bent)
        moved = trunk.state.Ts_world_link[chest] @ invert_rigid(limbs[0].state.Ts_world_link[chest])
        R, p = moved[:3, :3], moved[:3, 3]
        found = [_part([trunk], thin[k]) for k in (0, 1)]
        for k in (2, 3):
            part = _part(arms, thin[k])
            found.append(Part(part.vertices @ R.T + p, part.normals @ R.T))
        found += [_part(legs, thin[k]) for k in (4, 5)]
        parts.append(tuple(found))
        of_trunk = np.stack([limb.state.q for limb in limbs])
        for name, value in bent.items():
            of_trunk[:, body.dof(name) + 1] = np.radians(value)
        qs.append(of_trunk)
    return Postures(
        np.radians([pitch for pitch, _ in TRUNKS_DEG]),
        tuple(parts),
        np.stack(qs),
        _hinges(human, ("shoulder", "elbow")),
        _hinges(human, ("hip", "knee")),
    )


class _Posed(NamedTuple):
    state: BodyState
    vertices: Float[ndarray, "v 3"]
    normals: Float[ndarray, "v 3"]


def _posed(human: Human, degrees: dict[str, float]) -> _Posed:
    state = run_kinematics(human.body, posed(human.body, degrees))
    vertices = skinned_vertices(state, human.skin)
    return _Posed(state, vertices, vertex_normals(vertices, human.skin.faces))


def _part(bodies: list[_Posed], index: Int[ndarray, " n"]) -> Part:
    """Some vertices of several postures."""
    return Part(
        np.stack([body.vertices[index] for body in bodies]),
        np.stack([body.normals[index] for body in bodies]),
    )


def _hinges(human: Human, stems: tuple[str, ...]) -> Int[ndarray, " a"]:
    """Where q holds the hinges of a pair of limbs, the right one first."""
    names = list(human.body.model.names)[2:]
    return np.array(
        [
            human.body.dof(name) + 1
            for side in "rl"
            for name in names
            if name.startswith(tuple(f"{side}_{stem}" for stem in stems))
        ]
    )


def root_rotation(yaw_rad: float, pitch_rad: float) -> Float[ndarray, "3 3"]:
    """Rotation of a root that looks along a yaw and is pitched forward."""
    return pin.rpy.rpyToMatrix(0.0, pitch_rad, yaw_rad)
