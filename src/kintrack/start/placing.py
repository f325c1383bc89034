# SPDX-License-Identifier: Apache-2.0
"""Where a body of every heading and trunk would be, and which arms and legs it would have.

Only the translation and the choice of four limbs are open, so one try takes a fraction of a
millisecond and the whole circle can be tried.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin
from jaxtyping import Float, Int
from numpy import ndarray

from kintrack.alignment import View
from kintrack.geometry import invert_rigid, transform_points
from kintrack.start.cost import mismatch, place
from kintrack.start.evidence import Evidence
from kintrack.start.postures import STRIDE, TORSO_STRIDE, Postures, root_rotation

SKIN_M2 = 1.8
"""An adult's skin [m^2]."""
WEAK_M2 = 0.03
"""A limb that shows less than this may be anywhere: its posture is a guess [m^2]."""
VIEW_STRIDE = 2
"""Every how many vertices of a part one is looked at once the body is fitted."""


class Guess(NamedTuple):
    """A body put where the evidence is."""

    mismatch_m2: float
    """See `kintrack.start.cost` [m^2]."""
    q: Float[ndarray, " nq"]
    """Configuration."""
    unrest_m2: float
    """What its limbs cost besides, for not being at rest [m^2]."""


class _Try(NamedTuple):
    cost: float
    unrest: float
    trunk: int
    yaw_rad: float
    t: Float[ndarray, " 3"]
    choice: Int[ndarray, " 4"]


def guesses(
    postures: Postures, evidence: Evidence, headings: int, side_m: float, vertices: int, kept: int
) -> list[Guess]:
    """Every heading with every trunk, put where the evidence is.

    Args:
        postures: Of the person.
        evidence: Of the frame.
        headings: Yaws tried, evenly over the circle.
        side_m: How far a limb's side is believed [m].
        vertices: Of the whole tracking skin.
        kept: So many of the best tries get a second choice of limbs.

    Returns:
        The `kept` best guesses, the best first, each followed by one whose hardly seen limbs rest,
        if that is another one, at the price of the first; none without a point.
    """
    if len(evidence.points_world) == 0:
        return []
    T = evidence.T_world_camera
    T_camera_world = invert_rigid(T)
    skins = [tuple(np.ascontiguousarray(p.vertices) for p in t) for t in postures.parts]
    normals = [tuple(np.ascontiguousarray(p.normals) for p in t) for t in postures.parts]
    each = np.full(6, STRIDE * SKIN_M2 / vertices)
    each[1] = TORSO_STRIDE * SKIN_M2 / vertices

    def attempt(trunk: int, yaw: float, t: ndarray, choice: ndarray, turns: int) -> _Try:
        R = root_rotation(yaw, postures.pitches_rad[trunk])
        cost, unrest = place(
            np.ascontiguousarray(evidence.points_world @ R),
            evidence.weights_m2,
            evidence.ends,
            skins[trunk],
            normals[trunk],
            T[:3, 3] @ R,
            np.ascontiguousarray(T_camera_world[:3, :3] @ R),
            T_camera_world[:3, 3],
            evidence.intrinsics,
            evidence.depth_m,
            evidence.away_px,
            evidence.labels,
            evidence.has_background,
            each,
            side_m**2,
            turns,
            t,
            choice,
        )
        return _Try(float(cost + unrest), float(unrest), trunk, yaw, t, choice)

    tries = [
        attempt(trunk, 2 * np.pi * n / headings, np.full(3, np.nan), np.zeros(4, np.int64), 1)
        for trunk in range(len(skins))
        for n in range(headings)
    ]
    best = sorted(tries, key=lambda one: one.cost)[:kept]
    again = [attempt(one.trunk, one.yaw_rad, one.t, one.choice, 2) for one in best]
    areas = np.add.reduceat(np.r_[evidence.weights_m2, 0.0], evidence.ends[2:6])
    areas[evidence.ends[2:6] == evidence.ends[3:7]] = 0.0
    found = []
    for one in sorted(again, key=lambda one: one.cost):
        R = root_rotation(one.yaw_rad, postures.pitches_rad[one.trunk])
        choices = [one.choice, rested(one.choice, areas)]
        for choice in choices if (choices[0] != choices[1]).any() else choices[:1]:
            q = postures.configuration(one.trunk, choice)
            q[:3], q[3:7] = R @ one.t, pin.Quaternion(R).coeffs()
            found.append(Guess(one.cost - one.unrest, q, one.unrest))
    return found


def rested(choice: Int[ndarray, " 4"], areas_m2: Float[ndarray, " 4"]) -> Int[ndarray, " 4"]:
    """The choice with hardly seen arms at rest, and a hardly seen leg as the other one is."""
    weak, out = areas_m2 < WEAK_M2, choice.copy()
    out[:2][weak[:2]] = 0
    if weak[2:].any():
        out[2:] = out[2 + int(areas_m2[3] > areas_m2[2])]
    return out


def view_mismatch(view: View, evidence: Evidence, side_m: float, part_m: float) -> float:
    """Mismatch of posed skin with a person, see `kintrack.start.cost` [m^2].

    Args:
        view: The skin seen by the camera.
        evidence: Of the person.
        side_m: How far a limb's side is believed [m].
        part_m: How far a part is believed [m].
    """
    visible = [
        np.ascontiguousarray(
            view.vertices_camera[view.visible & (view.labels == part)][None, ::VIEW_STRIDE]
        )
        for part in range(1, 7)
    ]
    here, level = np.zeros(3), np.eye(3)
    owner = np.repeat(np.arange(6), np.diff(evidence.ends))
    return float(
        mismatch(
            transform_points(invert_rigid(evidence.T_world_camera), evidence.points_world),
            evidence.weights_m2,
            evidence.ends,
            owner,
            tuple(visible),
            tuple(-v for v in visible),
            np.zeros(6, np.int64),
            here,
            here,
            level,
            here,
            evidence.intrinsics,
            evidence.depth_m,
            evidence.away_px,
            evidence.labels,
            evidence.has_background,
            np.full(6, VIEW_STRIDE * SKIN_M2 / len(view.labels)),
            side_m**2,
            part_m**2,
        )
    )
