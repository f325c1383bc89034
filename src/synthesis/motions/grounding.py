# SPDX-License-Identifier: Apache-2.0
"""Legs that reach the feet where the floor wants them, without turning a knee over."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
import pinocchio as pin
from jaxtyping import Float
from numpy import ndarray
from scipy.ndimage import gaussian_filter1d, minimum_filter1d

from kintrack.body import Body, run_kinematics
from kintrack.joints import JOINT_NAMES
from synthesis.motions.contacts import FootPath
from synthesis.motions.legs import LEG_HINGES, solve_legs
from synthesis.people.person import Person
from synthesis.people.population import SIDES

REACH = 0.995
"""Longest distance from hip to ankle, as a share of the straight leg."""
ASIDE_HINGES = ("hip_abduction", "hip_rotation", "ankle_inversion")
ASIDE_RAD = 0.25
"""A leg whose hinges aside of bending would change by more takes another posture [rad]."""
DEEPEST_M = 0.001
"""A foot may be this far below the floor [m]."""


def lowered(
    body: Body, q: Float[ndarray, "n nq"], feet: dict[str, FootPath], rate_hz: float
) -> Float[ndarray, "n nq"]:
    """Lower the root smoothly until both legs reach the feet.

    Args:
        body: The body.
        q: Configurations, shape (N, nq).
        feet: Where each foot shall be in the N frames.
        rate_hz: Frames per second [Hz].

    Returns:
        Configurations with the root moved down, shape (N, nq).
    """
    room = np.zeros(len(q))
    lengths = _leg_lengths(body)
    for n in range(len(q)):
        x = run_kinematics(body, q[n]).joint_positions_world
        for side, (thigh_m, shank_m) in lengths.items():
            hip = x[JOINT_NAMES.index(f"{side}_hip")]
            ankle = feet[side].Ts_world_foot[n].translation
            across_m = float(np.linalg.norm((hip - ankle)[:2]))
            up_m = np.sqrt(max((REACH * (thigh_m + shank_m)) ** 2 - across_m**2, 0.0))
            room[n] = min(room[n], ankle[2] + up_m - hip[2])
    sigma = 0.05 * rate_hz
    change = minimum_filter1d(room, 2 * round(2.0 * sigma) + 1, mode="nearest")
    out = np.array(q)
    out[:, 2] += gaussian_filter1d(change, sigma, mode="nearest", truncate=2.0)
    return out


def stood(
    person: Person,
    body: Body,
    q: Float[ndarray, " nq"],
    Ts_world_foot: dict[str, pin.SE3],
    free: Collection[str],
) -> Float[ndarray, " nq"]:
    """Solve the legs for the feet; a foot that its limits tilt into the floor is raised out of it.

    Args:
        person: Who.
        body: The person's body, perhaps with narrower limits.
        q: Configuration, shape (nq,).
        Ts_world_foot: Where each foot shall be, by side.
        free: Sides whose foot stands on no foothold; their legs are kept if the limits allow
            only quite another posture.

    Returns:
        Configuration with other legs, shape (nq,).
    """
    Ts = dict(Ts_world_foot)
    out = q
    for _ in range(3):
        out = solve_legs(body, _bent_to_reach(body, q, Ts), Ts)
        for side in free:
            asides = [body.dof(f"{side}_{hinge}") + 1 for hinge in ASIDE_HINGES]
            if np.abs(out[asides] - q[asides]).max() > ASIDE_RAD:
                leg = [body.dof(f"{side}_{hinge}") + 1 for hinge in LEG_HINGES]
                out[leg] = q[leg]
        state = run_kinematics(body, out)
        deepest_m = 0.0
        for side in SIDES:
            T = state.Ts_world_link[body.link_names.index(f"{side}_foot")]
            below_m = -float(T[2, 3] + (person.foot_points[side] @ T[2, :3]).min())
            deepest_m = max(deepest_m, below_m)
            if below_m > DEEPEST_M:
                Ts[side] = pin.SE3(Ts[side].rotation, Ts[side].translation + [0.0, 0.0, below_m])
        if deepest_m <= DEEPEST_M:
            break
    return out


def _leg_lengths(body: Body) -> dict[str, tuple[float, float]]:
    """Thigh and shank by side [m]."""
    x = dict(
        zip(JOINT_NAMES, run_kinematics(body, body.neutral()).joint_positions_world, strict=True)
    )
    return {
        s: (
            float(np.linalg.norm(x[f"{s}_hip"] - x[f"{s}_knee"])),
            float(np.linalg.norm(x[f"{s}_knee"] - x[f"{s}_ankle"])),
        )
        for s in SIDES
    }


def _bent_to_reach(
    body: Body, q: Float[ndarray, " nq"], Ts_world_foot: dict[str, pin.SE3]
) -> Float[ndarray, " nq"]:
    """Give the knees the angle that the distance from hip to ankle asks for (law of cosines).

    A solve that starts there does not meet the straight leg, where the knee could turn over.
    """
    x = run_kinematics(body, q).joint_positions_world
    out = np.array(q)
    for side, (thigh_m, shank_m) in _leg_lengths(body).items():
        hip = x[JOINT_NAMES.index(f"{side}_hip")]
        reach_m = np.linalg.norm(Ts_world_foot[side].translation - hip)
        cosine = (reach_m**2 - thigh_m**2 - shank_m**2) / (2.0 * thigh_m * shank_m)
        knee = body.dof(f"{side}_knee_flexion") + 1
        flexion = body.dof(f"{side}_hip_flexion") + 1
        angle = float(np.arccos(np.clip(cosine, -1.0, 1.0)))
        out[flexion] += 0.5 * (angle - out[knee])
        out[knee] = angle
    out[7:] = np.clip(out[7:], body.lower[6:], body.upper[6:])
    return out
