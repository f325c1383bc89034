# SPDX-License-Identifier: Apache-2.0
"""From a script of poses and steps to q(t) on a floor at z = 0.

The feet come first: each stands on a foothold or swings to the next one. The pelvis follows the
feet, and the legs are solved to join the two, so a planted foot cannot slide. Spine, head and arms
run through keys. The person starts at the origin, looking along x.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from jaxtyping import Bool, Float
from numpy import ndarray
from scipy.ndimage import minimum_filter1d

from kintrack.body import run_kinematics
from synthesis.motions.curves import SMOOTH_S, keyed, minimum_jerk, smooth
from synthesis.motions.legs import LEG_HINGES, foot_pose, solve_legs, yaw_matrix
from synthesis.people.person import SIDES, Person

RATE_HZ = 30.0
NARROWER_M = 0.03
"""How much further in than below the hip a foot stands [m]."""
TOE_OUT_RAD = np.radians(8.0)
BENT_DEG = (15.0, 0.0, 0.0, 30.0, 15.0, 0.0)
"""`LEG_HINGES` from which the first frame's legs are solved: knees forward [deg]."""
REACH = 0.993
"""Longest distance from hip to ankle, as a share of the straight leg."""
FOLLOW_S = 0.13
"""Standard deviation of the Gaussian by which the pelvis lags the feet [s]."""
WEIGHT_SHIFT = 0.35
"""How far the pelvis moves over the standing foot while the other swings, share of the way."""
ROLL_S, LAND_S = 0.16, 0.10
"""How long the foot rolls over the toe before a swing, and over the heel after it [s]."""
HEEL_OFF_RAD, HEEL_STRIKE_RAD = np.radians(28.0), np.radians(12.0)
"""Pitch of a full step's foot when it leaves and when it lands [rad]."""
FULL_STEP_M = 0.5
"""Step with the full foot pitch [m]; shorter ones pitch less."""
LIFT_M = 0.035
"""Ground clearance of a full step; half as much for a step in place [m]."""
PELVIS = ("forward", "left", "drop", "yaw", "pitch", "roll")
"""Pelvis channels, relative to where the feet carry it: leg lengths, then degrees."""


@dataclass(frozen=True)
class Step:
    """One foot moves to a new foothold."""

    side: str
    """`l` or `r`."""
    start_s: float
    """When the foot leaves the floor [s]."""
    end_s: float
    """When it stands again [s]."""
    forward_m: float
    """Displacement from where this foot started the motion, along x [m]."""
    left_m: float
    """The same along y [m]."""
    yaw_deg: float
    """Turn from how this foot started [deg]."""


@dataclass(frozen=True)
class Script:
    """What a person does."""

    duration_s: float
    """How long [s]."""
    keys: Mapping[str, tuple[tuple[float, float], ...]]
    """Hinge or `pelvis_` channel -> (time [s], value [deg or leg lengths])."""
    steps: tuple[Step, ...] = ()
    """Steps in time order."""


@dataclass(frozen=True)
class Footwork:
    """One foot through a script."""

    footholds: Float[ndarray, "n 3"]
    """x, y [m] and yaw [rad] of the flat foot."""
    swinging: Float[ndarray, " n"]
    """1 while the foot is on its way, else 0."""
    planted: Bool[ndarray, " n"]
    """True where the foot stands flat."""
    Ts_world_foot: list[pin.SE3]
    """Pose of the foot in each of the N frames."""


@dataclass(frozen=True)
class Motion:
    """A script performed by a person."""

    times_s: Float[ndarray, " n"]
    """Time of each frame [s]."""
    q: Float[ndarray, "n nq"]
    """Configurations, world frame, floor at z = 0."""
    planted: dict[str, Bool[ndarray, " n"]]
    """Per side, True where the foot stands flat on its foothold."""


def perform(person: Person, script: Script, rate_hz: float = RATE_HZ) -> Motion:
    """Run a script.

    Args:
        person: Who.
        script: What.
        rate_hz: Frames per second [Hz].

    Returns:
        The motion; frame n is at n / rate_hz.
    """
    times_s = np.arange(round(script.duration_s * rate_hz)) / rate_hz
    curves = {name: keyed(keys, times_s, rate_hz) for name, keys in script.keys.items()}
    for name, values in _idle(times_s).items():
        curves[name] = curves.get(name, 0.0) + values
    pelvis = {name: curves.pop(f"pelvis_{name}", np.zeros(len(times_s))) for name in PELVIS}
    body = person.body
    q = np.tile(body.neutral(), (len(times_s), 1))
    for name, values in curves.items():
        q[:, body.dof(name) + 1] = np.radians(values)
    feet = {side: _footwork(person, side, script.steps, times_s) for side in SIDES}
    legs = np.array([body.dof(f"{s}_{hinge}") + 1 for s in SIDES for hinge in LEG_HINGES])
    bent = np.radians(2 * BENT_DEG)
    for n, T in enumerate(_pelvis_path(person, feet, pelvis, rate_hz)):
        q[n, :7] = pin.SE3ToXYZQUAT(T)
        q[n, legs] = bent
        q[n] = solve_legs(body, q[n], {side: feet[side].Ts_world_foot[n] for side in SIDES})
        bent = q[n, legs]
    return Motion(times_s, q, {side: feet[side].planted for side in SIDES})


def _neutral_position(person: Person, link: str) -> Float[ndarray, " 3"]:
    """Origin of a link in zero pose, relative to the pelvis [m]."""
    state = run_kinematics(person.body, person.body.neutral())
    return state.Ts_world_link[person.skin.link_names.index(link)][:3, 3]


def _leg_length(person: Person) -> float:
    """Hip to ankle of the straight leg [m]."""
    hip, knee, ankle = (_neutral_position(person, f"l_{s}") for s in ("thigh", "shank", "foot"))
    return float(np.linalg.norm(knee - hip) + np.linalg.norm(ankle - knee))


def _idle(times_s: Float[ndarray, " n"]) -> dict[str, Float[ndarray, " n"]]:
    """Breath and sway of somebody who stands still; degrees and leg lengths."""
    breath = np.sin(2.0 * np.pi * 0.27 * times_s)
    return {
        "chest_flexion": -0.5 * breath,
        "l_clavicle_elevation": 0.8 * breath,
        "r_clavicle_elevation": 0.8 * breath,
        "head_flexion": 0.7 * np.sin(2.0 * np.pi * 0.19 * times_s + 1.0),
        "head_rotation": 0.9 * np.sin(2.0 * np.pi * 0.13 * times_s + 0.4),
        "pelvis_left": 0.005 * np.sin(2.0 * np.pi * 0.21 * times_s + 0.3),
        "pelvis_forward": 0.003 * np.sin(2.0 * np.pi * 0.33 * times_s),
    }


def _footwork(
    person: Person, side: str, steps: tuple[Step, ...], times_s: Float[ndarray, " n"]
) -> Footwork:
    """Where a foot is: on a foothold, rolling over toe or heel, or swinging to the next."""
    outward = 1.0 if side == "l" else -1.0
    start = _neutral_position(person, f"{side}_foot")
    first = np.array([start[0], start[1] - outward * NARROWER_M, outward * TOE_OUT_RAD])
    footholds = np.tile(first, (len(times_s), 1))
    pitch, lift, swinging = np.zeros((3, len(times_s)))
    here = first
    for step in (step for step in steps if step.side == side):
        there = first + [step.forward_m, step.left_m, np.radians(step.yaw_deg)]
        way = (there - here)[:2]
        size = min(1.0, float(np.linalg.norm(way)) / FULL_STEP_M)
        ahead = float(way @ [np.cos(here[2]), np.sin(here[2])]) / FULL_STEP_M
        u = (times_s - step.start_s) / (step.end_s - step.start_s)
        swing = (u > 0.0) & (u < 1.0)
        footholds[u >= 0.0] = here + minimum_jerk(u[u >= 0.0])[:, None] * (there - here)
        leaving = minimum_jerk((times_s - step.start_s) / ROLL_S + 1.0) * (u <= 0.0)
        landing = minimum_jerk((step.end_s - times_s) / LAND_S + 1.0) * (u >= 1.0)
        turned = minimum_jerk(u / 0.9)
        pitch += HEEL_OFF_RAD * size * (leaving + swing * (1.0 - turned))
        pitch -= HEEL_STRIKE_RAD * np.clip(ahead, 0.0, 1.0) * (landing + swing * turned)
        lift += LIFT_M * 0.5 * (1.0 + size) * swing * np.sin(np.pi * u) ** 2
        swinging += swing
        here = there
    poses = zip(footholds, pitch, lift, strict=True)
    return Footwork(
        footholds,
        swinging,
        (swinging == 0.0) & (np.abs(pitch) < 1e-9),
        [foot_pose(person, side, *pose) for pose in poses],
    )


def _pelvis_path(
    person: Person,
    feet: dict[str, Footwork],
    pelvis: dict[str, Float[ndarray, " n"]],
    rate_hz: float,
) -> list[pin.SE3]:
    """Pose of the pelvis: between the feet, over the standing one, as high as the legs allow."""
    left, right = feet["l"], feet["r"]
    lean = smooth(WEIGHT_SHIFT * (right.swinging - left.swinging), rate_hz, FOLLOW_S)
    aside = (left.footholds - right.footholds) * [1.0, 1.0, 0.0]
    between = 0.5 * (left.footholds + right.footholds + lean[:, None] * aside)
    between[:, 2] -= between[0, 2]
    between = smooth(between, rate_hz, FOLLOW_S)
    leg_m = _leg_length(person)
    ahead_m = leg_m * pelvis["forward"] - 0.5 * (left.footholds[0, 0] + right.footholds[0, 0])
    angles = np.radians([pelvis["roll"], pelvis["pitch"], pelvis["yaw"]]).T
    R, p = [], np.zeros((len(lean), 3))
    for n, (x, y, yaw) in enumerate(between):
        R_yaw = yaw_matrix(yaw)
        R.append(R_yaw @ pin.rpy.rpyToMatrix(*angles[n]))
        p[n] = np.array([x, y, 0.0]) + R_yaw @ [ahead_m[n], leg_m * pelvis["left"][n], 0.0]
    ceiling = np.full(len(R), np.inf)
    for side in SIDES:
        hip_pelvis = _neutral_position(person, f"{side}_thigh")
        for n, target in enumerate(feet[side].Ts_world_foot):
            hip = p[n] + R[n] @ hip_pelvis
            across = float(np.linalg.norm((hip - target.translation)[:2]))
            up = np.sqrt(max((REACH * leg_m) ** 2 - across**2, 0.0))
            ceiling[n] = min(ceiling[n], target.translation[2] + up - hip[2])
    height = np.minimum(ceiling, ceiling[0] - leg_m * pelvis["drop"])
    window = 2 * round(3.0 * SMOOTH_S * rate_hz) + 1
    p[:, 2] = smooth(minimum_filter1d(height, window, mode="nearest"), rate_hz)
    return [pin.SE3(R_n, p_n) for R_n, p_n in zip(R, p, strict=True)]
