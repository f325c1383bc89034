# SPDX-License-Identifier: Apache-2.0
"""One foot through a script: on a foothold, rolling over toe or heel, or swinging to the next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from jaxtyping import Bool, Float
from numpy import ndarray

from kintrack.body import run_kinematics
from synthesis.motions.curves import minimum_jerk
from synthesis.motions.legs import foot_pose
from synthesis.people.person import Person

FULL_STEP_M = 0.5
"""Step with the full foot pitch [m]; shorter ones pitch less."""


@dataclass(frozen=True)
class Stance:
    """How the feet stand at first; the default is at ease."""

    narrower_m: float = 0.03
    """How much further in than below the hip a foot stands; below zero for a wide stance [m]."""
    toe_out_deg: tuple[float, float] = (8.0, 8.0)
    """How far the left and the right foot point outwards [deg]."""
    left_ahead_m: float = 0.0
    """How far the left foot stands before the right one [m]."""

    def foothold(self, person: Person, side: str) -> Float[ndarray, " 3"]:
        """x, y [m] and yaw [rad] of a foot of somebody at the origin who looks along x."""
        outward = 1.0 if side == "l" else -1.0
        x, y, _ = neutral_position(person, f"{side}_foot")
        toe_out = np.radians(self.toe_out_deg[0 if side == "l" else 1])
        ahead = 0.5 * outward * self.left_ahead_m
        return np.array([x + ahead, y - outward * self.narrower_m, outward * toe_out])


AT_EASE = Stance()
"""Feet a little further in than the hips, turned out a little."""


@dataclass(frozen=True)
class Gait:
    """How somebody steps."""

    follow_s: float = 0.13
    """Standard deviation of the Gaussian by which the pelvis lags the feet [s]."""
    weight_shift: float = 0.35
    """How far the pelvis moves over the standing foot, share of the way."""
    heel_off_deg: float = 28.0
    """Pitch of a full step's foot when it leaves [deg]."""
    heel_strike_deg: float = 12.0
    """The same when it lands [deg]."""
    lift_m: float = 0.035
    """Ground clearance of a full step; half as much for a step in place [m]."""
    roll_s: float = 0.16
    """How long the foot rolls over the toe before a swing [s]."""
    land_s: float = 0.10
    """How long it rolls over the heel after one [s]."""
    settle_s: float = 0.06
    """Standard deviation of the Gaussian that rounds the height of the pelvis [s]."""
    glide: float = 0.0
    """0: the foot swings with minimum jerk; 1: at a more even speed, 3 u^2 - 2 u^3."""


UNHURRIED = Gait()
"""Careful steps of somebody who stands or turns."""


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


def neutral_position(person: Person, link: str) -> Float[ndarray, " 3"]:
    """Origin of a link in zero pose, relative to the pelvis [m]."""
    state = run_kinematics(person.body, person.body.neutral())
    return state.Ts_world_link[person.skin.link_names.index(link)][:3, 3]


def footwork(
    person: Person,
    side: str,
    steps: tuple[Step, ...],
    stance: Stance,
    gait: Gait,
    times_s: Float[ndarray, " n"],
    heel_deg: Float[ndarray, " n"],
) -> Footwork:
    """Where a foot is.

    Args:
        person: Whose foot.
        side: `l` or `r`.
        steps: Steps of both feet, in time order.
        stance: Where the feet stand at first.
        gait: How they step.
        times_s: Time of each frame [s], shape (N,).
        heel_deg: How far the heel is raised besides [deg], shape (N,).

    Returns:
        Its footholds and poses.
    """
    first = stance.foothold(person, side)
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
        v = np.clip(u, 0.0, 1.0)
        moved = (1.0 - gait.glide) * minimum_jerk(v) + gait.glide * v * v * (3.0 - 2.0 * v)
        footholds[u >= 0.0] = (here + moved[:, None] * (there - here))[u >= 0.0]
        leaving = minimum_jerk((times_s - step.start_s) / gait.roll_s + 1.0) * (u <= 0.0)
        landing = minimum_jerk((step.end_s - times_s) / gait.land_s + 1.0) * (u >= 1.0)
        turned = minimum_jerk(u / 0.9)
        off = np.radians(gait.heel_off_deg) * size
        pitch += off * (leaving + swing * (1.0 - turned))
        strike = np.radians(gait.heel_strike_deg) * np.clip(ahead, 0.0, 1.0)
        pitch -= strike * (landing + swing * turned)
        lift += gait.lift_m * 0.5 * (1.0 + size) * swing * np.sin(np.pi * u) ** 2
        swinging += swing
        here = there
    pitch = pitch + np.radians(np.maximum(heel_deg, 0.0))
    poses = zip(footholds, pitch, lift, strict=True)
    return Footwork(
        footholds,
        swinging,
        (swinging == 0.0) & (np.abs(pitch) < 1e-9),
        [foot_pose(person, side, *pose) for pose in poses],
    )
