# SPDX-License-Identifier: Apache-2.0
"""From a script of poses and steps to q(t) on a floor at z = 0.

The feet come first: each stands on a foothold or swings to the next one. The pelvis follows the
feet, and the legs are solved to join the two, so a planted foot cannot slide. Spine, head and arms
run through keys. The person starts at the origin, looking along x.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin
from jaxtyping import Bool, Float
from numpy import ndarray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from kintrack.body import leg_length
from synthesis.motions.curves import keyed, smooth
from synthesis.motions.footwork import (
    Footwork,
    Gait,
    Stance,
    Step,
    footwork,
    neutral_position,
)
from synthesis.motions.legs import LEG_HINGES, solve_legs, yaw_matrix
from synthesis.people.person import SIDES, Person

RATE_HZ = 30.0
BENT_DEG = (15.0, 0.0, 0.0, 30.0, 15.0, 0.0)
"""`LEG_HINGES` from which the first frame's legs are solved: knees forward [deg]."""
REACH = 0.993
"""Longest distance from hip to ankle, as a share of the straight leg."""
PELVIS = ("forward", "left", "drop", "yaw", "pitch", "roll")
"""Pelvis channels, relative to where the feet carry it: leg lengths, then degrees."""
LOWERINGS = 60
"""Rounds in which the pelvis' height is lowered to what the legs allow."""
LIMIT_MARGIN_RAD = 0.002
"""How far inside its limits a scripted hinge stays [rad]."""


@dataclass(frozen=True)
class Script:
    """What a person does."""

    duration_s: float
    """How long [s]."""
    keys: Mapping[str, tuple[tuple[float, float], ...]]
    """Hinge, `pelvis_` channel, or `l_heel`, `r_heel`, how far a standing foot's heel is raised ->
    (time [s], value [deg or leg lengths])."""
    steps: tuple[Step, ...] = ()
    """Steps in time order."""
    stance: Stance = Stance()
    """Where the feet stand at first."""
    gait: Gait = Gait()
    """How they step."""
    curves: Mapping[str, Float[ndarray, " n"]] = field(default_factory=dict)
    """Added to the keys: channel -> a value for every frame [deg or leg lengths]."""
    breath_rad: float = 0.0
    """Phase of breath and sway at the start [rad]."""


@dataclass(frozen=True)
class Motion:
    """A script performed by a person."""

    times_s: Float[ndarray, " n"]
    """Time of each frame [s]."""
    q: Float[ndarray, "n nq"]
    """Configurations, world frame, floor at z = 0."""
    planted: dict[str, Bool[ndarray, " n"]]
    """Per side, True where the foot stands flat on its foothold."""


def frame_times(duration_s: float, rate_hz: float = RATE_HZ) -> Float[ndarray, " n"]:
    """Times of the frames of a script [s]; frame n is at n / rate_hz."""
    return np.arange(round(duration_s * rate_hz)) / rate_hz


def perform(person: Person, script: Script, rate_hz: float = RATE_HZ) -> Motion:
    """Run a script.

    Args:
        person: Who.
        script: What.
        rate_hz: Frames per second [Hz].

    Returns:
        The motion; frame n is at n / rate_hz.
    """
    times_s = frame_times(script.duration_s, rate_hz)
    curves = {name: keyed(keys, times_s, rate_hz) for name, keys in script.keys.items()}
    for added in (script.curves, _idle(times_s, script.breath_rad)):
        for name, values in added.items():
            curves[name] = curves.get(name, 0.0) + values
    pelvis = {name: curves.pop(f"pelvis_{name}", np.zeros(len(times_s))) for name in PELVIS}
    heels = {side: curves.pop(f"{side}_heel", np.zeros(len(times_s))) for side in SIDES}
    body = person.body
    q = np.tile(body.neutral(), (len(times_s), 1))
    for name, values in curves.items():
        k = body.dof(name)
        q[:, k + 1] = np.clip(
            np.radians(values), body.lower[k] + LIMIT_MARGIN_RAD, body.upper[k] - LIMIT_MARGIN_RAD
        )
    feet = {
        side: footwork(person, side, script.steps, script.stance, script.gait, times_s, heels[side])
        for side in SIDES
    }
    legs = np.array([body.dof(f"{s}_{hinge}") + 1 for s in SIDES for hinge in LEG_HINGES])
    bent = np.radians(2 * BENT_DEG)
    longest_m = REACH * leg_length(person.body)
    hips = {side: neutral_position(person, f"{side}_thigh") for side in SIDES}
    for n, T in enumerate(_pelvis_path(person, feet, pelvis, script.gait, rate_hz)):
        q[n, :7] = pin.SE3ToXYZQUAT(T)
        q[n, legs] = bent
        targets = {
            side: _within_reach(feet[side].Ts_world_foot[n], T.act(hips[side]), longest_m)
            for side in SIDES
        }
        q[n] = solve_legs(body, q[n], targets)
        bent = q[n, legs]
    return Motion(times_s, q, {side: feet[side].planted for side in SIDES})


def _idle(times_s: Float[ndarray, " n"], phase_rad: float) -> dict[str, Float[ndarray, " n"]]:
    """Breath and sway of somebody who stands still; degrees and leg lengths."""
    breath = np.sin(2.0 * np.pi * 0.27 * times_s + phase_rad)
    return {
        "chest_flexion": -0.5 * breath,
        "l_clavicle_elevation": 0.8 * breath,
        "r_clavicle_elevation": 0.8 * breath,
        "head_flexion": 0.7 * np.sin(2.0 * np.pi * 0.19 * times_s + 1.0 + phase_rad),
        "head_rotation": 0.9 * np.sin(2.0 * np.pi * 0.13 * times_s + 0.4 + phase_rad),
        "pelvis_left": 0.005 * np.sin(2.0 * np.pi * 0.21 * times_s + 0.3 + phase_rad),
        "pelvis_forward": 0.003 * np.sin(2.0 * np.pi * 0.33 * times_s + phase_rad),
    }


def _pelvis_path(
    person: Person,
    feet: dict[str, Footwork],
    pelvis: dict[str, Float[ndarray, " n"]],
    gait: Gait,
    rate_hz: float,
) -> list[pin.SE3]:
    """Pose of the pelvis: between the feet, over the standing one, as high as the legs let it."""
    left, right = feet["l"], feet["r"]
    lean = smooth(gait.weight_shift * (right.swinging - left.swinging), rate_hz, gait.follow_s)
    aside = (left.footholds - right.footholds) * [1.0, 1.0, 0.0]
    between = 0.5 * (left.footholds + right.footholds + lean[:, None] * aside)
    between[:, 2] -= between[0, 2]
    between = smooth(between, rate_hz, gait.follow_s)
    leg_m = leg_length(person.body)
    ankle_x = 0.5 * (left.footholds[0, 0] + right.footholds[0, 0])
    ahead_m = leg_m * pelvis["forward"] - ankle_x
    angles = np.radians([pelvis["roll"], pelvis["pitch"], pelvis["yaw"]]).T
    R, p = [], np.zeros((len(lean), 3))
    for n, (x, y, yaw) in enumerate(between):
        R_yaw = yaw_matrix(yaw)
        R.append(R_yaw @ pin.rpy.rpyToMatrix(*angles[n]))
        p[n] = np.array([x, y, 0.0]) + R_yaw @ [ahead_m[n], leg_m * pelvis["left"][n], 0.0]
    ceiling, upright_m = np.full(len(R), np.inf), np.inf
    start = np.array([between[0, 0] - ankle_x, between[0, 1], 0.0])
    for side in SIDES:
        hip_pelvis = neutral_position(person, f"{side}_thigh")
        targets = feet[side].Ts_world_foot
        upright_m = min(upright_m, _highest(start + hip_pelvis, targets[0], leg_m) - hip_pelvis[2])
        for n, target in enumerate(targets):
            arm = R[n] @ hip_pelvis
            if feet[side].swinging[n] == 0.0:
                ceiling[n] = min(ceiling[n], _highest(p[n] + arm, target, leg_m) - arm[2])
    wanted = np.minimum(ceiling, upright_m - leg_m * pelvis["drop"])
    p[:, 2] = _below(wanted, ceiling, gait.settle_s, rate_hz)
    return [pin.SE3(R_n, p_n) for R_n, p_n in zip(R, p, strict=True)]


def _below(
    wanted: Float[ndarray, " n"],
    ceiling: Float[ndarray, " n"],
    settle_s: float,
    rate_hz: float,
) -> Float[ndarray, " n"]:
    """A smooth curve near the wanted one and nowhere above the ceiling, lowered where it must be.

    What sticks out is widened, smoothed and taken off until nothing does; the last resort is the
    lowest value near each frame.
    """
    width = 2 * round(1.5 * settle_s * rate_hz) + 1
    height = smooth(wanted, rate_hz, settle_s)
    for _ in range(LOWERINGS):
        excess = height - ceiling
        if excess.max() <= 0.0:
            return height
        over = maximum_filter1d(np.maximum(excess + 1e-5, 0.0), width, mode="nearest")
        height = height - smooth(over, rate_hz, settle_s)
    window = 2 * round(3.0 * settle_s * rate_hz) + 1
    return smooth(minimum_filter1d(wanted, window, mode="nearest"), rate_hz, settle_s)


def _highest(hip: Float[ndarray, " 3"], foot: pin.SE3, leg_m: float) -> float:
    """Height at which a hip above a place can still reach a foot [m]."""
    across = float(np.linalg.norm((hip - foot.translation)[:2]))
    return foot.translation[2] + np.sqrt(max((REACH * leg_m) ** 2 - across**2, 0.0))


def _within_reach(foot: pin.SE3, hip: Float[ndarray, " 3"], longest_m: float) -> pin.SE3:
    """A swinging foot's target, drawn towards the hip if the leg is too short for it."""
    way = hip - foot.translation
    excess = max(0.0, 1.0 - longest_m / float(np.linalg.norm(way)))
    return pin.SE3(foot.rotation, foot.translation + excess * way)
